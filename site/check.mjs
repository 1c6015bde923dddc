// Checks the folder that build.sh makes: node check.mjs FOLDER. Links lead somewhere and nothing is loaded from elsewhere; with
// CHROMIUM and PLAYWRIGHT (bindings/web/tools.sh) pages are loaded too, at a path of a server, light and dark.
import assert from 'node:assert/strict';
import { existsSync, mkdirSync, readFileSync, readdirSync } from 'node:fs';
import { dirname, join, relative, resolve } from 'node:path';

const folder = resolve(process.argv[2]);
/** Where the site is served; nothing in it may know that. */
const BASE = '/some/where/';

const pages = readdirSync(folder, { recursive: true }).filter((path) => path.endsWith('.html')).sort();
const text = new Map(pages.map((path) => [path, readFileSync(join(folder, path), 'utf8')]));

/** Values of attributes of a page outside of scripts and of what others wrote as an example: name and value. */
function attributes(page) {
  const visible = page.replace(/<script[^>]*>[\s\S]*?<\/script>/g, (script) => script.slice(0, script.indexOf('>') + 1));
  return [...visible.matchAll(/<(\w+)[^>]*?\s(href|src)="([^"]*)"/g)].map(([, element, name, value]) => ({ element, name, value }));
}

/** Whether something has this id. */
const hasPart = (page, id) => page.includes(`id="${id}"`) || page.includes(`name="${id}"`);

/** What is wrong with a link of a page, or null. */
function fault(path, { element, name, value }) {
  if (value.startsWith('data:') || value.startsWith('mailto:')) return null;
  if (/^(https?:)?\/\//.test(value)) return element === 'a' ? null : `loads ${value}`;
  if (value.startsWith('/')) return `knows where the site is: ${value}`;
  const [file, part] = value.split('#');
  const target = file === '' ? path : relative(folder, join(folder, dirname(path), decodeURIComponent(file.split('?')[0])));
  const there = existsSync(join(folder, target));
  // Made by another step, which needs tools of its own.
  if (!there && target.endsWith('.pdf')) return null;
  if (!there) return `leads nowhere: ${name} ${value}`;
  if (part && text.has(target) && !hasPart(text.get(target), decodeURIComponent(part))) return `has no such part: ${value}`;
  return null;
}

const faults = pages.flatMap((path) => attributes(text.get(path)).map((link) => [path, fault(path, link)])).filter(([, said]) => said);
assert.deepEqual(faults, []);
console.log(`${pages.length} pages: links lead somewhere`);

if (process.env.CHROMIUM) await load();

/** Loads pages in Chromium: nothing goes to the console, nothing is asked for outside, scenes play, pictures stay in $WEB_TESTS. */
async function load() {
  const { launch } = await import('../bindings/web/tests/browser.mjs');
  const { serve } = await import('../bindings/web/tests/server.mjs');
  const pictures = process.env.WEB_TESTS;
  mkdirSync(pictures, { recursive: true });
  const server = await serve({}, { [BASE]: folder });
  const browser = await launch();
  const start = `${server.url.slice(0, -1)}${BASE}`;
  const looked = pages.filter((path) => !path.startsWith('spec/') || /^spec\/(index|05-syntax|rationale)\.html$/.test(path));
  for (const [scheme, viewport] of [['dark', { width: 390, height: 844 }], ['light', { width: 1000, height: 700 }]]) {
    for (const path of scheme === 'light' ? ['index.html', 'conformance/index.html'] : looked) {
      const page = await browser.openPage('about:blank', { viewport, colorScheme: scheme });
      const outside = [];
      page.on('request', (request) => {
        const url = request.url();
        if (!url.startsWith(start) && !url.startsWith('blob:') && !url.startsWith('data:')) outside.push(url);
      });
      await page.goto(start + path);
      if (path.startsWith('scenes/')) {
        await page.waitForFunction(() => document.querySelector('splat-player')?.frame, null, { timeout: 60_000 });
      }
      assert.deepEqual(outside, [], path);
      const isWide = await page.evaluate(() => document.documentElement.scrollWidth > innerWidth + 1);
      assert.ok(!isWide || path.startsWith('spec/'), `${path} is wider than the window`);
      await page.screenshot({ path: join(pictures, `site-${path.replace(/[/.]/g, '-')}-${scheme}.png`), fullPage: path === 'index.html', timeout: 60_000 });
      await page.finish();
    }
  }
  await browser.close();
  server.close();
  console.log(`${looked.length} pages load, light and dark`);
}
