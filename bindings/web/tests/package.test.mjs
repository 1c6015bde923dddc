// Packages in Node, over networks that are made up: node --test package.test.mjs, with the variables of setting.mjs.
import assert from 'node:assert/strict';
import test, { afterEach } from 'node:test';
import { GOP, pointOf } from './setting.mjs';
import { FRAMES, FRAME_TIME, Viewer, broadcast, broadcastPath, descriptionOf, digestsAt, files, manifestAt, network, packagedPath, pause } from './package.mjs';

const ADDRESS = 'http://127.0.0.1/talk/manifest.json';
/** Milliseconds of a frame in most tests: a GOP lasts 0.2 s. */
const FRAME = 25;
const open = [];

afterEach(() => open.splice(0).forEach((end) => end()));

/** The files with a manifest in which a frame lasts so long. */
function served(frame = FRAME, change = (manifest) => manifest) {
  return new Map([...files, ['manifest.json', Buffer.from(JSON.stringify(change(manifestAt(frame))))]]);
}

async function viewer(behaviour, { content = served(), source = { package: ADDRESS }, options = {} } = {}) {
  const made = network(content, behaviour);
  const player = await Viewer.open(source, options);
  open.push(made.restore, () => player.close());
  return { player, ...made };
}

/** Every frame is that of the native decoder at the point that it was decoded at. */
async function check(frames, path) {
  assert.ok(frames.length > 0);
  for (const { index, point, digest } of frames) {
    assert.equal(digest, (await digestsAt(point, path)).get(index), `frame ${index} at ${JSON.stringify(point)}`);
  }
}

const isMedia = ({ file }) => file.endsWith('.mp4');
const isEnhancement = ({ file }) => isMedia({ file }) && file !== 's0.mp4';
const best = pointOf('s1,t1,r2');
const quality = ({ spatial, temporal, refinement }) => 100 * spatial + 10 * temporal + refinement;

test('a good network brings every frame, at last everything of it, with the digests of the native decoder', async () => {
  const { player } = await viewer();
  const frames = await player.play(FRAME);
  await check(frames);
  // What is shown at last looks like everything.
  assert.equal(player.states.at(-1).quality, Math.max(...manifestAt(FRAME).quality.map(({ psnr_db }) => Math.min(50, psnr_db))));
  for (const [place, { index, until }] of frames.entries()) {
    assert.equal(until, frames[place + 1]?.index ?? FRAMES, `after frame ${index}`);
  }
  assert.deepEqual(player.warnings, []);
  assert.equal(player.states.at(-1).stalls, 0);
});

for (const source of [{ url: 'http://127.0.0.1/talk/' }, { url: ADDRESS }, { url: 'http://127.0.0.1/talk/manifest.mpd' }, { package: 'http://127.0.0.1/talk' }]) {
  test(`a package is found at ${JSON.stringify(source)}`, async () => {
    const content = served();
    const { player } = await viewer(({ file }) => (file === 'talk' ? { status: 404 } : {}), { source, content });
    await check([await player.see(0)]);
  });
}

test('a package says of itself what its stream does, before the first frame, wherever that is', async () => {
  const described = await descriptionOf(packagedPath);
  assert.equal(described.upAxis, '-y');
  for (const first of [0, 60]) {
    const { player } = await viewer(undefined, { content: files });
    await player.see(first);
    assert.deepEqual([player.description, player.describedAfter], [described, 0]);
  }
});

test('a slow network gets a lower point, and no stall after the start', async () => {
  const bytes = [...files].filter(([name]) => isMedia({ file: name })).reduce((sum, [, { length }]) => sum + length, 0);
  // A third of what everything takes.
  const rate = bytes / (FRAMES * 0.125) / 3;
  const { player } = await viewer((request) => (isMedia(request) ? { rate } : {}), { content: served(125) });
  const frames = await player.play(125, 0, 6 * GOP);
  await check(frames);
  const { stalls, throughput } = player.states.at(-1);
  assert.equal(stalls, 0);
  assert.ok(throughput > 0 && throughput < 16 * rate, `${throughput} of ${8 * rate}`);
  assert.ok(frames.some(({ point }) => quality(point) < quality(best)));
});

