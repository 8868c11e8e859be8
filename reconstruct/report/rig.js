/* rig.js -- board, cameras, sample and lamps, sketched in space: parallel projection, turned by hand. */
'use strict';

const rigData = JSON.parse(byId('data').textContent).rig;

function svgElement(name, attributes, title) {
  const element = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (title) element.append(Object.assign(document.createElementNS('http://www.w3.org/2000/svg', 'title'), { textContent: title }));
  return element;
}

const plus = (a, b, s = 1) => a.map((x, i) => x + s * b[i]);
const ringOf = (center, u, v, radius) => Array.from({ length: 49 }, (_, k) =>
  plus(plus(center, u, radius * Math.cos(k * Math.PI / 24)), v, radius * Math.sin(k * Math.PI / 24)));

class Rig {
  constructor(svg) {
    this.svg = svg;
    this.oblique();
  }

  oblique() { [this.azimuth, this.tilt, this.zoom] = [0.5, 1.05, 1]; }

  /* x right, y down; the last is the nearness. */
  project(p) {
    const [ca, sa, ct, st] = [Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.tilt), Math.sin(this.tilt)];
    const [x, y, z] = plus(p, rigData.middle, -1);
    const across = x * ca + y * sa, deep = -x * sa + y * ca;
    const scale = this.zoom * 205 / rigData.reach;
    return [scale * across, -scale * (deep * ct + z * st), z * ct - deep * st];
  }

  line(points, name, title, closed) {
    const flat = points.map((p) => this.project(p));
    const d = flat.map((p, i) => `${i ? 'L' : 'M'}${p[0].toFixed(1)} ${p[1].toFixed(1)}`).join('') + (closed ? 'Z' : '');
    const depth = flat.reduce((sum, p) => sum + p[2], 0) / flat.length;
    this.parts.push({ depth, element: svgElement('path', { d, class: name }, title) });
  }

  label(p, text) {
    const [x, y, depth] = this.project(p);
    this.parts.push({ depth: depth + 1e6, element: Object.assign(svgElement('text', { x: x + 7, y: y + 3 }), { textContent: text }) });
  }

  sample(s) {
    const c = s.center;
    if (s.shape === 'cylinder') {
      const up = s.axis, side = Math.abs(up[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0];
      const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
      const unit = (a) => a.map((x) => x / Math.hypot(...a));
      const u = unit(cross(up, side)), v = cross(up, u);
      for (const end of [-0.5, 0, 0.5]) this.line(ringOf(plus(c, up, end * s.height), u, v, s.radius), 'sample', 'sample: a cylinder');
      for (const w of [u, u.map((x) => -x), v, v.map((x) => -x)])
        this.line([-0.5, 0.5].map((end) => plus(plus(c, up, end * s.height), w, s.radius)), 'sample');
      return;
    }
    const e = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    for (const [i, j] of [[0, 1], [1, 2], [0, 2]]) this.line(ringOf(c, e[i], e[j], s.radius), 'sample', `sample: a ${s.shape}`);
  }

  camera(shot, k) {
    const size = 0.1 * rigData.reach, [right, down, forward] = shot.axes, tip = shot.eye;
    const corner = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) =>
      plus(plus(plus(tip, forward, size), right, a * shot.half[0] * size), down, b * shot.half[1] * size));
    this.line(corner, 'camera', shot.name, true);
    for (const p of corner) this.line([tip, p], 'camera', shot.name);
    const first = rigData.shots.findIndex((other) => Math.hypot(...plus(other.eye, tip, -1)) < 0.02 * rigData.reach);
    if (rigData.shots.length <= 40 && first === k) this.label(tip, String(k + 1));
  }

  lamp(lamp) {
    const [x, y, depth] = this.project(lamp.position);
    this.line([lamp.position, rigData.sample.center], 'lampray');
    this.parts.push({ depth: depth + 1, element: svgElement('circle', { cx: x.toFixed(1), cy: y.toFixed(1), r: 6, class: 'lamp' }, lamp.title) });
    this.label(lamp.position, lamp.name);
  }

  draw() {
    this.parts = [];
    const [x0, y0, x1, y1] = rigData.board;
    if (x1 > x0) this.line([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], 'board', 'board', true);
    this.parts.forEach((part) => { part.depth -= 1e6; });
    for (const tag of rigData.tags) this.line(tag.corners, 'tag', `tag ${tag.id}`, true);
    for (const patch of rigData.patches) this.line(patch, 'patch', 'white patch', true);
    for (const [axis, name] of [[[1, 0, 0], 'x'], [[0, 1, 0], 'y'], [[0, 0, 1], 'z']]) {
      const end = axis.map((v) => v * 0.12 * rigData.reach);
      this.line([[0, 0, 0], end], 'axis');
      this.label(end, name);
    }
    this.sample(rigData.sample);
    rigData.shots.forEach((shot, k) => this.camera(shot, k));
    rigData.lamps.forEach((lamp) => this.lamp(lamp));
    this.parts.sort((a, b) => a.depth - b.depth);
    this.svg.replaceChildren(...this.parts.map((part) => part.element));
  }

  move(x, y) {
    this.azimuth -= x;
    this.tilt = Math.max(0, Math.min(Math.PI / 2, this.tilt - y));
    this.draw();
  }

  scale(by) {
    this.zoom = Math.max(0.4, Math.min(8, this.zoom * by));
    this.draw();
  }
}

function startRig() {
  if (!rigData) return;
  const svg = byId('rig'), rig = new Rig(svg);
  followPointer(svg, (x, y) => rig.move(x, y));
  svg.addEventListener('keydown', (e) => {
    if (e.key === '+' || e.key === '=') rig.scale(1.15);
    if (e.key === '-') rig.scale(1 / 1.15);
  });
  svg.addEventListener('wheel', (e) => {
    if (!e.ctrlKey) return;
    e.preventDefault();
    rig.scale(Math.exp(-e.deltaY / 300));
  }, { passive: false });
  svg.addEventListener('pointerover', (e) => {
    const title = e.target.querySelector ? e.target.querySelector('title') : null;
    byId('rig-hover').textContent = title && e.target !== svg ? title.textContent : '';
  });
  const views = { top: [0, Math.PI / 2 - 1e-6], side: [0, 0], reset: [0.5, 1.05] };
  for (const button of document.querySelectorAll('[data-rig]'))
    button.addEventListener('click', () => {
      rig.oblique();
      // A view from above looks along -z: the board's y is up. tilt is the height of the horizon.
      [rig.azimuth, rig.tilt] = views[button.dataset.rig];
      rig.draw();
    });
  rig.draw();
}
startRig();
