'use strict';
const { report, images } = JSON.parse(document.getElementById('data').textContent);
const { rows, machine } = report;
const at = id => document.getElementById(id);
const px = error => `${+error.toPrecision(3)} px`;
const curveName = r => r.backend + (r.order ? ` ${r.order}` : '') + (r.raster ? ` ${r.raster}` : '') +
    (r.volumes ? ` volumes ${r.volumes}` : '');
const rowName = r => curveName(r) + (r.backend === 'full' ? '' : `, ${px(r.pixel_error)}`);
const curves = [...new Set(rows.map(curveName))];
const palette = { full: '#6b7280', discrete: '#c2410c', lod: '#1d4ed8', vgi: '#15803d' };
const more = ['#7c3aed', '#0e7490', '#be185d', '#a16207', '#334155'];
const colourOf = name => palette[name.split(' ')[0]] && curves.filter(c => c.split(' ')[0] === name.split(' ')[0])[0] === name
  ? palette[name.split(' ')[0]] : more[curves.indexOf(name) % more.length];

at('scene').textContent = `${report.scene}, ${report.size}`;
at('machine').textContent = `${machine.device}${machine.software ? ' (software rasteriser)' : ''}, driver ${machine.driver}; ${machine.cpu}; Lodestone ${machine.commit}`;
document.title = `Lodestone: ${report.scene}`;

function fill(table, heads, lines) {
  const line = (cells, tag) => {
    const tr = document.createElement('tr');
    for (const { text, kind } of cells) {
      const cell = document.createElement(tag);
      cell.textContent = text;
      if (kind) cell.className = kind;
      tr.append(cell);
    }
    table.append(tr);
  };
  line(heads, 'th');
  for (const cells of lines) line(cells, 'td');
}

// Columns of the table: heading, value, digits, and which way is better.
const columns = [
  ['ms', r => r.ms_median, 2, -1], ['p95', r => r.ms_p95, 2, -1], ['p99', r => r.ms_p99, 2, -1], ['max', r => r.ms_max, 2, -1], ['device ms', r => r.gpu_ms, 2, -1],
  ['floor', r => r.ms_floor, 2, 0], ['jolt', r => r.ms_jolt, 2, -1], ['FPS', r => r.fps_mean, 1, 1], ['plan ms', r => r.cpu_plan_ms, 2, -1], ['other threads ms', r => r.cpu_ms, 2, -1],
  ['triangles', r => r.triangles, 0, 0], ['vertex runs', r => r.vertex_invocations, 0, -1], ['ACMR', r => r.acmr, 3, -1],
  ['FIFO-16', r => r.acmr_fifo16, 3, -1], ['SSIM', r => r.ssim, 4, 1], ['PSNR dB', r => r.psnr_db, 2, 1],
  ['deviation px', r => r.max_pixel_deviation, 2, -1], ['leaks', r => r.background_leaks, 0, -1],
  ['resident MiB', r => r.resident_bytes / 2 ** 20, 1, 0], ['upload KiB/frame', r => r.uploaded_bytes / 1024, 1, 0]];
const bests = columns.map(([, of, , way]) => {
  const values = rows.filter(r => r.backend !== 'full').map(of);
  return way === 0 || values.length < 2 ? NaN : way > 0 ? Math.max(...values) : Math.min(...values);
});
const number = (value, digits) => value === null ? '-' : value.toLocaleString('en', { minimumFractionDigits: digits, maximumFractionDigits: digits });
fill(at('rows'), [{ text: 'row' }, ...columns.map(([text]) => ({ text }))], rows.map(r => [{ text: rowName(r) },
  ...columns.map(([, of, digits], i) => ({ text: number(of(r), digits), kind: r.backend !== 'full' && of(r) === bests[i] ? 'best' : '' }))]));

const metricNames = { ssim: 'SSIM', max_pixel_deviation: 'deviation' };
fill(at('equal'), [{ text: 'row' }, ...curves.flatMap(c => Object.values(metricNames).map(m => ({ text: `${c}, same ${m}` })))],
  rows.map((r, i) => [{ text: rowName(r) }, ...curves.flatMap(c => Object.keys(metricNames).map(metric => {
    const e = report.equal_error.find(x => x.row === i && x.metric === metric && curveName(x) === c);
    if (!e) return { text: '-', kind: 'faint' };
    if (e.where === 'never') return { text: `never as good (best ${number(e.ratio, 2)}x)`, kind: 'faint' };
    const where = e.backend === 'full' ? '' : ` at ${px(e.pixel_error)}`;
    return { text: `${e.where === 'at least' ? '\u2264 ' : ''}${number(e.ratio, 2)}x${where}` };
  }))]));

