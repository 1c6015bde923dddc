// The programs of the READMEs in Chromium, as they are written: node --test readme.test.mjs, with the variables of
// browser.test.mjs. Those for engines are pages of their own, in ../examples.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test, { after, before } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch } from './browser.mjs';
import { files as packaged, packageFolder } from './package.mjs';
import { serve } from './server.mjs';
import { FRAMES, stream } from './setting.mjs';

/** The programs of a README in a language. */
function programs(name, language) {
  const text = readFileSync(new URL(`../${name}/README.md`, import.meta.url), 'utf8');
  return [...text.matchAll(new RegExp(`^\`\`\`${language}\n(.*?)^\`\`\``, 'gms'))].map(([, program]) => program);
}

const [decode, work, play] = programs('decoder', 'js');
const [element] = programs('player', 'html');
const [control] = programs('player', 'js');

const HEAD = '<!doctype html><meta charset="utf-8"><title>Test</title><link rel="icon" href="data:,">';
const MAP = '<script type="importmap">{ "imports": { "@splatstream/decoder": "/node_modules/@splatstream/decoder/index.js" } }</script>';
const module = (program) => `${HEAD}${MAP}<script type="module">${program}</script>`;
// What a program expects its reader to have, and what the test looks at.
const PAGES = {
  '/decode.html': module(`${decode} window.decoder = decoder;`),
  '/work.html': module(`${work} worker.addEventListener('frame', ({ detail }) => (window.shown = detail.frame));`),
  '/play.html': module(`import { DecoderWorker } from '@splatstream/decoder';
    const view = { position: [0, 0, -5], ahead: [0, 0, 1] };
    ${play} worker.addEventListener('frame', ({ detail }) => (window.shown = detail.frame));
    worker.addEventListener('package', ({ detail }) => (window.state = detail.state));`),
  '/player.html': HEAD + element,
};
let server, browser;

before(async () => {
  const installed = fileURLToPath(new URL('..', import.meta.url));
  server = await serve({ ...PAGES, '/talk.gss': stream }, { '/node_modules/@splatstream/': installed, '/talk/': packageFolder });
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** A page of them; another machine, example.org, has the stream and the package. */
async function open(name) {
  const page = await browser.openPage('about:blank', { viewport: { width: 480, height: 960 } });
  await page.route('https://example.org/**', (route) => {
    const path = new URL(route.request().url()).pathname;
    const body = path === '/talk.gss' ? stream : packaged.get(path.replace('/talk/', ''));
    const headers = { 'access-control-allow-origin': '*', 'content-type': 'application/octet-stream' };
    return route.fulfill(body ? { body: Buffer.from(body), headers } : { status: 404, headers, body: '' });
  });
  await page.goto(`${server.url}${name}`);
  return page;
}

test('the first program of the decoder takes all frames but those that are left for the end', async () => {
  const page = await open('decode.html');
  await page.waitForFunction(() => window.decoder);
  const left = await page.evaluate(() => {
    let count = 0;
    for (let frame = decoder.next(); !frame.isEnd; frame = decoder.next()) count += 1;
    return count;
  });
  assert.ok(left < FRAMES, `${left} frames are left`);
  await page.finish();
});

test('the worker shows the first frame of a stream', async () => {
  const page = await open('work.html');
  await page.waitForFunction(() => window.shown);
  assert.equal(await page.evaluate(() => shown.index), 0);
  await page.finish();
});

test('the worker shows the first frame of a package, and says how it is played', async () => {
  const page = await open('play.html');
  await page.waitForFunction(() => window.shown && window.state);
  const { index, until, refinement } = await page.evaluate(() => ({ ...shown, refinement: shown.point.refinement }));
  assert.ok(index === 0 && until > 0 && refinement <= 1, JSON.stringify({ index, until, refinement }));
  await page.finish();
});

test('both elements of the player play, and do what a program asks for', async () => {
  const page = await open('player.html');
  await page.waitForFunction(() => [...document.querySelectorAll('splat-player')].filter((player) => player.frame).length === 2);
  const shown = await page.evaluate(async (program) => {
    document.querySelectorAll('splat-player').forEach((player) => player.pause());
    await new (async () => {}).constructor(program)();
    const player = document.querySelector('splat-player');
    for (let wait = 0; wait < 200 && player.frame.index !== 12; wait++) await new Promise((resolve) => setTimeout(resolve, 50));
    return { index: player.frame.index, point: player.operatingPoint };
  }, control);
  assert.deepEqual(shown, { index: 12, point: { spatial: 0, temporal: 1, refinement: 1 } });
  await page.finish();
});
