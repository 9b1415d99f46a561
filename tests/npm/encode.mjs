// node encode.mjs PLAIN.glb WAY...: writes WAY.glb beside it for each way named, as encoders of others compress it.
import fs from 'node:fs';
import path from 'node:path';
import { load } from './packages.mjs';

// Bits that a number is kept in. tests/mesh/io/encoders_test.cpp expects no more loss than these make.
const draco_bits = { POSITION: 14, NORMAL: 10, COLOR: 8, TEX_COORD: 12, GENERIC: 12 };
const pack_bits = ['-vp', '14', '-vt', '12', '-vn', '8', '-vc', '8'];

// By glTF-Transform, with the extension of that name.
async function transform(from, to, extension, method, options = {}) {
  const { NodeIO } = await load('@gltf-transform/core');
  const extensions = await load('@gltf-transform/extensions');
  const { MeshoptEncoder } = await load('meshoptimizer');
  const draco = await load('draco3dgltf');
  const io = new NodeIO().registerExtensions(extensions.ALL_EXTENSIONS).registerDependencies({
    'draco3d.encoder': await draco.createEncoderModule(), 'meshopt.encoder': MeshoptEncoder });
  await MeshoptEncoder.ready;
  const document = await io.read(from);
  const kind = extensions[extension];
  document.createExtension(kind).setRequired(true).setEncoderOptions({ method: kind.EncoderMethod[method], ...options });
  await io.write(to, document);
}

// By gltfpack. All attributes and the names of materials are kept.
async function pack(from, to, ...options) {
  const { pack } = await load('gltfpack');
  const files = { read: (name) => fs.readFileSync(name), write: (name, bytes) => fs.writeFileSync(name, bytes) };
  await pack(['-i', from, '-o', to, '-kv', '-km', ...options], files);
}

const draco = { quantizationBits: draco_bits };
const ways = {
  'draco-edgebreaker': (from, to) => transform(from, to, 'KHRDracoMeshCompression', 'EDGEBREAKER', draco),
  'draco-sequential': (from, to) => transform(from, to, 'KHRDracoMeshCompression', 'SEQUENTIAL', draco),
  'meshopt-floats': (from, to) => transform(from, to, 'EXTMeshoptCompression', 'QUANTIZE'),
  'meshopt-filtered': (from, to) => transform(from, to, 'EXTMeshoptCompression', 'FILTER'),
  'gltfpack-floats': (from, to) => pack(from, to, '-c', '-noq'),
  'gltfpack-quantised': (from, to) => pack(from, to, '-c', ...pack_bits),
  'gltfpack-filtered': (from, to) => pack(from, to, '-cc', ...pack_bits),
};

const [plain, ...names] = process.argv.slice(2);
for (const name of names) await ways[name](plain, path.join(path.dirname(plain), `${name}.glb`));
