// The tools of other formats that speak JavaScript: the glTF validator, and the writer of .ksplat. Standard input is a job, the
// last line of the output is its result.
import { readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { pathToFileURL } from 'node:url';

const job = JSON.parse(readFileSync(0));
console.log(JSON.stringify(job.validate ? await validate(job.validate) : await ksplat(job.ksplat)));

async function validate({ module, file }) {
  const validator = createRequire(module)(module);
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 100 });
  // A validator that does not know the extension says so, and takes its attributes for wrong ones.
  const isUnknown = ({ code, pointer }) => code === 'UNSUPPORTED_EXTENSION'
    || code === 'MESH_PRIMITIVE_INVALID_ATTRIBUTE' && pointer.includes('/KHR_gaussian_splatting:');
  const issues = report.issues.messages.filter((issue) => !isUnknown(issue));
  const count = (severity) => issues.filter((issue) => issue.severity === severity).length;
  return { issues: { numErrors: count(0), numWarnings: count(1), messages: issues } };
}

async function ksplat({ module, file, out, level }) {
  // The viewer looks for a browser when it is loaded.
  globalThis.self ??= globalThis;
  globalThis.window ??= globalThis;
  const viewer = await import(pathToFileURL(module));
  const bytes = readFileSync(file);
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const splats = viewer.PlyParser.parseToUncompressedSplatArray(buffer, 2);
  // Nothing is removed for its opacity; sections, centre, blocks and buckets are the usual ones.
  const generator = viewer.SplatBufferGenerator.getStandardGenerator(0, level, 0, undefined, 5, 256);
  writeFileSync(out, Buffer.from(generator.generateFromUncompressedSplatArray(splats).bufferData));
  return {};
}