test('what improves a GOP and is not there is left out and named', async () => {
  const { player } = await viewer((request) => (isEnhancement(request) ? { status: 404 } : {}), { content: served(100) });
  const frames = await player.play(100, 0, 4 * GOP);
  await check(frames);
  assert.deepEqual(new Set(frames.map(({ point }) => point.spatial)), new Set([0]));
  assert.ok(player.warnings.some((line) => line.includes('404') && line.includes('cannot be had')), player.warnings.join());
});

test('a server that is busy for a moment is asked again', async () => {
  const { player } = await viewer((request) => (isMedia(request) && request.number === 2 ? { status: 503 } : {}));
  await check(await player.play(FRAME));
  assert.deepEqual(player.warnings, []);
  assert.ok(player.states.at(-1).failures > 0);
});

test('bytes that arrive damaged once are fetched again, past caches, and never shown', async () => {
  const change = (bytes) => (bytes[bytes.length >> 1] ^= 1);
  let damaged = 0;
  const { player, requests } = await viewer((request) => (isMedia(request) && damaged++ < 1 ? { change } : {}));
  await check(await player.play(FRAME));
  assert.deepEqual(player.warnings, []);
  assert.equal(player.states.at(-1).failures, 1);
  const [first] = requests.filter(isMedia);
  // What arrived before the damage stays.
  const isAgain = ({ file, range }) => file === first.file && first.range[0] <= range[0] && range[0] <= first.range[1];
  assert.ok(requests.slice(1).some((request) => request.cache === 'reload' && isAgain(request)));
});

test('bytes that are always damaged are left out', async () => {
  const { player } = await viewer((request) => (isEnhancement(request) ? { change: (bytes) => (bytes[0] ^= 1) } : {}));
  player.worker.run(0);
  const first = await player.see(0);
  await pause(1500);
  await check([first, await player.see(0), await player.see(GOP)]);
  assert.ok(player.warnings.some((line) => line.includes('digest')), player.warnings.join());
});

test('a server that ignores ranges is played all the same', async () => {
  const { player } = await viewer((request) => ({ isWhole: isMedia(request) }));
  await check(await player.play(FRAME));
  assert.deepEqual(player.warnings, []);
});

test('another range than that asked for is never shown', async () => {
  const behaviour = (request) => (isEnhancement(request) && request.range ? { change: (bytes, first) => bytes.set(files.get(request.file).subarray(Math.max(0, first - 8)).subarray(0, bytes.length)) } : {});
  const { player } = await viewer(behaviour);
  await check(await player.play(FRAME));
});

test('responses that end early and connections that are lost are outlasted', async () => {
  const behaviour = (request) => (isMedia(request) && request.number % 3 === 2 ? (request.number % 2 ? { fails: true } : { length: 50 }) : {});
  const { player } = await viewer(behaviour, { content: served(60) });
  const frames = await player.play(60, 0, 6 * GOP);
  await check(frames);
  assert.ok(player.states.at(-1).failures > 0);
});

test('what is fetched for another place is given up by a seek', async () => {
  const { player, requests } = await viewer((request) => (isEnhancement(request) ? { rate: 2000 } : {}), { content: served(400) });
  await player.see(0);
  await pause(300);
  const running = requests.at(-1);
  assert.ok(isEnhancement(running) && !running.isAborted);
  await check([await player.see(FRAMES - GOP)]);
  assert.ok(running.isAborted);
});

test('seeks are exact to the frame at a chosen point, and fetch what they need', async () => {
  const { player, requests } = await viewer(undefined, { options: { point: best } });
  const indices = [57, 3, 95, 0, 42];
  for (const index of indices) {
    const frame = await player.see(index);
    assert.deepEqual([frame.index, frame.point], [index, best]);
    await check([frame]);
  }
  // A seek gives up what runs, and what has just been sent.
  const whole = requests.filter((request) => isMedia(request) && !request.isAborted && request.got > 0);
  const asked = whole.map(({ file, range }) => `${file} ${range}`);
  assert.equal(new Set(asked).size, asked.length, 'something was fetched twice');
});

