/* tables.js -- the reflectance tables in the page, as report_tables.c packed them. */
'use strict';

/* Base 64, deflate, then planes of low and high bytes of zigzag differences between neighbours along phi_d.
 * A code c > 0 is low * exp((c - 1) step) in 1/sr; 0 is no value. Fits hold phi_d up to pi/2 only: the other half
 * mirrors it. Returns {size: [theta_h, theta_d, phi_d], value: Float32Array of RGBA, phi_d the fastest}. */
async function unpackTable(element) {
  const text = atob(element.textContent.trim());
  const packed = Uint8Array.from(text, (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const [heights, differences, stored] = element.dataset.size.split(',').map(Number);
  const mirrored = element.dataset.mirrored === 'true';
  const low = Number(element.dataset.low), step = Number(element.dataset.step);
  const phis = mirrored ? 2 * stored : stored, cells = heights * differences, count = bytes.length / 2;
  const value = new Float32Array(4 * cells * phis), decoded = new Float32Array(65536);
  for (let c = 1; c < 65536; c++) decoded[c] = low * Math.exp((c - 1) * step);
  let code = 0, i = 0;
  for (let channel = 0; channel < 3; channel++)
    for (let cell = 0; cell < cells; cell++)
      for (let k = 0; k < stored; k++, i++) {
        const zigzag = bytes[i] | bytes[count + i] << 8;
        code = code + (zigzag >> 1 ^ -(zigzag & 1)) & 65535;
        value[4 * (cell * phis + k) + channel] = decoded[code];
        if (mirrored) value[4 * (cell * phis + phis - 1 - k) + channel] = decoded[code];
      }
  return { name: element.dataset.name, size: [heights, differences, phis], value };
}

const tableElements = [...document.querySelectorAll('script[data-name]')];
const unpacked = new Map();
/* The k-th table of the page, unpacked once. */
function tableNumber(k) {
  if (!unpacked.has(k)) unpacked.set(k, unpackTable(tableElements[k]));
  return unpacked.get(k);
}
