// Chromium for the tests, with the variables CHROMIUM, and PLAYWRIGHT, the folder of playwright-core; cameras; comparing pictures.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const { chromium } = await import(pathToFileURL(join(process.env.PLAYWRIGHT, 'index.mjs')));
const FLAGS = ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update',
  '--disable-sync', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];

/** Starts Chromium; `openPage` gives a page whose `finish` closes it and fails if anything went to the console. */
export async function launch() {
  const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: FLAGS });
  browser.openPage = async (url, options) => {
    const page = await browser.newPage(options);
    const said = [];
    page.on('console', (message) => said.push(message.text()));
    page.on('pageerror', (error) => said.push(error.stack));
    page.finish = async () => {
      await page.close();
      assert.deepEqual(said, []);
    };
    await page.goto(url);
    return page;
  };
  return browser;
}

/** A camera at a place that looks at another one, y downwards. */
export function lookAt(position, target, field) {
  const unit = (vector) => vector.map((part) => part / Math.hypot(...vector));
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const ahead = unit(target.map((part, axis) => part - position[axis]));
  const right = unit(cross([0, 1, 0], ahead));
  return { position, axes: [right, cross(ahead, right), ahead], field };
}

/** PSNR of two PNG files of one size, decibels; a page computes it. */
export async function psnr(page, one, other) {
  const [decibels, mean] = await page.evaluate(compare, [one, other].map((png) => png.toString('base64')));
  assert.ok(mean > 2, 'the picture is empty');
  return decibels;
}

/** In the page: PSNR of two pictures, and the mean of the pixels of the second. */
async function compare(pictures) {
  const pixels = async (png) => {
    const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    context.drawImage(bitmap, 0, 0);
    return context.getImageData(0, 0, bitmap.width, bitmap.height);
  };
  const [shown, wanted] = await Promise.all(pictures.map(pixels));
  if (shown.width !== wanted.width || shown.height !== wanted.height) throw new Error('the pictures have different sizes');
  let squares = 0, sum = 0;
  for (let place = 0; place < wanted.data.length; place++) {
    if (place % 4 === 3) continue;
    squares += (shown.data[place] - wanted.data[place]) ** 2;
    sum += wanted.data[place];
  }
  const count = 0.75 * wanted.data.length;
  return [10 * Math.log10(255 ** 2 / (squares / count)), sum / count];
}
