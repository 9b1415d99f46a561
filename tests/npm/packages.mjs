// Packages that lie in a folder of NODE_PATH, which `import` alone does not look at. Ends node with 3 where one is not there.
import { createRequire } from 'node:module';
import { pathToFileURL } from 'node:url';

const require = createRequire(import.meta.url);

export async function load(name) {
  let file;
  try {
    file = require.resolve(name);
  } catch {
    console.log(`the package ${name} of npm is not there`);
    process.exit(3);
  }
  const module = await import(pathToFileURL(file));
  return module.default ?? module;
}
