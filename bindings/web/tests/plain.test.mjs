// The modules for engines without instructions of 128 bits, in Node as if it were one: node --test plain.test.mjs, with the
// variables of setting.mjs and, in ENGINES, a folder where npm has installed WABT. build.sh --plain makes the modules.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import test from 'node:test';
import { Decoder, loadModule } from '../decoder/index.js';
import { POINTS, nativeDigests, pointOf, stream } from './setting.mjs';

const wabt = await createRequire(join(process.env.ENGINES, 'package.json'))('wabt')();
const features = { simd: false, relaxed_simd: false };

/** The module that an engine takes which knows no instruction of 128 bits. */
async function plainModule() {
  const { validate } = WebAssembly;
  WebAssembly.validate = (bytes) => bytes.length > 100 && validate(bytes);
  try {
    return await loadModule();
  } finally {
    WebAssembly.validate = validate;
  }
}

/** Digests, texels and orders of all frames. */
function decoded(module, point) {
  const decoder = new Decoder(module);
  decoder.setPoint(point);
  decoder.push(stream);
  decoder.end();
  const frames = [];
  for (let frame = decoder.next(); !frame.isEnd; frame = decoder.next()) {
    frames.push({ digest: frame.digest, update: decoder.show(), order: decoder.sort([0, 0, -5], [0, 0, 1]) });
  }
  return frames;
}

for (const name of ['splatstream', 'splatstream-packages']) {
  test(`${name}-plain.wasm has no instruction of 128 bits, and ${name}.wasm has`, () => {
    const read = (suffix) => wabt.readWasm(readFileSync(new URL(`../decoder/${name}${suffix}.wasm`, import.meta.url)), features);
    read('-plain').validate(features);
    assert.throws(() => read('').validate(features));
  });
}

test('an engine without vectors gets the other module, which gives the same frames, texels and orders', async () => {
  const [plain, fast] = [await plainModule(), await loadModule()];
  for (const point of POINTS) {
    const frames = decoded(plain, pointOf(point));
    assert.deepEqual(frames.map(({ digest }) => digest), nativeDigests(point));
    assert.ok(frames.every(({ order }) => order.slots.length > 0));
    assert.deepEqual(frames, decoded(fast, pointOf(point)));
  }
});
