// node leaks.mjs VIEWER SET [--views N] [--loading N] [--orientation] [--pictures FOLDER] [--radius R]
//   VIEWER  three (3DTilesRendererJS) or cesium (CesiumJS)
//   SET     folder of a tileset of about R metres around its origin (1)
// Draws random views of a tileset in Chromium and counts pixels that backs of tiles cover and no front does. Prints one
// line of JSON; ends with 1 where there is one 16 pixels and more from the picture's border, or a tile that failed.
// Works in the folder where node_modules lie.
import { createRequire } from 'node:module';
import fs from 'node:fs';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { serve } from './server.mjs';

const here = path.dirname(fileURLToPath(import.meta.url));
const { values: o, positionals: [viewer, set] } = parseArgs({ allowPositionals: true, options: {
  views: { type: 'string', default: '0' }, loading: { type: 'string', default: '0' }, orientation: { type: 'boolean' },
  pictures: { type: 'string' }, radius: { type: 'string', default: '1' }, name: { type: 'string' } } });
const puppeteer = (await import(createRequire(path.join(process.cwd(), 'x')).resolve('puppeteer-core'))).default;

// SplitMix32.
function random(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x9e3779b9) >>> 0;
    let t = Math.imul(state ^ state >>> 16, 0x21f0aaad);
    t = Math.imul(t ^ t >>> 15, 0x735a2d97);
    return ((t ^ t >>> 15) >>> 0) / 4294967296;
  };
}
const next = random(5), radius = Number(o.radius);
function random_view() {
  const distance = radius * (1.35 + 2.5 * next() ** 2), around = 2 * Math.PI * next(), z = 1.6 * next() - 0.8, h = Math.sqrt(1 - z * z);
  return { eye: [distance * h * Math.cos(around), distance * h * Math.sin(around), distance * z],
    target: [0, 0, 0].map(() => radius * (next() - 0.5)), up: [0, 0, 1], error: 1 + 11 * next() };
}

const server = await serve({ '': here, node_modules: path.join(process.cwd(), 'node_modules'), set }, Number(o.loading) > 0 ? 20 : 0);
const browser = await puppeteer.launch({ executablePath: process.env.CHROMIUM || '/usr/bin/chromium', headless: true,
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-background-networking',
    '--force-device-scale-factor=1', '--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1'] });
let bad = false;
try {
  const page = await browser.newPage();
  page.setDefaultTimeout(0);
  await page.setViewport({ width: 640, height: 480 });
  page.on('pageerror', (e) => { bad = true; console.error('page: ' + String(e).slice(0, 400)); });
  page.on('console', (m) => { if (m.type() === 'error' || /failed/.test(m.text())) console.error('page: ' + m.text().slice(0, 400)); });
  await page.goto(`http://127.0.0.1:${server.address().port}/${viewer}.html?set=/set/tileset.json`);
  await page.waitForFunction('window.ready', { timeout: 60000 });
  const sum = { viewer, views: 0, leaks: 0, at_edge: 0, covered: 0, frames: 0, loading_leaks: 0, tiles: 0, failed: 0 };
  const begun = Date.now();
  for (let i = 0; i < Number(o.views) + Number(o.loading); ++i) {
    const loading = i >= Number(o.views);
    const r = await page.evaluate((view, frames) => api.count(view, frames), random_view(), loading);
    ++sum.views;
    sum.leaks += r.settled.inside;
    sum.at_edge += r.settled.at_edge;
    sum.covered += r.settled.covered;
    sum.tiles += r.tiles;
    sum.failed = r.failed;
    for (const frame of r.frames) {
      ++sum.frames;
      sum.loading_leaks += frame.inside;
      sum.at_edge += frame.at_edge;
    }
  }
  if (sum.views > 0) {
    sum.tiles = Number((sum.tiles / sum.views).toFixed(1));
    sum.seconds = (Date.now() - begun) / 1000;
    console.log(JSON.stringify(sum));
    bad ||= sum.leaks + sum.loading_leaks + sum.failed > 0 || sum.covered === 0;
  }
  if (o.orientation) bad = !await right_way_up(page) || bad;
  if (o.pictures) {
    fs.mkdirSync(o.pictures, { recursive: true });
    const looks = { far: [[2.4, -2.2, 1.6], [0, 0, 0], 1], near: [[1.0, -0.9, 0.7], [0.25, -0.2, 0.25], 1],
      closest: [[0.75, -0.7, 0.5], [0.45, -0.45, 0.3], 1], coarse: [[1.6, -1.5, 1.1], [0, 0, 0], 16] };
    for (const [name, [eye, target, error]] of Object.entries(looks)) {
      const scaled = (p) => p.map((x) => x * radius);
      const tiles = await page.evaluate((view) => api.look(view), { eye: scaled(eye), target: scaled(target), up: [0, 0, 1], error });
      await page.screenshot({ path: path.join(o.pictures, `${o.name ?? viewer}-${name}.png`) });
      console.log(`${viewer} ${name}: ${tiles} tiles`);
    }
  }
} finally {
  await browser.close();
  server.close();
}
process.exit(bad ? 1 : 0);

// The set is a pyramid whose edges lead 3 to the east, 2 to the north and 1 up of its origin: seen from above, and from
// the south, it must be where a map has it.
async function right_way_up(page) {
  const seen = async (view) => {
    const { settled: { box: [left, right, bottom, top] } } = await page.evaluate((v) => api.count(v, false), { ...view, error: 1 });
    return { left: left - 320, right: right - 320, below: bottom - 240, above: top - 240 };
  };
  const about = (is, wanted) => Math.abs(is - wanted) <= 4;
  const per_metre = 240 / Math.tan(25 * Math.PI / 180) / 20;
  const above = await seen({ eye: [0, 0, 20], target: [0, 0, 0], up: [0, 1, 0] });
  const south = await seen({ eye: [0, -20, 0], target: [0, 0, 0], up: [0, 0, 1] });
  const good = about(above.left, 0) && about(above.right, 3 * per_metre) && about(above.below, 0) && about(above.above, 2 * per_metre) &&
    about(south.left, 0) && about(south.right, 3 * per_metre) && about(south.below, 0) && about(south.above, per_metre);
  console.log(JSON.stringify({ viewer, orientation: good, above, south }));
  return good;
}
