// Has other people's players read the MPDs of packages: mpd-parser in Node, dash.js and Shaka Player in a browser. They must
// find what is there, and find that they cannot play it: a description that is malformed would be another error.
// Usage: node players.mjs FOLDER_OF_PACKAGES CHROMIUM DIRECTORY...
import assert from "node:assert/strict";
import fs from "node:fs";
import http from "node:http";
import path from "node:path";
import { createRequire } from "node:module";

const [modules, chromium, ...directories] = process.argv.slice(2);
const require = createRequire(path.resolve(modules, "x.js"));
const { chromium: browserType } = require("playwright-core");
const mpdParser = require("mpd-parser");

// Errors of Shaka Player (shaka.util.Error.Code): nothing of it can be played, whatever the description says.
const UNPLAYABLE = [4004, 4011, 4032];

const scripts = {
  "/dash.js": path.resolve(modules, "dashjs/dist/modern/umd/dash.all.min.js"),
  "/shaka.js": path.resolve(modules, "shaka-player/dist/shaka-player.compiled.js"),
};

function serve() {
  const server = http.createServer((request, response) => {
    const { pathname } = new URL(request.url, "http://localhost");
    const [, index, name] = pathname.split("/");
    const file = scripts[pathname] ?? (directories[index] && name && path.join(directories[index], path.basename(name)));
    if (pathname === "/") {
      response.setHeader("Content-Type", "text/html");
      response.end('<!doctype html><script src="/dash.js"></script><script src="/shaka.js"></script><video></video>');
    } else if (file && fs.existsSync(file)) {
      response.end(fs.readFileSync(file));
    } else {
      response.writeHead(404).end();
    }
  });
  return new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(server)));
}

// What the package says of itself.
function expected(directory) {
  const manifest = JSON.parse(fs.readFileSync(path.join(directory, "manifest.json"), "utf8"));
  return manifest.representations.map(({ id, depends_on, bandwidth }) => ({ id, depends_on, bandwidth }));
}

function checkMpdParser(directory, representations) {
  const text = fs.readFileSync(path.join(directory, "manifest.mpd"), "utf8");
  const manifestUri = "https://example.com/manifest.mpd";
  const warnings = [];
  const parsed = mpdParser.parse(text, { manifestUri, eventHandler: (event) => warnings.push(event) });
  assert.deepEqual(warnings, [], `${directory}: mpd-parser warns`);
  assert.ok(parsed.duration > 0, `${directory}: mpd-parser finds no duration`);
  const { representationInfo } = mpdParser.inheritAttributes(mpdParser.stringToMpdXml(text), { manifestUri });
  const found = representationInfo.map(({ attributes: { id, dependencyId, bandwidth } }) => ({
    id,
    depends_on: dependencyId ? dependencyId.split(" ") : [],
    bandwidth,
  }));
  assert.deepEqual(found, representations, `${directory}: mpd-parser`);
}

// Runs in the page: what dash.js makes of an MPD.
function withDashJs(url) {
  return new Promise((resolve, reject) => {
    const player = dashjs.MediaPlayer().create();
    player.initialize();
    player.retrieveManifest(url, (manifest, error) => {
      if (!manifest) return reject(new Error(JSON.stringify(error)));
      const sets = manifest.Period.flatMap((period) => period.AdaptationSet);
      resolve(
        sets.flatMap((set) =>
          set.Representation.map(({ id, dependencyId, bandwidth }) => ({
            id,
            depends_on: dependencyId ? String(dependencyId).split(" ") : [],
            bandwidth,
          })),
        ),
      );
    });
  });
}

// Runs in the page: the code of the error that Shaka Player ends with, 0 if it plays.
async function withShaka(url) {
  shaka.polyfill.installAll();
  const player = new shaka.Player();
  await player.attach(document.querySelector("video"));
  try {
    await player.load(url);
    return 0;
  } catch (error) {
    return error.code;
  }
}

const server = await serve();
const origin = `http://127.0.0.1:${server.address().port}`;
const options = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"];
const browser = await browserType.launch({ executablePath: chromium, args: options });
try {
  const page = await browser.newPage();
  await page.goto(`${origin}/`);
  for (const [index, directory] of directories.entries()) {
    const representations = expected(directory);
    checkMpdParser(directory, representations);
    const url = `${origin}/${index}/manifest.mpd`;
    assert.deepEqual(await page.evaluate(withDashJs, url), representations, `${directory}: dash.js`);
    const code = await page.evaluate(withShaka, url);
    assert.ok(UNPLAYABLE.includes(code), `${directory}: Shaka Player ends with error ${code}`);
    console.log(`${directory}: ${representations.length} Representations read by mpd-parser and dash.js, refused by Shaka Player with ${code}`);
  }
} finally {
  await browser.close();
  server.close();
}
