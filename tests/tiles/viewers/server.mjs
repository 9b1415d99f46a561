// Serves the pages of a folder, node_modules of another, and tilesets of a third, to this machine alone.
import fs from 'node:fs';
import http from 'node:http';
import path from 'node:path';

const types = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.json': 'application/json',
  '.glb': 'model/gltf-binary', '.wasm': 'application/wasm', '.css': 'text/css', '.png': 'image/png' };

// roots: folders by the first part of an address; '' for the rest. delay: of tiles, milliseconds.
export function serve(roots, delay = 0) {
  const server = http.createServer((request, response) => {
    const name = decodeURIComponent(new URL(request.url, 'http://localhost').pathname);
    if (name === '/favicon.ico') return response.writeHead(204).end();
    const first = name.split('/')[1];
    const root = path.resolve(roots[first] ?? roots['']);
    const file = path.join(root, first in roots ? name.slice(first.length + 1) : name);
    if (file !== root && !file.startsWith(root + path.sep)) return response.writeHead(403).end();
    setTimeout(() => fs.readFile(file, (error, bytes) => {
      if (error) return response.writeHead(404).end();
      response.writeHead(200, { 'content-type': types[path.extname(file)] ?? 'application/octet-stream' });
      response.end(bytes);
    }), file.endsWith('.glb') ? delay : 0);
  });
  return new Promise((done) => server.listen(0, '127.0.0.1', () => done(server)));
}
