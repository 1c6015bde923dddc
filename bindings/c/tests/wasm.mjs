// Decodes a stream with the library compiled to WebAssembly, which has to import nothing, in pieces, as a page would that
// fetches it: node wasm.mjs LIBRARY.wasm IN.gss. Prints Gaussians per frame; how long that took goes to standard error.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

const OK = 0, NEED_BYTES = 1, END = 2;
const PAGE = 65536;
const PIECE = 1000;

const [library, path] = process.argv.slice(2);
const code = readFileSync(library);
const stream = readFileSync(path);
const module = new WebAssembly.Module(code);
assert.deepEqual(WebAssembly.Module.imports(module), []);
const c = new WebAssembly.Instance(module, {}).exports;
assert.equal(c.splatstream_abi_version(), 1);

// Pages of ours: the library uses those only that it has asked for itself.
const ours = c.memory.grow(1) * PAGE;
const frameAt = ours + PIECE + 24;

function show() {
    // The memory is another object after it has grown.
    const view = new DataView(c.memory.buffer, frameAt);
    const gaussians = view.getUint32(8, true), warnings = view.getUint32(16, true), index = view.getUint32(20, true);
    assert.equal(warnings, 0);
    console.log(`frame ${index}: ${gaussians} Gaussians`);
}

const start = performance.now();
const decoder = c.splatstream_decoder_new();
let status = NEED_BYTES;
for (let at = 0; status === NEED_BYTES; at += PIECE) {
    const piece = stream.subarray(at, at + PIECE);
    new Uint8Array(c.memory.buffer, ours, PIECE).set(piece);
    const taken = at < stream.length
        ? c.splatstream_decoder_push(decoder, ours, piece.length)
        : c.splatstream_decoder_end(decoder);
    assert.equal(taken, OK);
    while ((status = c.splatstream_decoder_next_frame(decoder, frameAt)) === OK) show();
}
assert.equal(status, END);
c.splatstream_decoder_free(decoder);
console.error(`wasm: ${code.length} bytes, no imports, ${stream.length} bytes decoded in ${Math.round(performance.now() - start)} ms`);
