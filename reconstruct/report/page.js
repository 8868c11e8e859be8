/* page.js -- what else the report lets one choose: angles, channels, fits; numbers under the pointer; pictures large. */
'use strict';

function startTheme() {
  const button = byId('theme'), root = document.documentElement;
  const dark = () => root.dataset.theme ? root.dataset.theme === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches;
  const show = () => button.setAttribute('aria-pressed', String(dark()));
  button.addEventListener('click', () => { root.dataset.theme = dark() ? 'light' : 'dark'; show(); });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', show);
  show();
}

/* Plots for all angles are in the page; one is shown. Channels and fits are classes that hide. */
function startLobes() {
  const lobes = byId('lobes');
  if (!lobes) return;
  const show = () => {
    const theta = byId('theta').value;
    for (const plot of lobes.querySelectorAll('[data-theta]')) plot.hidden = plot.dataset.theta !== theta;
    for (const box of lobes.querySelectorAll('input[data-hides]')) lobes.classList.toggle(box.dataset.hides, !box.checked);
  };
  lobes.addEventListener('input', show);
  show();
}

const digits = (x) => Number(x).toPrecision(4);

/* f under the pointer: the table's and the fits', from the data that the curves were drawn of. */
function startReadouts() {
  const data = JSON.parse(byId('data').textContent).cuts;
  if (!data) return;
  const channels = ['red', 'green', 'blue'];
  for (const plot of document.querySelectorAll('#lobes svg[data-cut]')) {
    const cut = data[plot.dataset.cut], out = byId('lobe-readout');
    plot.addEventListener('pointermove', (e) => {
      const box = plot.getBoundingClientRect(), [w, h] = plot.getAttribute('viewBox').split(' ').slice(2).map(Number);
      const x = (e.clientX - box.left) * w / box.width, y = (e.clientY - box.top) * h / box.height;
      const [cx, cy] = plot.dataset.center.split(',').map(Number);
      const theta = plot.dataset.kind === 'polar' ? Math.atan2(x - cx, cy - y) * 180 / Math.PI
        : -90 + 180 * (x - plot.dataset.left) / plot.dataset.width;
      const k = Math.round(theta) + 89;
      if (k < 0 || k >= cut.f[1].length) return;
      const parts = channels.map((name, c) => `${name} ${digits(cut.f[c][k])}${cut.s[c][k] ? ` \u00b1 ${(100 * cut.s[c][k]).toFixed(1)} %` : ''}`);
      const fits = data[0].fits.map((name, n) => `${name} ${digits(cut.fit[n][k])}`);
      out.textContent = `\u03b8o ${k - 89}\u00b0: ${parts.join(', ')} 1/sr, ${cut.m[k] ? 'measured' : 'filled'}${fits.length ? `; green of ${fits.join(', ')}` : ''}`;
    });
  }
}

/* theta and f under the pointer, on pictures of the table. */
function startSlices() {
  for (const plot of document.querySelectorAll('svg[data-slices]')) {
    const places = JSON.parse(plot.dataset.slices), out = plot.closest('figure').querySelector('.readout');
    plot.addEventListener('pointermove', async (e) => {
      const box = plot.getBoundingClientRect(), [w, h] = plot.getAttribute('viewBox').split(' ').slice(2).map(Number);
      const x = (e.clientX - box.left) * w / box.width, y = (e.clientY - box.top) * h / box.height;
      const place = places.find((p) => x >= p.x && x < p.x + p.side && y >= p.y && y < p.y + p.side);
      if (!place || !tableElements.length) return;
      const u = (x - place.x) / place.side, v = 1 - (y - place.y) / place.side;
      const table = await tableNumber(0), [, ds, phis] = table.size;
      const row = Math.min(90, 1 + Math.floor(u * 90)), column = Math.min(90, 1 + Math.floor(v * 90));
      const at = 4 * ((row * ds + column) * phis + phis / 2), theta = [90 * u * u, 90 * v];
      const f = [0, 1, 2].map((c) => digits(table.value[at + c]));
      out.textContent = `\u03b8h ${theta[0].toFixed(1)}\u00b0, \u03b8d ${theta[1].toFixed(0)}\u00b0: ${`red ${f[0]}, green ${f[1]}, blue ${f[2]} 1/sr`}`;
    });
  }
}

function startPictures() {
  const dialog = byId('large'), large = byId('large-picture');
  for (const button of document.querySelectorAll('.zoom'))
    button.addEventListener('click', () => {
      const picture = button.querySelector('img');
      large.src = picture.src;
      large.alt = picture.alt;
      dialog.showModal();
    });
  byId('large-close').addEventListener('click', () => dialog.close());
  dialog.addEventListener('click', (e) => { if (e.target === dialog) dialog.close(); });
}

startTheme();
startLobes();
startReadouts();
startSlices();
startPictures();
