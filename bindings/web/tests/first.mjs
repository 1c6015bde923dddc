// How soon the first picture comes: node first.mjs IN.gss PACKAGE_DIR, with the variables of packages.test.mjs. Prints the
// milliseconds from `open` to the picture with the first frame, of the package from `splatstream serve` and of the stream, on
// pages that are opened for each.
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { serve } from './server.mjs';
import { serving } from './serving.mjs';

const ROUNDS = 9;
const [stream, folder] = process.argv.slice(2);
const { chromium } = await import(pathToFileURL(join(process.env.PLAYWRIGHT, 'index.mjs')));
const args = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];

/** In the page: milliseconds until a frame is drawn. */
async function firstPicture(source) {
  const element = document.createElement('splat-player');
  element.setAttribute('autoplay', 'no');
  document.body.append(element);
  await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve, 200)));
  const start = performance.now();
  element.open(source);
  await new Promise((resolve) => element.addEventListener('frame', resolve, { once: true }));
  return new Promise((resolve) => requestAnimationFrame(() => setTimeout(() => resolve(performance.now() - start))));
}

const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args });
const pages = await serve({ '/scene.gss': readFileSync(stream) });
const { server, address } = await serving(folder);
for (const [name, source] of [['package', { package: address }], ['stream', { url: `${pages.url}scene.gss` }]]) {
  const times = [];
  for (let round = 0; round < ROUNDS; round++) {
    const page = await browser.newPage({ viewport: { width: 320, height: 180 } });
    await page.goto(pages.url);
    await page.evaluate(() => customElements.whenDefined('splat-player'));
    times.push(await page.evaluate(firstPicture, source));
    await page.close();
  }
  times.sort((a, b) => a - b);
  console.log(`${name}: median ${times[ROUNDS >> 1].toFixed(0)} ms, ${times[0].toFixed(0)} to ${times.at(-1).toFixed(0)}`);
}
server.kill();
await browser.close();
pages.close();
