// Packages in Chromium, from `splatstream serve` over good and bad networks: node --test packages.test.mjs, with the variables
// of browser.test.mjs.
import assert from 'node:assert/strict';
import { cpSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import test, { after, afterEach, before } from 'node:test';
import { pathToFileURL } from 'node:url';
import { FRAMES, broadcast, broadcastPath, digestsAt, files, manifestAt, packageFolder, pause } from './package.mjs';
import { serve } from './server.mjs';
import { serving } from './serving.mjs';
import { at } from './setting.mjs';

const { chromium } = await import(pathToFileURL(join(process.env.PLAYWRIGHT, 'index.mjs')));
const FLAGS = ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update',
  '--disable-sync', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];
const SIZE = { width: 320, height: 180 };
let browser, pages;
const servers = [];

before(async () => {
  browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: FLAGS });
  const media = Object.fromEntries([...files].map(([name, bytes]) => [`/talk/${name}`, bytes]));
  pages = await serve(media);
});

afterEach(() => servers.splice(0).forEach((server) => server.kill()));

after(async () => {
  await browser?.close();
  pages?.close();
});

/** The address of a folder, which the command serves with some options until the test ends. */
async function addressOf(folder, ...options) {
  const { server, address } = await serving(folder, ...options);
  servers.push(server);
  return address;
}

/** A package in which a frame lasts so many milliseconds, served by the command with some options: its address. */
async function served(milliseconds = 40, ...options) {
  const folder = at(`package-${milliseconds}`);
  rmSync(folder, { recursive: true, force: true });
  cpSync(packageFolder, folder, { recursive: true });
  writeFileSync(join(folder, 'manifest.json'), JSON.stringify(manifestAt(milliseconds)));
  return addressOf(folder, ...options);
}

/** A page with a player of a package; `frames` collects what is shown. */
async function player(src, attributes = {}) {
  const page = await browser.newPage({ viewport: SIZE });
  const said = [];
  page.on('pageerror', (error) => said.push(error.stack));
  await page.goto(pages.url);
  await page.evaluate(({ all }) => new Promise((resolve, reject) => {
    const element = document.createElement('splat-player');
    for (const [name, value] of Object.entries(all)) element.setAttribute(name, value);
    window.frames_ = [];
    window.longest = 0;
    new PerformanceObserver((list) => list.getEntries().forEach(({ duration }) => (longest = Math.max(longest, duration)))).observe({ type: 'longtask' });
    element.addEventListener('frame', ({ detail: { index, point, digest, until } }) => frames_.push({ index, point, digest, until }));
    element.addEventListener('ready', resolve);
    element.addEventListener('failed', ({ detail }) => reject(new Error(detail.message)));
    document.body.append(element);
    window.player = element;
  }), { all: { src, ...attributes } });
  page.finish = async () => {
    const frames = await page.evaluate(() => frames_);
    await page.close();
    assert.deepEqual(said, []);
    return frames;
  };
  return page;
}

/** Every frame is that of the native decoder at its point. */
async function check(frames, path) {
  assert.ok(frames.length > 0);
  for (const { index, point, digest } of frames) assert.equal(digest, (await digestsAt(point, path)).get(index), `frame ${index}`);
}

const state = (page) => page.evaluate(() => player.statistics.package);

test('a package plays by itself, gets good, and every frame is that of the native decoder', async () => {
  const page = await player(await served());
  await page.waitForFunction((last) => frames_.some(({ index }) => index >= last - 8), FRAMES, { timeout: 120_000 });
  const { quality, stalls, throughput, requests } = await state(page);
  assert.ok(quality >= 49 && throughput > 0 && requests > 0, JSON.stringify({ quality, stalls, throughput, requests }));
  assert.equal(await page.evaluate(() => player.operatingPoint), null);
  await check(await page.finish());
});

test('a network that is slow and loses answers is outlasted without a wrong frame', async () => {
  const trace = at('slow.csv');
  writeFileSync(trace, 't_s,mbps\n0,0.3\n1000,0.3\n');
  const page = await player(await served(125, '--shape', trace, '--latency', '40', '--drop', '0.1'));
  await page.waitForFunction(() => frames_.some(({ index }) => index >= 40), null, { timeout: 120_000 });
  const { throughput } = await state(page);
  assert.ok(throughput > 0 && throughput < 1e6, String(throughput));
  const frames = await page.finish();
  await check(frames);
  assert.ok(frames.some(({ point }) => point.refinement < 2));
});

test('seeks to five places of a package are exact, and what stands still gets better', async () => {
  const page = await player(await served(40, '--latency', '20'), { autoplay: 'no' });
  const wanted = [57, 3, 95, 0, 42];
  for (const index of wanted) {
    await page.evaluate((place) => void player.seek(place), index);
    // The best point of this scene has every second frame.
    const settled = (place) => player.frame.index <= place && place < player.frame.until && player.frame.until <= place + 2 && player.frame.point.refinement === 2;
    await page.waitForFunction(settled, index, { timeout: 60_000 });
  }
  await check(await page.finish());
});

/** What seeks resolve with, one after the other, and how many milliseconds each takes. */
const seeks = (page, indices) => page.evaluate(async (wanted) => {
  const found = [];
  for (const index of wanted) {
    const start = performance.now();
    const { index: shown, until, point, digest } = await player.seek(index);
    found.push({ wanted: index, index: shown, until, point, digest, time: performance.now() - start });
  }
  return found;
}, indices);

const stands = ({ wanted, index, until }) => index <= wanted && wanted < until;

