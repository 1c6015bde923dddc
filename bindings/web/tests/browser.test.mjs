// The player in Chromium: node --test browser.test.mjs, with the variables of setting.mjs, CHROMIUM, and PLAYWRIGHT, the
// folder of playwright-core. Pictures of four moments stay in the folder of the tests.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test, { after, before } from 'node:test';
import { pathToFileURL } from 'node:url';
import { Decoder } from '../decoder/index.js';
import { launch, lookAt, psnr } from './browser.mjs';
import { serve } from './server.mjs';
import { FRAMES, POINTS, at, damaged, nativeDigests, pointOf, splatstream, stream, streamPath, writeCameras } from './setting.mjs';

const SIZE = { width: 480, height: 270 };
/** A page that sets a property of an element before there is a class for it. */
const EARLY = `<!doctype html><meta charset="utf-8"><title>Early</title><link rel="icon" href="data:,">
<script type="importmap">{ "imports": { "@splatstream/decoder": "/decoder/index.js" } }</script>
<splat-player autoplay="no" style="height: 200px"></splat-player><script>document.querySelector('splat-player').src = '/scene.gss';</script>
<script type="module" src="/player/index.js"></script>`;
let server, browser;

before(async () => {
  server = await serve({ '/scene.gss': stream, '/damaged.gss': Buffer.from(damaged()), '/early.html': EARLY });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** A page with a player that has shown its first picture and waits; whatever goes to the console fails the test at `close`. */
async function player({ attributes = {}, size = SIZE, scheme = 'dark', source = '/scene.gss' } = {}) {
  const page = await browser.openPage(server.url, { viewport: size, colorScheme: scheme });
  await page.evaluate(({ all, isAwaited }) => new Promise((resolve, reject) => {
    const element = document.createElement('splat-player');
    for (const [name, value] of Object.entries(all)) element.setAttribute(name, value);
    element.addEventListener('ready', resolve);
    element.addEventListener('failed', ({ detail }) => reject(new Error(detail.message)));
    document.body.append(element);
    window.player = element;
    if (!isAwaited) resolve();
  }), { all: { autoplay: 'no', resolution: 'full', ...(source && { src: source }), ...attributes }, isAwaited: source !== null });
  return page;
}

for (const point of POINTS) {
  test(`the browser shows frames at ${point} with the digests of the native decoder`, async () => {
    const page = await player({ attributes: { 'operating-point': point } });
    const found = await page.evaluate(async (frames) => {
      const digests = [];
      for (let index = 0; index < frames; ) {
        const frame = await player.seek(index);
        digests.push(frame.digest);
        index = frame.index + 1;
        if (player.frame.index >= frames - 1 || frame.index < digests.length - 1) break;
      }
      return digests;
    }, pointOf(point).temporal === 0 ? FRAMES - 1 : FRAMES);
    assert.deepEqual(found, nativeDigests(point));
    await page.finish();
  });
}

test('the first picture comes from the smallest prefix', async () => {
  const decoder = await Decoder.load();
  const point = pointOf('s0,t0,r0');
  decoder.setPoint(point);
  let needed = 0;
  while (decoder.next() === null) {
    decoder.push(stream.subarray(needed, needed + 64));
    needed += 64;
  }
  assert.ok(needed < stream.length / 10, `${needed} of ${stream.length}`);
  const page = await player({ attributes: { 'operating-point': 's0,t0,r0' }, source: null });
  const shown = await page.evaluate(async ({ bytes, prefix }) => {
    const all = Uint8Array.from(bytes);
    player.open({});
    const pause = (time) => new Promise((resolve) => setTimeout(resolve, time));
    let isReady = false;
    player.addEventListener('ready', () => (isReady = true));
    for (let place = 0; place < prefix - 64; place += 500) player.push(all.slice(place, Math.min(place + 500, prefix - 64)), all.length);
    await pause(1500);
    const before = isReady;
    player.push(all.slice(prefix - 64, prefix), all.length);
    for (let wait = 0; wait < 100 && !isReady; wait++) await pause(50);
    return { before, after: isReady, digest: player.frame?.digest };
  }, { bytes: [...stream.subarray(0, needed)], prefix: needed });
  assert.deepEqual(shown, { before: false, after: true, digest: nativeDigests('s0,t0,r0')[0] });
  await page.finish();
});

test('an ArrayBuffer is played, and a Blob is refused while what is there stays', async () => {
  const page = await player();
  const found = await page.evaluate(async () => {
    const bytes = await (await fetch('/scene.gss')).arrayBuffer();
    const shown = (await player.seek(3)).digest;
    const refused = [() => player.open({ bytes: new Blob([bytes]) }), () => player.push(new Blob([bytes]))].map((call) => {
      try {
        return call();
      } catch (error) {
        return `${error.name}: ${error.message}`;
      }
    });
    const still = (await player.seek(3)).digest;
    player.open({ bytes });
    await new Promise((resolve) => player.addEventListener('ready', resolve, { once: true }));
    return { refused, same: [still, (await player.seek(3)).digest].every((digest) => digest === shown) };
  });
  assert.equal(found.same, true);
  for (const line of found.refused) assert.match(line, /^TypeError: .*not Blob: give await blob\.arrayBuffer\(\)/);
  await page.finish();
});

test('attributes are properties, before the element is known as well', async () => {
  const page = await browser.openPage(server.url, { viewport: SIZE, colorScheme: 'light' });
  const found = await page.evaluate(async () => {
    const fresh = document.createElement('splat-player');
    const ready = () => new Promise((resolve) => fresh.addEventListener('ready', resolve, { once: true }));
    Object.assign(fresh, { src: 'scene.gss', autoplay: false, controls: false, operatingPoint: { spatial: 0, temporal: 0, refinement: 0 } });
    const attributes = fresh.getAttributeNames().sort().map((name) => `${name}=${fresh.getAttribute(name)}`);
    document.body.append(fresh);
    await ready();
    const bar = fresh.shadowRoot.getElementById('bar');
    const first = [fresh.frame.point.refinement, fresh.isPlaying, bar.hidden];
    const again = ready();
    fresh.src = new URL('/scene.gss?again', location).href;
    await again;
    fresh.controls = true;
    fresh.setAttribute('operating-point', 's0,t0,r1');
    const { point } = await fresh.seek(2);
    const second = [point.refinement, bar.hidden, fresh.getAttribute('controls')];
    const ground = () => getComputedStyle(fresh).backgroundColor;
    const light = ground();
    fresh.theme = 'dark';
    const dark = ground();
    fresh.theme = null;
    return { attributes, first, second, themes: [light !== dark, light === ground(), fresh.theme] };
  });
  assert.deepEqual(found, {
    attributes: ['autoplay=no', 'controls=none', 'src=scene.gss'],
    first: [0, false, true],
    second: [1, false, null],
    themes: [true, true, ''],
  });
  // The page knows the element only after its properties were set.
  await page.goto(server.url.replace(/\/$/, '/early.html'));
  await page.waitForFunction(() => document.querySelector('splat-player').frame);
  assert.equal(await page.evaluate(() => document.querySelector('splat-player').getAttribute('src')), '/scene.gss');
  await page.finish();
});

test('seeks to five places show the frames there', async () => {
  const page = await player();
  const expected = nativeDigests(POINTS[2]);
  const places = [17, 3, 23, 8, 12];
  const found = await page.evaluate(async (indices) => {
    const shown = [];
    for (const index of indices) shown.push(await player.seek(index));
    return shown.map(({ index, digest }) => [index, digest]);
  }, places);
  assert.deepEqual(found, places.map((index) => [index, expected[index]]));
  await page.finish();
});

test('pictures are those of the renderer of the repository', async () => {
  const cameras = [0.3, 2.2, 4.4].map((turn) => lookAt([3.4 * Math.sin(turn), -0.9, -3.4 * Math.cos(turn)], [0, 0, 0], 0.7));
  splatstream('render', streamPath, '--camera', writeCameras(cameras, SIZE.width, SIZE.height), '-o', at('native'), '--frames', '5..6');
  const page = await player({ attributes: { controls: 'none' } });
  for (const [id, camera] of cameras.entries()) {
    const shown = Buffer.from(await page.evaluate(pictureOf, camera), 'base64');
    const decibels = await psnr(page, shown, readFileSync(at('native', `frame_0005_view_${id}.png`)));
    console.log(`view ${id}: ${decibels.toFixed(2)} dB`);
    // Of a neighbouring frame one of them has less than 45 dB.
    assert.ok(decibels > 45, `${decibels} dB`);
  }
  await page.finish();
});

test('players that are removed leave their contexts to others, and take them back', async () => {
  const page = await player({ attributes: { controls: 'none' } });
  const [before, after] = await page.evaluate(async (count) => {
    const lost = [];
    player.addEventListener('contextlost', () => lost.push('the one that stays'));
    const ready = (element) => new Promise((resolve) => element.addEventListener('ready', resolve, { once: true }));
    const picture = async () => (await (await player.snapshot()).arrayBuffer()).byteLength;
    const first = await picture();
    let other;
    for (let round = 0; round < count; round++) {
      other = Object.assign(document.createElement('splat-player'), { style: 'height: 90px' });
      other.setAttribute('src', '/scene.gss');
      const isReady = ready(other);
      document.body.append(other);
      if (round % 4 === 0) await isReady;
      other.remove();
    }
    // One that is moved, and one that comes back later.
    document.body.append(other);
    document.body.prepend(other);
    await ready(other);
    other.remove();
    await new Promise((resolve) => setTimeout(resolve, 300));
    document.body.append(other);
    await ready(other);
    await new Promise((resolve) => setTimeout(resolve, 500));
    const gl = other.shadowRoot.getElementById('canvas').getContext('webgl2');
    return [{ lost: [], isLost: false, bytes: first }, { lost, isLost: gl.isContextLost(), bytes: await picture() }];
  }, 24);
  assert.deepEqual(after, before);
  await page.finish();
});

test('a context that is lost is restored, and the picture with it', async () => {
  const page = await player({ attributes: { controls: 'none' } });
  const shown = await page.evaluate(async () => {
    const bytes = new Uint8Array(await (await fetch('/scene.gss')).arrayBuffer());
    player.open({});
    player.push(bytes);
    player.finish();
    await new Promise((resolve) => player.addEventListener('ready', resolve, { once: true }));
    const pause = () => new Promise((resolve) => setTimeout(resolve, 500));
    const base64 = async () => {
      await pause();
      const picture = new Uint8Array(await (await player.snapshot()).arrayBuffer());
      return btoa(picture.reduce((text, byte) => text + String.fromCharCode(byte), ''));
    };
    const event = (name) => new Promise((resolve) => player.addEventListener(name, resolve, { once: true }));
    const pictures = [await player.seek(5), await base64()];
    const extension = player.shadowRoot.getElementById('canvas').getContext('webgl2').getExtension('WEBGL_lose_context');
    for (const meanwhile of [5, 17]) {
      const lost = event('contextlost');
      extension.loseContext();
      await lost;
      await player.seek(meanwhile);
      await pause();
      const said = player.shadowRoot.getElementById('said').textContent;
      const restored = event('contextrestored');
      extension.restoreContext();
      await restored;
      pictures.push(said, await base64());
    }
    return [...pictures, await player.seek(5), await base64()].filter((part) => typeof part === 'string');
  });
  const [before, said, , , after, last] = shown;
  assert.match(said, /graphics/);
  assert.equal(shown[2], before);
  assert.notEqual(after, before);
  assert.equal(last, before);
  await page.finish();
});

/** In the page: the picture of a camera as PNG in base64. */
async function pictureOf(camera) {
  await player.seek(5);
  player.camera = camera;
  player.backgroundColour = [0, 0, 0];
  await new Promise((resolve) => setTimeout(resolve, 800));
  const bytes = new Uint8Array(await (await player.snapshot()).arrayBuffer());
  return btoa(bytes.reduce((text, byte) => text + String.fromCharCode(byte), ''));
}

test('a damaged stream keeps playing and says what was lost', async () => {
  const page = await player({ source: '/damaged.gss' });
  const result = await page.evaluate(async (last) => {
    for (let index = 0; index <= last; index++) await player.seek(index);
    return { index: player.frame.index, losses: player.losses };
  }, FRAMES - 1);
  assert.equal(result.index, FRAMES - 1);
  assert.ok(result.losses.length > 0);
  assert.ok(await page.locator('#lost').isVisible());
  await page.screenshot({ path: at('damaged.png'), timeout: 120_000 });
  await page.finish();
});

/** In the page: the contrast of the words in the middle with what is behind them, of the pixels of a screenshot of them. */
async function contrast(png) {
  const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
  context.drawImage(bitmap, 0, 0);
  const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
  const linear = (code) => (code <= 10 ? code / 3295 : ((code / 255 + 0.055) / 1.055) ** 2.4);
  const lights = Array.from({ length: data.length / 4 }, (_, at) => {
    const [red, green, blue] = data.subarray(4 * at, 4 * at + 3);
    return 0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue);
  });
  lights.sort((one, other) => one - other);
  return (lights.at(-1) + 0.05) / (lights[0] + 0.05);
}

for (const scheme of ['light', 'dark']) {
  test(`a wrong address is said once, in words that can be read, in the ${scheme} theme`, async () => {
    for (const [address, colour] of [['/none.gss', null], ['/none/', [0, 0, 0]], ['/none/', [1, 1, 1]]]) {
      const page = await browser.newPage({ viewport: SIZE, colorScheme: scheme });
      await page.goto(server.url);
      const failures = await page.evaluate(async ([src, background]) => {
        globalThis.player = document.createElement('splat-player');
        const heard = [];
        player.addEventListener('failed', ({ detail }) => heard.push(detail.message));
        player.setAttribute('src', src);
        document.body.append(player);
        player.backgroundColour = background;
        await new Promise((resolve) => setTimeout(resolve, 1500));
        return heard;
      }, [address, colour]);
      assert.deepEqual(failures.map((message) => /404/.test(message)), [true]);
      const said = page.locator('#said');
      assert.match(await said.innerText(), /cannot be played.*404/);
      const png = await said.screenshot({ path: at(`failed-${scheme}.png`) });
      assert.ok((await page.evaluate(contrast, png.toString('base64'))) > 7);
      await page.screenshot({ path: at(`failed-page-${scheme}${colour ? colour[0] : ''}.png`) });
      await page.close();
    }
  });
}

test('it plays, loops, and keys work', async () => {
  const page = await player({ size: { width: 160, height: 90 } });
  await page.evaluate(() => {
    window.seen = [];
    player.addEventListener('frame', ({ detail }) => seen.push(detail.index));
    player.play();
  });
  await page.waitForFunction(() => seen.some((index, place) => place > 0 && index < seen[place - 1]), null, { timeout: 120_000 });
  await page.locator('splat-player').locator('canvas').focus();
  await page.keyboard.press('Space');
  assert.equal(await page.evaluate(() => player.isPlaying), false);
  await page.keyboard.press('Home');
  await page.waitForFunction(() => player.frame.index === 0);
  await page.keyboard.press('Period');
  await page.waitForFunction(() => player.frame.index === 1);
  await page.finish();
});

test('on a telephone all keys are in the bar, and Tab visits them in the order in which they stand', async () => {
  for (const [width, height] of [[390, 844], [360, 640], [320, 568]]) {
    const page = await player({ size: { width, height }, scheme: 'light' });
    await page.evaluate(() => player.press('quality'));
    const inside = await page.evaluate(() => {
      const box = (element) => element.getBoundingClientRect();
      const bar = box(player.shadowRoot.getElementById('bar'));
      const keys = [...player.shadowRoot.querySelectorAll('.keys > *')].map(box).filter((key) => key.width > 0);
      return keys.every((key) => key.left >= bar.left && key.right <= bar.right) && bar.left >= 0 && bar.right <= innerWidth;
    });
    assert.ok(inside, `at ${width} pixels`);
    const visited = [];
    for (let count = 0; count < 11; count++) {
      await page.keyboard.press('Tab');
      visited.push(await page.evaluate(() => {
        const element = player.shadowRoot.activeElement;
        return element.id || element.getAttribute('aria-label');
      }));
    }
    const axes = ['Detail layer', 'Frame rate', 'Refinement'];
    const info = width > 380 ? ['info'] : [];
    assert.deepEqual(visited, ['canvas', 'place', 'play', 'speed', 'quality', 'compare', ...info, 'home', 'full', ...axes].slice(0, 11));
    await page.keyboard.press('Escape');
    assert.deepEqual(await page.evaluate(() => [player.shadowRoot.getElementById('side').hidden, player.shadowRoot.activeElement.id]), [true, 'quality']);
    await page.finish();
  }
});

test('a page that the command has written plays from a file and asks nobody for anything', async () => {
  splatstream('view', streamPath, '-o', at('page.html'));
  const page = await browser.openPage('about:blank', { viewport: SIZE });
  const asked = [];
  page.on('request', (request) => asked.push(request.url()));
  const url = pathToFileURL(at('page.html')).href;
  await page.goto(url);
  const first = page.locator('splat-player');
  await first.waitFor({ timeout: 60_000 });
  await page.waitForFunction(() => document.querySelector('splat-player').frame, null, { timeout: 60_000 });
  const digest = await first.evaluate(async (element) => {
    element.pause();
    return (await element.seek(9)).digest;
  });
  assert.equal(digest, nativeDigests(POINTS[2])[9]);
  assert.deepEqual(asked.filter((other) => other !== url && !other.startsWith('blob:') && !other.startsWith('data:')), []);
  await page.finish();
});

test('four moments are drawn', async () => {
  const moments = [
    ['dark.png', { size: { width: 1280, height: 720 } }, []],
    ['light-compare.png', { size: { width: 1280, height: 720 }, scheme: 'light' }, ['compare']],
    ['phone.png', { size: { width: 390, height: 844 } }, ['quality']],
    ['figures.png', { size: { width: 1280, height: 720 }, scheme: 'light' }, ['info']],
  ];
  for (const [name, options, keys] of moments) {
    const page = await player(options);
    for (const key of keys) await page.evaluate((id) => player.press(id), key);
    await page.evaluate(() => player.seek(12));
    await page.waitForTimeout(1500);
    const picture = await page.screenshot({ path: at(name), timeout: 120_000 });
    assert.ok(picture.length > 20_000, `${name} is empty`);
    await page.finish();
  }
});