Chart.defaults.animation = false;
Chart.defaults.maintainAspectRatio = false;
Chart.defaults.font.family = 'system-ui, sans-serif';
// The pixel error beside each point.
const labels = {
  id: 'labels',
  afterDatasetsDraw(chart) {
    const { ctx } = chart;
    ctx.save();
    ctx.font = '11px system-ui, sans-serif';
    chart.data.datasets.forEach((set, s) => {
      ctx.fillStyle = set.borderColor;
      chart.getDatasetMeta(s).data.forEach((point, i) => set.data[i].label && ctx.fillText(set.data[i].label, point.x + 5, point.y - 5));
    });
    ctx.restore();
  },
};
const axis = (text, type = 'linear') => ({ type, title: { display: true, text } });
const title = text => ({ title: { display: true, text } });
function lines(id, heading, x, y, datasets, plugins = []) {
  new Chart(at(id), { type: 'line', data: { datasets }, plugins,
    options: { parsing: false, interaction: { mode: 'nearest', intersect: false }, plugins: title(heading), scales: { x, y } } });
}
const curveSets = (xOf, yOf, withFull = true) => curves.filter(c => withFull || c !== 'full').map(c => ({
  label: c, borderColor: colourOf(c), backgroundColor: colourOf(c), borderWidth: 2, pointRadius: 3,
  data: rows.filter(r => curveName(r) === c).sort((a, b) => a.pixel_error - b.pixel_error)
    .map(r => ({ x: xOf(r), y: yOf(r), label: c === 'full' ? '' : `${+r.pixel_error.toPrecision(3)}` })).filter(point => point.y !== null),
}));
const meanMs = r => 1000 / r.fps_mean;
lines('ssim', 'SSIM to supersampled full', axis('mean ms per frame', 'logarithmic'), axis('SSIM'), curveSets(meanMs, r => r.ssim), [labels]);
lines('deviation', 'Largest deviation from full', axis('mean ms per frame', 'logarithmic'), { ...axis('pixels'), reverse: true },
  curveSets(meanMs, r => r.max_pixel_deviation), [labels]);
lines('triangles', 'Triangles drawn', axis('pixel error', 'logarithmic'), axis('triangles per frame', 'logarithmic'),
  curveSets(r => r.pixel_error, r => r.triangles, false));

// The flight of each curve at the pixel error nearest to 1.
const nearestToOne = c => rows.filter(r => curveName(r) === c)
  .reduce((best, r) => !best || Math.abs(Math.log(r.pixel_error)) < Math.abs(Math.log(best.pixel_error)) ? r : best, null);
const chosen = curves.map(nearestToOne);
const series = (name, values, colour) => ({ label: name, borderColor: colour, backgroundColor: colour, borderWidth: 1.5, pointRadius: 0,
  data: values.map((y, x) => ({ x, y })) });
lines('flight', 'Frame time along the flight', axis('frame'), axis('ms', 'logarithmic'),
  chosen.map(r => series(rowName(r), r.flight.ms.slice(0, r.frames), colourOf(curveName(r)))));
function bars(id, heading, unit, sets) {
  new Chart(at(id), { type: 'bar', data: { labels: chosen.map(rowName), datasets: sets.map(([label, of, colour]) => ({ label, backgroundColor: colour, data: chosen.map(of) })) },
    options: { plugins: title(heading), scales: { y: { ...axis(unit), beginAtZero: true } } } });
}
bars('acmr', 'Vertex invocations per triangle', 'ACMR', [['counted by the device', r => r.acmr, '#1d4ed8'], ['FIFO-16, simulated', r => r.acmr_fifo16, '#93b4f5']]);
bars('memory', 'Memory', 'MiB', [['buffers', r => r.resident_bytes / 2 ** 20, '#15803d'], ['asset files', r => r.asset_bytes / 2 ** 20, '#9fd3b2']]);

if (report.steered.length === 0) {
  at('steered-section').remove();
} else {
  const targets = [...new Set(report.steered.map(s => s.target_ms))].map(ms => ({
    ...series(`target ${number(ms, 1)} ms`, report.steered[0].ms.map(() => ms), '#111827'), borderDash: [6, 4] }));
  lines('steered-ms', 'Frame time', axis('frame'), axis('ms'),
    [...report.steered.map(s => series(curveName(s), s.ms, colourOf(curveName(s)))), ...targets]);
  lines('steered-error', 'Pixel error', axis('frame'), axis('pixels', 'logarithmic'),
    report.steered.map(s => series(curveName(s), s.pixel_error, colourOf(curveName(s)))));
}

const shown = report.pictures.filter(p => images[p.picture]);
if (shown.length === 0) {
  at('pictures-section').remove();
} else {
  const option = (select, value, text) => select.append(new Option(text, value));
  for (const i of [...new Set(shown.map(p => p.row))]) option(at('picture-row'), i, rowName(rows[i]));
  for (const f of [...new Set(shown.map(p => p.frame))]) option(at('picture-frame'), f, f + 1);
  // To begin with: the last backend's row nearest to one pixel, the picture in the middle.
  at('picture-row').value = rows.indexOf(chosen[chosen.length - 1]);
  at('picture-frame').value = Math.floor(report.references.length / 2);
  const show = () => {
    const p = shown.find(q => q.row === +at('picture-row').value && q.frame === +at('picture-frame').value);
    if (!p) return;
    at('picture').src = images[p.picture];
    at('reference').src = images[report.references[p.frame]];
    at('difference').src = images[p.difference];
  };
  const slide = share => {
    at('line').style.left = `${share * 100}%`;
    at('reference').style.clipPath = `inset(0 0 0 ${share * 100}%)`;
  };
  at('picture-row').onchange = at('picture-frame').onchange = show;
  at('compare').onpointermove = at('compare').onpointerdown = e => {
    if (e.type === 'pointermove' && e.buttons === 0) return;
    const box = at('compare').getBoundingClientRect();
    slide(Math.min(1, Math.max(0, (e.clientX - box.left) / box.width)));
  };
  show();
  slide(0.5);
}
