// Runs Khronos' glTF validator: node validate_gltf.js FOLDER FILE...
// FOLDER holds node_modules/gltf-validator. Exit code 1 where a file has errors.
const fs = require("fs");
const path = require("path");

const [folder, ...files] = process.argv.slice(2);
const validator = require(path.resolve(folder, "node_modules", "gltf-validator"));

async function validate(file) {
  const read = (uri) =>
    fs.promises.readFile(path.resolve(path.dirname(file), decodeURIComponent(uri)));
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
    uri: path.basename(file),
    externalResourceFunction: async (uri) => new Uint8Array(await read(uri)),
  });
  const { numErrors, numWarnings, messages } = report.issues;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings`);
  for (const each of messages.filter((message) => message.severity === 0).slice(0, 20)) {
    console.log(`  ${each.code}: ${each.message} ${each.pointer}`);
  }
  return numErrors;
}

(async () => {
  let errors = 0;
  for (const file of files) errors += await validate(file);
  process.exit(errors ? 1 : 0);
})();
