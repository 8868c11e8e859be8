/* viewer.js -- the lit ball, in WebGL2. The picture of one lamp is the one that plot_sphere.c makes. */
'use strict';

const vertexSource = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3. : -1., gl_VertexID == 2 ? 3. : -1., 0., 1.); }`;

const fragmentSource = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler3D;
uniform sampler3D tableLeft, tableRight;  // [theta_h][theta_d][phi_d]: f, 1/sr
uniform vec2 canvas;
uniform vec3 lamp;        // unit, towards it, in the viewer's frame: x right, y up, z to the viewer
uniform mat3 turn;        // viewer's frame from the world's
uniform float split, exposure;
uniform int shape, studio;
out vec4 color;
const float PI = 3.14159265358979;

vec3 brdf(sampler3D table, vec3 n, vec3 wi, vec3 wo) {
  vec3 h = normalize(wi + wo), flat_h = h - n * dot(n, h);
  float sine = length(flat_h), cosine = dot(n, h);
  vec3 e = sine > 1e-6 ? flat_h / sine : normalize(abs(n.x) < .7 ? cross(n, vec3(1, 0, 0)) : cross(n, vec3(0, 1, 0)));
  vec3 t = e * cosine - n * sine, b = cross(n, e);
  vec3 d = vec3(dot(wi, t), dot(wi, b), dot(wi, h));
  float phi = atan(d.y, d.x);
  return lookup(table, vec3(atan(sine, cosine), atan(length(d.xy), d.z), phi < 0. ? phi + PI : phi));
}

vec3 lit(sampler3D table, vec3 n, vec3 wo, vec3 wi) {
  return dot(n, wi) > 0. && dot(n, wo) > 0. ? PI * dot(n, wi) * brdf(table, n, wi, wo) : vec3(0);
}

// A window, a bright wall and the sky: directions over three rectangles, fixed in the world.
vec3 lit_studio(sampler3D table, vec3 n, vec3 wo) {
  vec3 sum = vec3(0);
  for (int i = 0; i < 16; i++) {
    vec2 u = (vec2(i & 3, i >> 2) + .5) / 4. - .5;
    sum += 2.2 * lit(table, n, wo, turn * normalize(vec3(-1.2 + .3 * u.x, .9 + 1.1 * u.y, .9 + .9 * u.x)));
    sum += .35 * lit(table, n, wo, turn * normalize(vec3(1.6, .2 + 1.6 * u.y, .4 + 1.8 * u.x)));
    sum += .35 * lit(table, n, wo, turn * normalize(vec3(2. * u.x, 1.4, 2. * u.y - .3)));
  }
  return sum / 16.;
}

// A ring of radius .66, .32 thick, by sphere tracing.
float ring(vec3 p) { return length(vec2(length(p.xz) - .66, p.y)) - .32; }

// The normal where the ray that is parallel to z meets the shape. false: it misses.
bool surface(vec2 p, out vec3 n) {
  if (shape == 0) {
    float r2 = dot(p, p);
    n = vec3(p, sqrt(max(0., 1. - r2)));
    return r2 < 1.;
  }
  vec3 from = transpose(turn) * vec3(p, 1.5), way = transpose(turn) * vec3(0, 0, -1);
  float s = 0.;
  for (int i = 0; i < 90; i++) {
    float d = ring(from + s * way);
    s += d;
    if (d < 1e-4 || s > 3.) break;
  }
  if (s > 3.) return false;
  vec3 q = from + s * way;
  float r = length(q.xz);
  n = turn * normalize(q - vec3(q.x, 0, q.z) * (.66 / r));
  return true;
}

vec3 encode(vec3 x) {
  x = clamp(x, 0., 1.);
  return mix(12.92 * x, 1.055 * pow(x, vec3(1. / 2.4)) - .055, greaterThan(x, vec3(.0031308)));
}

void main() {
  vec2 p = (gl_FragCoord.xy - .5 * canvas) / (.5 * canvas);
  vec3 n, wo = vec3(0, 0, 1), light;
  bool left = gl_FragCoord.x < split * canvas.x;
  color = vec4(0);
  if (surface(p, n)) {
    if (studio == 1)
      light = left ? lit_studio(tableLeft, n, wo) : lit_studio(tableRight, n, wo);
    else
      light = left ? lit(tableLeft, n, wo, lamp) : lit(tableRight, n, wo, lamp);
    color = vec4(encode(exposure * light), 1);
  }
  if (split > 0. && split < 1. && abs(gl_FragCoord.x - split * canvas.x) < 1. && color.a > 0.)
    color.rgb = mix(color.rgb, vec3(1), .5);
}`;

