// Decodes a stream with our own library compiled to WebAssembly whenever standard input says `decode`:
// node ours.mjs LIBRARY.wasm IN.gss
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { serve } from './clock.mjs';

const OK = 0;
const END = 2;
const PAGE = 65536;

const [library, path] = process.argv.slice(2);
const stream = readFileSync(path);
const { instance } = await WebAssembly.instantiate(readFileSync(library), {});
const c = instance.exports;
// Pages of ours: the library uses those only that it has asked for itself.
const ours = c.memory.grow(1 + Math.ceil(stream.length / PAGE)) * PAGE;
const frameAt = ours + Math.ceil(stream.length / PAGE) * PAGE;
new Uint8Array(c.memory.buffer, ours, stream.length).set(stream);

function decode() {
  const decoder = c.splatstream_decoder_new();
  assert.equal(c.splatstream_decoder_open_bytes(decoder, ours, stream.length), OK);
  let gaussians = 0;
  let status;
  while ((status = c.splatstream_decoder_next_frame(decoder, frameAt)) === OK) {
    assert.equal(c.splatstream_decoder_planes(decoder, frameAt + 64), OK);
    gaussians += new DataView(c.memory.buffer, frameAt).getUint32(8, true);
  }
  assert.equal(status, END);
  c.splatstream_decoder_free(decoder);
  return { gaussians, bytes: stream.length };
}

await serve({ decode });
