// The table of a library. Only rows that are seen are in the document, so ten thousand are as quick as ten.
'use strict';
const rows = JSON.parse(document.getElementById('data').textContent);
const rowHeight = 41;
const byId = id => document.getElementById(id);
const number = v => v === undefined || v === null ? '' : Math.round(v).toLocaleString('en');
const faults = row => {
  const repaired = Object.entries(row.repaired || {}).map(([what, count]) => what.replaceAll('_', ' ') + ' ' + count);
  return [row.message || '', ...(row.warnings || []), ...(repaired.length ? ['repaired: ' + repaired.join(', ')] : [])]
    .filter(Boolean).join('; ');
};
const columns = [
  {name: '', width: 64},
  {name: 'name', width: 280, word: true, value: row => row.name},
  {name: 'outcome', width: 80, word: true, value: row => row.outcome},
  {name: 'triangles', width: 90, value: row => row.triangles, text: number},
  {name: 'components', width: 90, value: row => row.components, text: number},
  {name: 'levels', width: 80, value: row => row.levels, text: number},
  {name: 'KiB', width: 80, value: row => row.bytes / 1024, text: number},
  {name: 'seconds', width: 75, value: row => row.seconds, text: v => v.toFixed(2)},
  {name: 'peak MiB', width: 80, value: row => row.peak_rss_bytes / 1048576, text: number},
  {name: 'faults', width: 520, word: true, value: row => row.faults},
];
for (const row of rows) {
  row.faults = faults(row);
  row.sought = (row.name + ' ' + row.outcome + ' ' + row.faults).toLowerCase();
}
let shown = rows, sortedBy = null, rising = true;

function link(folder, name, ending) {
  return folder + '/' + (name + ending).split('/').map(encodeURIComponent).join('/');
}

function cell(column, row) {
  const td = document.createElement('td');
  if (!column.value) {
    if (row.outcome === 'baked') {
      const img = document.createElement('img');
      img.loading = 'lazy';
      img.src = link('thumbnails', row.name, '.png');
      td.append(img);
    }
    return td;
  }
  const value = column.value(row);
  const text = column.text ? (value === undefined ? '' : column.text(value)) : value;
  if (column.word) td.className = 'word';
  if (column.name === 'outcome') td.className = 'word ' + value;
  td.title = text;
  if (column.name === 'name' && row.outcome === 'baked') {
    const a = document.createElement('a');
    a.href = link('assets', row.name, '.lode');
    a.textContent = text;
    td.append(a);
  } else {
    td.textContent = text;
  }
  return td;
}

function gap(count) {
  const tr = document.createElement('tr'), td = document.createElement('td');
  tr.className = 'gap';
  td.colSpan = columns.length;
  td.style.height = count * rowHeight + 'px';
  tr.append(td);
  return tr;
}

function draw() {
  const list = byId('list');
  const first = Math.max(0, Math.floor(list.scrollTop / rowHeight) - 10);
  const end = Math.min(shown.length, first + Math.ceil(list.clientHeight / rowHeight) + 20);
  const body = byId('rows');
  body.replaceChildren(gap(first));
  for (const row of shown.slice(first, end)) {
    const tr = document.createElement('tr');
    for (const column of columns) tr.append(cell(column, row));
    body.append(tr);
  }
  body.append(gap(shown.length - end));
  byId('shown').textContent = shown.length === rows.length ? '' : shown.length + ' of ' + rows.length;
}

function arrange() {
  const words = byId('search').value.toLowerCase().split(/\s+/).filter(Boolean);
  shown = rows.filter(row => words.every(word => row.sought.includes(word)));
  if (sortedBy) {
    const keyed = shown.map(row => [sortedBy.value(row), row]);
    const none = v => v === undefined || Number.isNaN(v);
    keyed.sort(([a], [b]) => none(a) ? (none(b) ? 0 : 1) : none(b) ? -1 : (a < b ? -1 : a > b ? 1 : 0) * (rising ? 1 : -1));
    shown = keyed.map(([, row]) => row);
  }
  byId('list').scrollTop = 0;
  draw();
}

for (const column of columns) {
  const th = document.createElement('th');
  th.textContent = column.name;
  th.style.width = column.width + 'px';
  if (column.word) th.className = 'word';
  if (column.value) th.onclick = () => {
    rising = sortedBy === column ? !rising : column.word === true;
    sortedBy = column;
    arrange();
  };
  byId('heads').append(th);
}
const counts = {};
for (const row of rows) counts[row.outcome] = (counts[row.outcome] || 0) + 1;
byId('counts').textContent = rows.length + ' meshes: ' +
  Object.entries(counts).map(([outcome, count]) => count + ' ' + (outcome === 'again' ? 'left' : outcome)).join(', ');
byId('search').oninput = arrange;
byId('list').onscroll = draw;
window.onresize = draw;
arrange();