/* Linear between rows, as lookup.c does: rows of theta_h and theta_d stand at 0 and at the middles of bins. */
const lookupSource = `
int between(float bins, int rows, out float share) {
  float place = bins < .5 ? 2. * bins : bins + .5;
  int low = clamp(int(place), 0, rows - 2);
  share = clamp(place - float(low), 0., 1.);
  return low;
}
vec3 lookup(sampler3D table, vec3 angles) {
  ivec3 size = textureSize(table, 0);  // phi_d, theta_d, theta_h
  vec3 share;
  float around = angles.z / PI * float(size.x) - .5;
  around = around < 0. ? around + float(size.x) : around;
  int p = min(int(around), size.x - 1), next = (p + 1) % size.x;
  share.x = around - float(p);
  int d = between(angles.y / (.5 * PI) * float(size.y - 1), size.y, share.y);
  int h = between(sqrt(angles.x / (.5 * PI)) * float(size.z - 1), size.z, share.z);
  vec3 sum = vec3(0);
  for (int k = 0; k < 8; k++) {
    ivec3 corner = ivec3(k & 1, k >> 1 & 1, k >> 2);
    vec3 w = mix(1. - share, share, vec3(corner));
    sum += w.x * w.y * w.z * texelFetch(table, ivec3(corner.x == 0 ? p : next, d + corner.y, h + corner.z), 0).rgb;
  }
  return sum;
}
`;

const byId = (id) => document.getElementById(id);
const chosen = (name) => document.querySelector(`input[name="${name}"]:checked`).value;

function compile(gl, type, source) {
  const shader = gl.createShader(type);
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
  return shader;
}

function makeProgram(gl) {
  const program = gl.createProgram();
  const [head, tail] = fragmentSource.split('vec3 brdf(');
  gl.attachShader(program, compile(gl, gl.VERTEX_SHADER, vertexSource));
  gl.attachShader(program, compile(gl, gl.FRAGMENT_SHADER, `${head}${lookupSource}vec3 brdf(${tail}`));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  return program;
}

/* Columns of Rx(b) Ry(a). */
function turnMatrix(a, b) {
  const [ca, sa, cb, sb] = [Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b)];
  return [ca, sb * sa, -cb * sa, 0, cb, sb, sa, -sb * ca, cb * ca];
}

const times = (m, v) => [0, 1, 2].map((r) => m[r] * v[0] + m[3 + r] * v[1] + m[6 + r] * v[2]);
const timesTransposed = (m, v) => [0, 1, 2].map((c) => m[3 * c] * v[0] + m[3 * c + 1] * v[1] + m[3 * c + 2] * v[2]);