test('a chosen point is what is shown, and the network decides again afterwards', async () => {
  const { player } = await viewer(undefined, { options: { point: pointOf('s0,t0,r0') } });
  const low = await player.play(FRAME);
  await check(low);
  assert.deepEqual(new Set(low.map(({ point }) => quality(point))), new Set([0]));
  player.worker.setPoint({});
  player.worker.run(0);
  const high = await player.see(GOP);
  await check([high]);
});

test('what stands still gets better until nothing is missing', async () => {
  const { player } = await viewer((request) => (isMedia(request) ? { rate: 400_000 } : {}));
  player.worker.run(0);
  let frame = await player.see(4);
  const points = [quality(frame.point)];
  for (let wait = 0; wait < 200 && (frame.index < 4 || frame.point.refinement < best.refinement); wait++) {
    await pause(20);
    if (player.better === undefined) continue;
    player.better = undefined;
    frame = await player.see(4);
    points.push(quality(frame.point));
  }
  await check([frame]);
  assert.deepEqual([frame.index, frame.point.spatial, frame.point.refinement], [4, best.spatial, best.refinement]);
  assert.ok(points.every((point, place) => place === 0 || point >= points[place - 1]), points.join());
});

for (const [name, behaviour] of [['all of it is there', () => ({})], ['nothing improves it', (request) => (isEnhancement(request) ? { status: 404 } : {})]]) {
  test(`what stands still is said to be the best when ${name}`, async () => {
    const { player } = await viewer(behaviour);
    player.worker.run(0);
    let frame = await player.see(12);
    for (let wait = 0; wait < 500 && player.best === undefined; wait++) {
      await pause(20);
      if (player.better === undefined) continue;
      player.better = undefined;
      frame = await player.see(12);
    }
    assert.equal(player.best, frame.index);
    assert.ok(frame.index <= 12 && 12 < frame.until, JSON.stringify(frame));
    await check([frame]);
  });
}

test('GOPs that were shown are shown again without a request', async () => {
  const { player, requests } = await viewer(undefined, { options: { point: best } });
  await player.play(FRAME);
  const count = requests.length;
  await check(await player.play(FRAME));
  assert.equal(requests.length, count);
});

test('a lost base is skipped and named, and the rest is played', async () => {
  const gop = manifestAt(FRAME).gops[1].subsegments.find(({ representation }) => representation === 's0');
  const first = gop.levels[0].offset;
  const { player } = await viewer((request) => (request.file === 's0.mp4' && request.range?.[0] <= first && request.range?.[1] >= first && request.range?.[0] > 0 ? { status: 410 } : {}));
  player.worker.run(1);
  const frames = [];
  for (let index = 0; index < FRAMES; ) {
    const frame = await player.see(index);
    if (frame === null) break;
    frames.push(frame);
    index = Math.max(index + 1, frame.until);
  }
  await check(frames);
  assert.ok(!frames.some(({ index }) => index >= GOP && index < 2 * GOP));
  assert.ok(frames.some(({ index }) => index >= 2 * GOP));
  assert.ok(player.warnings.some((line) => line.includes('GOP 1') && line.includes('410')), player.warnings.join());
});

test('a package that becomes another one is refused in words', async () => {
  const content = served(200);
  const { player } = await viewer(({ file, number }) => ({ tag: isMedia({ file }) ? `"${number > 6}"` : undefined }), { content });
  await player.see(0);
  const other = manifestAt(200);
  other.gops[2].subsegments[0].levels[0].digest = '0123456789abcdef';
  content.set('manifest.json', Buffer.from(JSON.stringify(other)));
  await assert.rejects(async () => {
    for (let index = 0; index < FRAMES; index += GOP) {
      await player.see(index);
      await pause(500);
    }
    throw new Error('nobody has noticed');
  }, /the package changed while it was played, from GOP 2 on/);
});