test('a seek resolves with the frame that was asked for, or with what stands for it at the best point', async () => {
  const page = await player(await served(40, '--latency', '20'), { autoplay: 'no' });
  const found = await seeks(page, [12, 61, 3, 95, 0, 42]);
  // The best point of this scene has every second frame. A frame that was asked for may come before it is at its best.
  const isDue = (one) => one.index === one.wanted || one.point.refinement === 2;
  assert.ok(found.every((one) => stands(one) && one.until <= one.index + 2 && isDue(one)), JSON.stringify(found));
  await check(found);
  await check(await page.finish());
});

test('a seek while a package plays resolves soon, and playback goes on', async () => {
  const fast = await player(await served(40));
  const [found] = await seeks(fast, [61]);
  assert.ok(stands(found) && found.until <= 62, JSON.stringify(found));
  await fast.waitForFunction(() => player.isPlaying && player.frame.index >= 66);
  await check(await fast.finish());
  const trace = at('slower.csv');
  writeFileSync(trace, 't_s,mbps\n0,0.2\n1000,0.2\n');
  const slow = await player(await served(125, '--shape', trace));
  const [late] = await seeks(slow, [61]);
  assert.ok(late.index <= 61 && late.time < 8000, JSON.stringify(late));
  await slow.waitForFunction(() => player.isPlaying && player.frame.index >= 64, null, { timeout: 60_000 });
  await check(await slow.finish());
});

test('a seek resolves with what stands for the frame where nothing improves it', async () => {
  const folder = at('package-40');
  const url = await served(40);
  for (const name of files.keys()) if (/^(s1|t\d)\.mp4$/.test(name)) rmSync(join(folder, name));
  const page = await player(url, { autoplay: 'no' });
  const [found] = await seeks(page, [61]);
  assert.ok(stands(found) && found.point.spatial === 0, JSON.stringify(found));
  await check(await page.finish());
});

test('an operating point can be chosen, and left to the network again', async () => {
  const page = await player(await served(40), { 'operating-point': 's1,t1,r2', autoplay: 'no' });
  const exact = await page.evaluate(async (indices) => {
    const found = [];
    for (const index of indices) found.push(await player.seek(index));
    return found.map(({ index, point, digest }) => ({ index, point, digest }));
  }, [57, 3, 95, 0, 42]);
  assert.deepEqual(exact.map(({ index }) => index), [57, 3, 95, 0, 42]);
  assert.ok(exact.every(({ point }) => point.refinement === 2 && point.temporal === 1));
  await check(exact);
  await page.evaluate(() => player.press('quality'));
  await page.locator('#automatic').click();
  assert.equal(await page.evaluate(() => player.operatingPoint), null);
  await page.locator('[data-axis="refinement"]').fill('0');
  assert.equal(await page.evaluate(() => player.operatingPoint.refinement), 0);
  await page.waitForFunction(() => player.frame.point.refinement === 0);
  assert.equal(await page.locator('#automatic').getAttribute('aria-pressed'), 'false');
  await check(await page.finish());
});

test('a package from a server without ranges, in a folder, is shown as it is', async () => {
  const page = await player(`${pages.url}talk/`, { autoplay: 'no' });
  await page.waitForFunction(() => player.frame.point.refinement === 2, null, { timeout: 60_000 });
  await page.evaluate(() => player.press('info'));
  assert.match(await page.locator('#side').innerText(), /Operating point[\s\S]*Network[\s\S]*Buffered[\s\S]*Stalls/);
  await page.screenshot({ path: at('package.png'), timeout: 120_000 });
  await check(await page.finish());
});

test('what is not there is named', async () => {
  const folder = at('package-40');
  const url = await served(40);
  rmSync(join(folder, 's1.mp4'));
  const page = await player(url);
  await page.waitForFunction(() => player.losses.some((line) => line.includes('404')), null, { timeout: 120_000 });
  assert.ok(await page.locator('#lost').isVisible());
  await check(await page.finish());
});

test('the page of serve --player plays the package of its folder', async () => {
  const page = await browser.newPage({ viewport: SIZE });
  const said = [];
  page.on('console', (message) => said.push(message.text()));
  page.on('pageerror', (error) => said.push(error.stack));
  await page.goto(await served(40, '--player'));
  await page.waitForFunction(() => document.querySelector('splat-player')?.frame?.index > 8, null, { timeout: 120_000 });
  assert.ok(await page.evaluate(() => document.querySelector('splat-player').statistics.package.requests > 0));
  await page.close();
  assert.deepEqual(said.filter((line) => !line.includes('favicon')), []);
});

test('a presentation that grows is followed, gone back in and returned to, and is a recording when it has ended', async () => {
  const live = await broadcast(60);
  servers.push({ kill: live.close });
  const address = await addressOf(live.folder);
  await pause(4500);
  const page = await player(address);
  const key = page.locator('#live');
  const isLit = (wanted) => page.waitForFunction((is) => player.shadowRoot.getElementById('live').getAttribute('aria-pressed') === is, String(wanted));
  await isLit(true);
  const [first] = await page.evaluate(() => frames_);
  assert.ok(first.index > 0);
  await page.screenshot({ path: at('live.png'), timeout: 120_000 });
  await page.evaluate(() => void player.seek(0));
  await isLit(false);
  await key.click();
  await isLit(true);
  // Speed and rounds are for what has been recorded.
  assert.ok(await page.locator('#speed').isHidden());
  await key.waitFor({ state: 'hidden', timeout: 60_000 });
  assert.ok(await page.locator('#speed').isVisible());
  await page.waitForFunction((last) => player.frame.index >= last - 8, FRAMES, { timeout: 60_000 });
  await page.waitForFunction((last) => player.frame.index < last - 8 && player.isPlaying, FRAMES, { timeout: 60_000 });
  assert.deepEqual(await page.evaluate(() => player.losses), []);
  await check(await page.finish(), broadcastPath);
});
