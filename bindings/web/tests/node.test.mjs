// The decoder in Node: node --test node.test.mjs, with the variables of setting.mjs.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { cpSync, rmSync } from 'node:fs';
import test from 'node:test';
import { fileURLToPath } from 'node:url';
import { Decoder, DecoderWorker, hasSimd } from '../decoder/index.js';
import { FRAMES, POINTS, at, damaged, nativeDigests, pointOf, stream } from './setting.mjs';

/** Decodes to the end; gives the digest of every frame, and calls `each` with the decoder and the frame. */
function digests(decoder, each = () => {}) {
  const found = [];
  for (let frame = decoder.next(); frame && !frame.isEnd; frame = decoder.next()) {
    found.push(frame.digest);
    each(decoder, frame);
  }
  return found;
}

async function opened(bytes = stream, point = {}) {
  const decoder = await Decoder.load();
  decoder.setPoint(point);
  decoder.push(bytes);
  decoder.end();
  return decoder;
}

for (const point of POINTS) {
  test(`frames at ${point} have the digests of the native decoder`, async () => {
    const expected = nativeDigests(point);
    assert.ok(expected.length > 0);
    assert.deepEqual(digests(await opened(stream, pointOf(point))), expected);
  });
}

test('pieces give the same frames, and none comes before its bytes', async () => {
  const decoder = await Decoder.load();
  const found = [];
  for (let at = 0; at < stream.length; at += 333) {
    decoder.push(stream.subarray(at, at + 333));
    found.push(...digests(decoder));
    if (at < 1000) assert.equal(found.length, 0);
  }
  decoder.end();
  found.push(...digests(decoder));
  assert.deepEqual(found, digests(await opened()));
});

test('bytes are an ArrayBuffer or any view of one, and other things are refused by their names', async () => {
  const whole = digests(await opened());
  const copy = Uint8Array.from(stream);
  // Not from the start of its buffer, and of an even length.
  const shifted = new Uint8Array(copy.length + 8 + (copy.length % 2));
  shifted.set(copy, 4);
  const views = [
    [copy.buffer], [new DataView(shifted.buffer, 4, copy.length)], [new Uint16Array(shifted.buffer, 4, copy.length >> 1), copy.subarray(copy.length & ~1)],
  ];
  for (const parts of views) {
    const decoder = await Decoder.load();
    for (const part of parts) decoder.push(part);
    decoder.end();
    assert.deepEqual(digests(decoder), whole);
  }
  const decoder = await Decoder.load();
  assert.throws(() => decoder.push(new Blob([copy])), { name: 'TypeError', message: /not Blob: give await blob\.arrayBuffer\(\)/ });
  for (const [other, name] of [[[1, 2], 'Array'], ['text', 'String'], [null, 'Null'], [undefined, 'Undefined'], [{ length: 4 }, 'Object']]) {
    assert.throws(() => decoder.push(other), { name: 'TypeError', message: new RegExp(`not ${name}$`) });
  }
  assert.throws(() => new DecoderWorker({ bytes: new Blob([copy]) }, { startWorker: () => assert.fail('it is started') }), TypeError);
});

test('a seek gives the frame that was sought, also backwards and after the end', async () => {
  const whole = digests(await opened());
  const decoder = await opened();
  for (const index of [17, 3, 23, 0, 8, 11]) {
    decoder.seek(index);
    const frame = decoder.next();
    assert.deepEqual([frame.index, frame.digest], [index, whole[index]]);
  }
  digests(decoder);
  decoder.seek(5);
  assert.equal(decoder.next().index, 5);
});

test('damage is said, costs at most its GOP, and leaves the other frames as they are', async () => {
  const whole = digests(await opened());
  const warnings = [];
  const shown = new Map();
  digests(await opened(damaged()), (_, frame) => {
    warnings.push(...frame.warnings);
    shown.set(frame.index, frame.digest);
  });
  assert.ok(warnings.length > 0);
  const differing = whole.map((digest, index) => [index, digest]).filter(([index, digest]) => shown.get(index) !== digest);
  assert.ok(differing.length > 0 && differing.length <= 8);
  assert.ok(differing.every(([index]) => Math.floor(index / 8) === Math.floor(differing[0][0] / 8)));
});

