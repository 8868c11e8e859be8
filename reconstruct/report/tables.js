/* tables.js -- the reflectance tables in the page, as report_tables.c packed them. */
'use strict';

/* Base 64, deflate, then planes of low and high bytes of zigzag differences between neighbours along phi_d, become
 * codes: 0 is no value, 1 is zero, a larger c is low exp((c - 2) step) in 1/sr. */
async function codesOf(element) {
  const text = atob(element.textContent.trim());
  const packed = Uint8Array.from(text, (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = bytes.length / 2, codes = new Uint16Array(count);
  for (let i = 0, code = 0; i < count; i++) {
    const zigzag = bytes[i] | bytes[count + i] << 8;
    code = code + (zigzag >> 1 ^ -(zigzag & 1)) & 65535;
    codes[i] = code;
  }
  return codes;
}

/* What is missing along theta_d goes on from what is there, as in lookup.c: by the last two's ratio, to twice or half. */
function complete(value, first, stride, count) {
  const end = first + stride * count;
  let last = -1, ratio = 1, from = first;
  while (from < end && value[from] < 0) from += stride;
  for (let i = first; i < from; i += stride) value[i] = from < end ? value[from] : 0;
  for (let i = from, total = 1; i < end; i += stride) {
    if (value[i] >= 0) {
      ratio = last > 0 && value[i] > 0 ? value[i] / last : 1;
      last = value[i];
      total = 1;
    } else {
      total = Math.min(2, Math.max(0.5, total * ratio));
      value[i] = last * total;
    }
  }
}

/* A row where phi_d has no meaning holds the mean of its neighbour's. */
function level(value, to, from, phis) {
  for (let c = 0; c < 3; c++) {
    let sum = 0;
    for (let k = 0; k < phis; k++) sum += value[4 * (from + k) + c];
    for (let k = 0; k < phis; k++) value[4 * (to + k) + c] = sum / phis;
  }
}

/* {name, size: [rows of theta_h, of theta_d, phi_d], value: RGBA, phi_d the fastest}. Rows stand at 0 and at the
 * middles of bins. Fits hold phi_d up to pi/2 only: the other half mirrors it. */
async function unpackTable(element) {
  const codes = await codesOf(element), [heights, differences, stored] = element.dataset.size.split(',').map(Number);
  const mirrored = element.dataset.mirrored === 'true', phis = mirrored ? 2 * stored : stored;
  const low = Number(element.dataset.low), step = Number(element.dataset.step), decoded = new Float32Array(65536);
  for (let c = 2; c < 65536; c++) decoded[c] = low * Math.exp((c - 2) * step);
  decoded[0] = -1;
  const size = [heights + 1, differences + 1, phis], value = new Float32Array(4 * size[0] * size[1] * phis);
  const at = (h, d) => (h * size[1] + d) * phis;
  for (let c = 0, i = 0; c < 3; c++)
    for (let h = 1; h <= heights; h++) {
      for (let d = 1; d <= differences; d++)
        for (let k = 0; k < stored; k++, i++) {
          value[4 * (at(h, d) + k) + c] = decoded[codes[i]];
          if (mirrored) value[4 * (at(h, d) + phis - 1 - k) + c] = decoded[codes[i]];
        }
      for (let k = 0; k < phis; k++) complete(value, 4 * (at(h, 1) + k) + c, 4 * phis, differences);
    }
  for (let h = 1; h <= heights; h++) level(value, at(h, 0), at(h, 1), phis);
  for (let d = 0; d <= differences; d++) level(value, at(0, d), at(1, d), phis);
  return { name: element.dataset.name, size, value };
}

const tableElements = [...document.querySelectorAll('script[data-name]')];
const unpacked = new Map();
/* The k-th table of the page, unpacked once. */
function tableNumber(k) {
  if (!unpacked.has(k)) unpacked.set(k, unpackTable(tableElements[k]));
  return unpacked.get(k);
}
