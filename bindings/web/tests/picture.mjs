// The moving picture of the README: the player with a moving scene, as an animated WebP. node picture.mjs SCENE.gss OUT.webp,
// with the variables of browser.mjs. Chromium compresses the pictures; this puts them one after the other.
import { readFileSync, writeFileSync } from 'node:fs';
import { launch } from './browser.mjs';
import { serve } from './server.mjs';

const SIZE = { width: 640, height: 400 };
const QUALITY = 0.6;
/** One frame out of so many is in the picture. */
const STRIDE = 2;
/** The camera swings by so many steps of `look` to either side. */
const SWING = 3;

const chunk = (name, bytes) => {
  const head = Buffer.alloc(8);
  head.write(name, 'latin1');
  head.writeUInt32LE(bytes.length, 4);
  return Buffer.concat([head, bytes, Buffer.alloc(bytes.length % 2)]);
};

/** Numbers of so many bytes each, little-endian. */
const numbers = (...pairs) => Buffer.concat(pairs.map(([value, size]) => {
  const bytes = Buffer.alloc(size);
  bytes.writeUIntLE(value, 0, size);
  return bytes;
}));

/** The chunk of the pixels of a WebP picture, which has others beside it or not. */
function pixels(picture) {
  // The first one follows RIFF, its length, and WEBP.
  for (let at = 12; at < picture.length; ) {
    const length = 8 + picture.readUInt32LE(at + 4);
    if (picture.toString('latin1', at, at + 4) === 'VP8 ') return picture.subarray(at, at + length + (length % 2));
    at += length + (length % 2);
  }
  throw new Error('a picture has no pixels');
}

/** An animated WebP of WebP pictures of one size that are shown so many milliseconds each, round and round. */
function animated(pictures, { width, height }, milliseconds) {
  const size = [[width - 1, 3], [height - 1, 3]];
  const frames = pictures.map((picture) => {
    return chunk('ANMF', Buffer.concat([numbers([0, 3], [0, 3], ...size, [milliseconds, 3], [2, 1]), pixels(picture)]));
  });
  const animation = 2;
  const head = [chunk('VP8X', numbers([animation, 4], ...size)), chunk('ANIM', numbers([0xff000000, 4], [0, 2]))];
  return chunk('RIFF', Buffer.concat([Buffer.from('WEBP'), ...head, ...frames]));
}

/** In the page: a PNG as opaque WebP, both in base64. */
async function asWebp({ png, quality }) {
  const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
  canvas.getContext('2d', { alpha: false }).drawImage(bitmap, 0, 0);
  return canvas.toDataURL('image/webp', quality).split(',')[1];
}

/** In the page: shows a frame with the camera turned on by some steps. */
async function show({ index, turn }) {
  player.look(turn, 0);
  await player.seek(index);
  await new Promise((resolve) => setTimeout(resolve, 400));
}

const [scene, out] = process.argv.slice(2);
const server = await serve({ '/scene.gss': readFileSync(scene) });
const browser = await launch();
const page = await browser.openPage(server.url, { viewport: SIZE, colorScheme: 'dark' });
const { frames, frameSeconds } = await page.evaluate(() => new Promise((resolve, reject) => {
  globalThis.player = document.createElement('splat-player');
  for (const [name, value] of [['autoplay', 'no'], ['resolution', 'full'], ['src', '/scene.gss']]) player.setAttribute(name, value);
  player.addEventListener('ready', ({ detail }) => resolve(detail));
  player.addEventListener('failed', ({ detail }) => reject(new Error(detail.message)));
  document.body.append(player);
}));
// Nearer, as somebody would scroll.
await page.mouse.move(SIZE.width / 2, SIZE.height / 2);
for (let step = 0; step < 3; step++) await page.mouse.wheel(0, -120);
const pictures = [];
const place = (index) => SWING * Math.sin((2 * Math.PI * index) / frames);
for (let index = 0; index < frames; index += STRIDE) {
  await page.evaluate(show, { index, turn: place(index) - place(index - STRIDE) });
  const png = (await page.screenshot({ timeout: 120_000 })).toString('base64');
  pictures.push(Buffer.from(await page.evaluate(asWebp, { png, quality: QUALITY }), 'base64'));
}
writeFileSync(out, animated(pictures, SIZE, Math.round(1000 * STRIDE * frameSeconds)));
await page.finish();
await browser.close();
server.close();
