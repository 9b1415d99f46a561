// node validate.mjs FOLDER...: Khronos' glTF validator over every GLB in these folders and below. Prints what it finds, and how many
// files there were. Ends with 1 where one has an error or a warning, or there is none; with 3 where the validator is not there.
// Maps of normals without tangents are no fault: a mesh need not have any.
import fs from 'node:fs';
import path from 'node:path';
import { load } from './packages.mjs';

const validator = await load('gltf-validator');
let files = 0, found = 0;
const seen = new Set();
for (const folder of process.argv.slice(2)) {
  for (const name of fs.readdirSync(folder, { recursive: true }).map(String).filter((n) => n.endsWith('.glb'))) {
    const file = path.join(folder, name);
    const beside = async (uri) => new Uint8Array(fs.readFileSync(path.join(path.dirname(file), decodeURIComponent(uri))));
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)),
      { maxIssues: 20, externalResourceFunction: beside, ignoredIssues: ['MESH_PRIMITIVE_GENERATED_TANGENT_SPACE'] });
    ++files;
    found += report.issues.numErrors + report.issues.numWarnings;
    for (const m of report.issues.messages) {
      // Each kind once for each file.
      const kind = `${file}: ${m.code}`;
      if (m.severity < 2 && !seen.has(kind)) console.log(`${kind} ${m.message} ${m.pointer ?? ''}`);
      seen.add(kind);
    }
  }
}
console.log(`${files} files`);
process.exit(found > 0 || files === 0 ? 1 : 0);