test('what is no stream is refused with a reason', async () => {
  const decoder = await opened(new TextEncoder().encode('This is no stream of SplatStream at all.'));
  assert.throws(() => decoder.next(), /./);
});

test('only changed rows are copied, and slots are stable', async () => {
  const decoder = await opened();
  let copied = 0, whole = 0;
  digests(decoder, (_, frame) => {
    const update = decoder.show();
    assert.ok(update.slots >= frame.gaussians);
    assert.equal(update.isNew, frame.index === 0);
    if (frame.index > 0) assert.ok(update.kept + update.appeared === frame.gaussians);
    copied += update.base.reduce((sum, { rows }) => sum + rows, 0);
    whole += update.slots / 512;
  });
  assert.ok(copied <= whole);
});

test('the order is that of the depth, farthest first', async () => {
  const decoder = await opened();
  decoder.next();
  const { base } = decoder.show();
  const places = new Float32Array(base[0].words.buffer);
  const { slots, near } = decoder.sort([0, 0, -5], [0, 0, 1]);
  assert.ok(near > 0 && slots.length > 3000);
  const depths = [...slots].map((slot) => places[8 * slot + 2] + 5);
  assert.ok(depths.every((depth, at) => at === 0 || depth <= depths[at - 1] * 1.001));
});

test('memory does not grow from round to round', async () => {
  const decoder = await opened();
  const rounds = Array.from({ length: 24 }, () => {
    decoder.seek(0);
    assert.equal(digests(decoder, () => decoder.show()).length, FRAMES);
    return decoder.memory;
  });
  // The allocator finds places for what lives side by side in the first rounds.
  assert.deepEqual(new Set(rounds.slice(8)), new Set([rounds[7]]));
});

test('the description says what the stream holds', async () => {
  const decoder = await opened();
  decoder.next();
  const { frames, frameSeconds, highest, upAxis } = decoder.describe();
  assert.deepEqual([frames, highest, upAxis], [FRAMES, { spatial: 1, temporal: 1, refinement: 2 }, '-y']);
  assert.ok(Math.abs(frameSeconds - 1 / 30) < 1e-6);
});

test('all rows are those that the updates have brought, one after the other', async () => {
  const decoder = await opened();
  assert.equal(decoder.whole(), null);
  let [base, sh] = [null, null];
  const write = (texture, runs) => {
    for (const { row, rows, words } of runs) texture.set(words, (row * words.length) / rows);
  };
  digests(decoder, () => {
    const update = decoder.show();
    if (update.isNew) [base, sh] = [update.base, update.sh].map(([all]) => new Uint32Array(all?.words.length ?? 0));
    write(base, update.base);
    write(sh, update.sh);
  });
  const whole = decoder.whole();
  assert.deepEqual([whole.isNew, whole.base.length, whole.base[0].row, whole.base[0].rows], [true, 1, 0, whole.slots / 512]);
  assert.deepEqual(whole.base[0].words, base);
  assert.deepEqual(whole.sh[0]?.words ?? new Uint32Array(0), sh);
});

test('a server that renders pages can import the player', () => {
  const installed = at('installed');
  rmSync(installed, { recursive: true, force: true });
  for (const name of ['decoder', 'player']) {
    cpSync(fileURLToPath(new URL(`../${name}`, import.meta.url)), at('installed', 'node_modules', '@splatstream', name), { recursive: true });
  }
  const program = "import { SplatPlayer, Renderer } from '@splatstream/player'; console.log(SplatPlayer.name, Renderer.name, typeof document);";
  const said = execFileSync(process.execPath, ['--input-type=module', '--eval', program], { cwd: installed, encoding: 'utf8' });
  assert.equal(said.trim(), 'SplatPlayer Renderer undefined');
});

test('this engine takes the module with SIMD', () => assert.ok(hasSimd()));
