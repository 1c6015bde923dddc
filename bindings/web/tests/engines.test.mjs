// The adapters for engines in Chromium: node --test engines.test.mjs, with the variables of browser.test.mjs, and ENGINES, the
// folder with the npm packages of the engines. Pictures stay in the folder of the tests.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import test, { after, before } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch, lookAt, psnr } from './browser.mjs';
import { serve } from './server.mjs';
import { at, splatstream, stream, streamPath, writeCameras } from './setting.mjs';

const SIZE = { width: 320, height: 180 };
/**
 * What pictures have at least against those of the repository's renderer, decibels. Spark cuts ellipses at the square root
 * of 8 standard deviations and keeps colours in 8 bits; PlayCanvas also bends the bell down to 0 there. Of a neighbouring
 * frame both have less.
 */
const ENGINES = [['spark', 46], ['playcanvas', 32.5]];
const IMPORTS = {
  '@splatstream/decoder': '/decoder/index.js',
  '@splatstream/player/spark': '/player/spark.js',
  '@splatstream/player/playcanvas': '/player/playcanvas.js',
  '@sparkjsdev/spark': '/npm/@sparkjsdev/spark/dist/spark.module.js',
  three: '/npm/three/build/three.module.js',
  'three/addons/': '/npm/three/examples/jsm/',
  playcanvas: '/npm/playcanvas/build/playcanvas.mjs',
};
const PAGE = `<!doctype html><meta charset="utf-8"><title>Engines</title><link rel="icon" href="data:,"><style>body { margin: 0 }</style>
<script type="importmap">${JSON.stringify({ imports: IMPORTS })}</script><script type="module" src="/tests/engines/page.js"></script>`;
/** A frame, and another one that looks different. */
const [FRAME, OTHER] = [5, 0];
/** They stand outside: engines leave out Gaussians whose middle is far outside of the picture. */
const CAMERAS = [0.3, 2.2].map((turn) => lookAt([12 * Math.sin(turn), -3, -12 * Math.cos(turn)], [0, -0.6, 0], 0.4));
let server, browser;