test('files that are tagged again are followed', async () => {
  const { player } = await viewer(({ file, number }) => ({ tag: isMedia({ file }) ? `"${number > 4}"` : undefined }));
  await check(await player.play(FRAME));
  assert.deepEqual(player.warnings, []);
});

test('manifests that are none, or are not there, are refused with a reason', async () => {
  const bad = served(FRAME, (manifest) => ({ ...manifest, version: 9 }));
  const { player } = await viewer(undefined, { content: bad });
  await assert.rejects(player.see(0), /the manifest is refused: version: version 9/);
  const { player: gone } = await viewer(() => ({ status: 404 }));
  await assert.rejects(gone.see(0), /404/);
});

/** A viewer of a broadcast that has gone on for a while. */
async function liveViewer(window, behaviour) {
  const live = await broadcast(window);
  open.push(live.close);
  await pause(4500);
  return viewer(behaviour, { content: live.files });
}

test('a presentation that grows is followed near its end, to its last frame', async () => {
  const { player } = await liveViewer(60);
  const frames = await player.play(FRAME_TIME);
  await check(frames, broadcastPath);
  const { frames: count, ...described } = await descriptionOf(broadcastPath);
  assert.deepEqual([described.title, described.background, described.cameras.length], ['A broadcast', [0.25, 0.5, 0.75], 1]);
  // While it grows nobody knows how many frames it will have.
  assert.deepEqual([player.description, player.describedAfter], [{ ...described, frames: 0 }, 0]);
  const [first] = frames;
  assert.ok(first.isJump && first.index > 0, JSON.stringify(first));
  for (const [place, { until, isJump }] of frames.entries()) {
    assert.equal(until, frames[place + 1]?.index ?? FRAMES);
    assert.ok(place === 0 || !isJump);
  }
  assert.deepEqual(player.warnings, []);
  const live = player.states.filter(({ isLive }) => isLive);
  assert.ok(live.length > 3 && live.every(({ isBehind, frames: end, edge }) => !isBehind && edge < end));
  assert.ok(live.at(-1).delay < 2, `${live.at(-1).delay} s`);
  const last = player.states.at(-1);
  assert.deepEqual([last.isLive, last.first, last.frames, last.delay], [false, 0, FRAMES, null]);
});

test('a viewer of a presentation that grows goes back, and returns to what is being made', async () => {
  const { player } = await liveViewer(60);
  player.worker.setPoint(best);
  const first = await player.see(0);
  const past = [await player.see(3), await player.see(4)];
  assert.deepEqual(past.map(({ index }) => index), [3, 4]);
  assert.ok(first.index > 24 && past.every(({ isJump }) => !isJump));
  await pause(300);
  await check([...past, await player.see(5)], broadcastPath);
  const { isBehind, edge, delay } = player.states.at(-1);
  assert.ok(isBehind && edge > 24 && delay > 3, JSON.stringify({ isBehind, edge, delay }));
  const now = await player.see(edge);
  assert.equal(now.index, edge);
  await check([now, ...(await player.play(FRAME_TIME, now.until))], broadcastPath);
  assert.ok(!player.states.at(-1).isBehind);
  assert.deepEqual(player.warnings, []);
});

test('a manifest that cannot be read for a while does not stop a presentation that grows', async () => {
  let [refused, since] = [0, null];
  const behaviour = ({ file, number }) => {
    if (file !== 'manifest.json' || number === 0) return {};
    since ??= performance.now();
    return performance.now() - since < 700 ? (refused++ % 2 ? { status: 503 } : { fails: true }) : {};
  };
  const { player } = await liveViewer(60, behaviour);
  const frames = await player.play(FRAME_TIME);
  await check(frames, broadcastPath);
  assert.equal(frames.at(-1).until, FRAMES);
  assert.ok(refused > 1);
  assert.deepEqual(player.warnings, []);
});