class Viewer {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext('webgl2', { preserveDrawingBuffer: true, premultipliedAlpha: false });
    if (!this.gl) throw new Error('there is no WebGL2 here');
    this.program = makeProgram(this.gl);
    this.textures = new Map();
    this.limit = this.gl.getParameter(this.gl.MAX_3D_TEXTURE_SIZE);
    this.reset();
  }

  reset() {
    this.azimuth = this.elevation = 0;
    this.lampWorld = [-0.4, 0.3, Math.sqrt(0.75)];
  }

  async texture(k) {
    if (!this.textures.has(k)) {
      const gl = this.gl, table = await tableNumber(k), [h, d, phi] = table.size;
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_3D, texture);
      for (const name of ['TEXTURE_MIN_FILTER', 'TEXTURE_MAG_FILTER']) gl.texParameteri(gl.TEXTURE_3D, gl[name], gl.NEAREST);
      gl.texImage3D(gl.TEXTURE_3D, 0, gl.RGBA32F, phi, d, h, 0, gl.RGBA, gl.FLOAT, table.value);
      this.textures.set(k, texture);
    }
    return this.textures.get(k);
  }

  get lamp() { return times(turnMatrix(this.azimuth, this.elevation), this.lampWorld); }
  set lamp(v) { this.lampWorld = timesTransposed(turnMatrix(this.azimuth, this.elevation), v); }

  async draw() {
    const gl = this.gl, program = this.program, at = (name) => gl.getUniformLocation(program, name);
    const sides = [await this.texture(+byId('left').value), await this.texture(+byId('right').value)];
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.useProgram(program);
    sides.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_3D, texture);
      gl.uniform1i(at(unit ? 'tableRight' : 'tableLeft'), unit);
    });
    gl.uniform2f(at('canvas'), this.canvas.width, this.canvas.height);
    gl.uniform3fv(at('lamp'), this.lamp);
    gl.uniformMatrix3fv(at('turn'), false, turnMatrix(this.azimuth, this.elevation));
    gl.uniform1f(at('split'), byId('split').value / 100);
    gl.uniform1f(at('exposure'), 2 ** byId('exposure').value);
    gl.uniform1i(at('shape'), +chosen('shape'));
    gl.uniform1i(at('studio'), +chosen('light'));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    this.canvas.dataset.drawn = String(Number(this.canvas.dataset.drawn || 0) + 1);
  }

  /* Moves what "Dragging moves" says by parts of the ball's radius. */
  move(x, y) {
    if (chosen('drag') === 'view') {
      this.azimuth += x;
      this.elevation = Math.max(-1.5, Math.min(1.5, this.elevation + y));
      return;
    }
    const [ca, sa, cb, sb] = [Math.cos(x), Math.sin(x), Math.cos(y), Math.sin(y)];
    let [lx, ly, lz] = this.lamp;
    [lx, lz] = [lx * ca + lz * sa, lz * ca - lx * sa];
    [ly, lz] = [ly * cb - lz * sb, lz * cb + ly * sb];
    const length = Math.hypot(lx, ly, lz);
    this.lamp = [lx / length, ly / length, lz / length];
  }
}

function sayLamp(viewer) {
  const z = viewer.lamp[2];
  const degrees = Math.round(Math.acos(Math.max(-1, Math.min(1, z))) * 180 / Math.PI);
  byId('lamp-note').textContent = chosen('light') === '1' ? 'Lit from a window, a wall and the sky.' : `The lamp is ${degrees}\u00b0 off the view.`;
  const stops = Number(byId('exposure').value);
  byId('exposure-value').textContent = `${stops > 0 ? '+' : ''}${stops} stops`;
  for (const side of ['left', 'right']) byId(`${side}-name`).textContent = byId(side).selectedOptions[0].textContent;
  const split = Number(byId('split').value);
  byId('left-name').hidden = split === 0;
  byId('right-name').hidden = split === 100;
}

function offerTables() {
  tableElements.forEach((element, k) => {
    for (const side of ['left', 'right']) byId(side).add(new Option(element.dataset.name, k));
  });
  byId('right').value = String(Math.min(1, tableElements.length - 1));
}

function followPointer(canvas, moved) {
  let last = null;
  canvas.addEventListener('pointerdown', (e) => {
    last = [e.clientX, e.clientY];
    canvas.setPointerCapture(e.pointerId);
  });
  canvas.addEventListener('pointermove', (e) => {
    if (!last) return;
    const radius = canvas.clientWidth / 2;
    moved((e.clientX - last[0]) / radius, (e.clientY - last[1]) / radius);
    last = [e.clientX, e.clientY];
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { last = null; });
  canvas.addEventListener('keydown', (e) => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[e.key];
    if (!way) return;
    e.preventDefault();
    moved(0.07 * way[0], 0.07 * way[1]);
  });
}

function startViewer() {
  if (!tableElements.length) return;
  const canvas = byId('sphere');
  let viewer;
  offerTables();
  try {
    viewer = new Viewer(canvas);
  } catch (problem) {
    canvas.hidden = true;
    byId('still').hidden = false;
    byId('viewer-controls').innerHTML = '<p>This browser has no WebGL2: the picture is a still one, the table at the left, the best fit at the right.</p>';
    return;
  }
  let due = false;
  const draw = () => {
    sayLamp(viewer);
    if (due) return;
    due = true;
    requestAnimationFrame(async () => { due = false; await viewer.draw(); });
  };
  followPointer(canvas, (x, y) => { viewer.move(x, y); draw(); });
  byId('viewer-controls').addEventListener('input', draw);
  byId('start-again').addEventListener('click', () => {
    viewer.reset();
    byId('viewer-controls').reset();
    byId('right').value = String(Math.min(1, tableElements.length - 1));
    draw();
  });
  draw();
}
startViewer();
