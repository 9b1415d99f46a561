// node validate.mjs SET...: gltf-validator over every tile. Ends with 1 where one has an error or a warning. Works in the
// folder where node_modules lie.
import { createRequire } from 'node:module';
import fs from 'node:fs';
import path from 'node:path';

const validator = createRequire(path.join(process.cwd(), 'x'))('gltf-validator');
let errors = 0, warnings = 0, tiles = 0;
const kinds = {};
for (const set of process.argv.slice(2)) {
  for (const name of fs.readdirSync(set, { recursive: true }).map(String).filter((n) => n.endsWith('.glb'))) {
    const file = path.join(set, name);
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { maxIssues: 20,
      externalResourceFunction: async (uri) => new Uint8Array(fs.readFileSync(path.join(path.dirname(file), decodeURIComponent(uri)))) });
    ++tiles;
    errors += report.issues.numErrors;
    warnings += report.issues.numWarnings;
    for (const m of report.issues.messages) {
      const kind = `${m.code} ${['error', 'warning', 'information', 'hint'][m.severity]}`;
      if (m.severity < 2 && !(kind in kinds)) console.error(`${file}: ${m.message} ${m.pointer}`);
      kinds[kind] = (kinds[kind] ?? 0) + 1;
    }
  }
}
console.log(JSON.stringify({ tiles, errors, warnings, kinds }));
process.exit(errors + warnings > 0 || tiles === 0 ? 1 : 0);