before(async () => {
  splatstream('demo', '--out', at('still'), '--gaussians', '4000', '--frames', '1');
  const cameras = writeCameras(CAMERAS, SIZE.width, SIZE.height);
  splatstream('render', streamPath, '--camera', cameras, '-o', at('native-moving'), '--frames', `${OTHER}..${FRAME + 1}`);
  splatstream('render', at('still', 'demo.gss'), '--camera', cameras, '-o', at('native-still'));
  const packages = fileURLToPath(new URL('..', import.meta.url));
  const files = { '/engines.html': PAGE, '/moving.gss': stream, '/still.gss': readFileSync(at('still', 'demo.gss')) };
  for (const [name] of ENGINES) files[`/examples/${name}/scene.gss`] = stream;
  const folders = { '/npm/': join(process.env.ENGINES, 'node_modules') };
  for (const [name] of ENGINES) {
    const installed = `/examples/${name}/node_modules/`;
    for (const own of ['decoder', 'player']) folders[`${installed}@splatstream/${own}/`] = join(packages, own);
    folders[installed] = folders['/npm/'];
  }
  server = await serve(files, folders);
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** A page with an engine; whatever goes to the console fails the test at `finish`. */
async function engine(name) {
  const page = await browser.openPage(`${server.url}engines.html`, { viewport: SIZE });
  await page.evaluate(({ name, width, height }) => start(name, width, height), { name, ...SIZE });
  return page;
}

const native = (frame, view) => readFileSync(at('native-moving', `frame_${String(frame).padStart(4, '0')}_view_${view}.png`));

/** The picture of a camera, also as a file of a name. */
async function picture(page, camera, name) {
  const png = Buffer.from(await page.evaluate((camera) => picture(camera), camera), 'base64');
  if (name) writeFileSync(at(name), png);
  return png;
}

for (const [name, bound] of ENGINES) {
  test(`${name} draws a still scene as the repository does`, async () => {
    const page = await engine(name);
    await page.evaluate(() => add('still', '/still.gss'));
    const decibels = await psnr(page, await picture(page, CAMERAS[0], `${name}-still.png`), readFileSync(at('native-still', 'view_0.png')));
    console.log(`${name}, still: ${decibels.toFixed(2)} dB`);
    assert.ok(decibels > bound, `${decibels} dB`);
    await page.finish();
  });

  test(`${name} draws the frame that is sought, from any side`, async () => {
    const page = await engine(name);
    await page.evaluate(() => add('moving', '/moving.gss', { autoplay: false }));
    await page.evaluate((frame) => objects.moving.seek(frame), OTHER);
    const before = await picture(page, CAMERAS[0]);
    const uploaded = await page.evaluate((frame) => objects.moving.seek(frame).then(() => objects.moving.statistics.uploaded), FRAME);
    assert.ok(uploaded > 0);
    for (const [view, camera] of CAMERAS.entries()) {
      const shown = await picture(page, camera, `${name}-moving-${view}.png`);
      const decibels = await psnr(page, shown, native(FRAME, view));
      const other = await psnr(page, shown, native(OTHER, view));
      console.log(`${name}, moving, view ${view}: ${decibels.toFixed(2)} dB; against frame ${OTHER} ${other.toFixed(2)} dB`);
      assert.ok(decibels > bound && decibels > other + (view === 0 ? 1 : 0), `${decibels} dB, ${other} dB`);
      if (view === 0) assert.ok((await psnr(page, before, shown)) < 38, 'the frames look alike');
    }
    await page.finish();
  });

  test(`${name} moves what plays, with others beside it, and changes its operating point`, async () => {
    const page = await engine(name);
    await page.evaluate(() => add('one', '/moving.gss', { autoplay: false }));
    const [camera] = CAMERAS;
    const whole = await picture(page, camera);
    // A scene that is turned and moved looks from a camera that moves with it as before.
    const [turn, move] = [0.8, [0.4, 0.2, -0.3]];
    await page.evaluate((transform) => engine.transform(objects.one, transform), { turn, move });
    const along = await picture(page, transformed(camera, turn, move));
    const moved = await psnr(page, whole, along);
    assert.ok(moved > 33, `${moved} dB`);
    assert.ok((await psnr(page, whole, await picture(page, camera))) < moved - 6);
    await page.evaluate(() => (objects.one.operatingPoint = { spatial: 0, temporal: 1, refinement: 0 }));
    await page.evaluate(() => objects.one.seek(0));
    assert.ok((await psnr(page, along, await picture(page, transformed(camera, turn, move)))) < moved - 3);
    // Another one, from far away: there is something where there was nothing.
    const far = lookAt([0, -4, -30], [0, 0, 0], 0.7);
    const alone = await picture(page, far);
    await page.evaluate(() => add('two', '/still.gss'));
    await page.evaluate(() => engine.transform(objects.two, { turn: 0, move: [10, 0, 0] }));
    const both = await picture(page, far, `${name}-two.png`);
    assert.ok((await psnr(page, alone, both)) < 30);
    await page.evaluate(() => remove('two'));
    const left = await psnr(page, alone, await picture(page, far));
    assert.ok(left > 45, `${left} dB`);
    await page.finish();
  });

  test(`${name} plays by itself, round and round, and frees everything`, async () => {
    const page = await engine(name);
    // What an engine makes once stays.
    await page.evaluate(() => add('first', '/moving.gss'));
    await page.evaluate(() => seenFrames('first', 3));
    await page.evaluate(() => remove('first'));
    const textures = await page.evaluate(() => settledTextures());
    await decoders(page, 0);
    await page.evaluate(() => add('loop', '/moving.gss'));
    await decoders(page, 1);
    const seen = await page.evaluate(() => seenFrames('loop', 3));
    assert.ok(seen.length > 3 && seen.some((index, place) => place > 0 && index < seen[place - 1]), seen.join());
    await page.evaluate(() => remove('loop'));
    await decoders(page, 0);
    assert.equal(await page.evaluate(() => settledTextures()), textures);
    await page.finish();
  });

  test(`the example of ${name} plays`, async () => {
    const page = await browser.openPage(`${server.url}examples/${name}/`, { viewport: { width: 640, height: 400 } });
    await page.waitForFunction(() => Number(/frame (\d+)/.exec(document.querySelector('output').textContent)?.[1]) > 3, null, { timeout: 60_000 });
    const shown = await page.screenshot({ path: at(`${name}-example.png`), timeout: 60_000 });
    assert.ok(shown.length > 20_000, 'the picture is empty');
    await page.finish();
  });
}

/** Waits until there are so many workers of the decoder. */
async function decoders(page, count) {
  const found = () => page.workers().filter((worker) => worker.url().endsWith('/decoder/worker.js')).length;
  for (let wait = 0; wait < 100 && found() !== count; wait++) await page.waitForTimeout(50);
  assert.equal(found(), count);
}

/** A camera that is turned around the y axis of the world, and moved. */
function transformed({ position, axes, field }, turn, move) {
  const turned = ([x, y, z]) => [x * Math.cos(turn) + z * Math.sin(turn), y, z * Math.cos(turn) - x * Math.sin(turn)];
  return { position: turned(position).map((part, axis) => part + move[axis]), axes: axes.map(turned), field };
}
