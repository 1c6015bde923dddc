// Serves the packages, other folders and some streams to a browser on this machine.
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const ROOT = fileURLToPath(new URL('..', import.meta.url));
const TYPES = {
  '.js': 'text/javascript', '.mjs': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml', '.png': 'image/png',
  '.webp': 'image/webp', '.wasm': 'application/wasm', '.html': 'text/html', '.gss': 'application/octet-stream',
};

const PAGE = `<!doctype html><meta charset="utf-8"><title>Test</title><meta name="viewport" content="width=device-width">
<link rel="icon" href="data:,"><style>html, body { margin: 0; height: 100% } splat-player { height: 100% }</style>
<script type="importmap">{ "imports": { "@splatstream/decoder": "/decoder/index.js" } }</script>
<script type="module" src="/player/index.js"></script>`;

/** The file that a path means: in a folder that is mounted at its beginning, or else in that of the packages. */
function fileOf(path, folders) {
  const mounted = Object.keys(folders).find((start) => path.startsWith(start));
  return mounted ? join(folders[mounted], path.slice(mounted.length)) : join(ROOT, path);
}

/** Starts a server; `files` are files by their path, `folders` folders by the beginning of it. Gives its address and what ends it. */
export async function serve(files = {}, folders = {}) {
  const all = { '/': PAGE, ...files };
  const server = createServer(async (request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    const whole = path.endsWith('/') && !(path in all) ? `${path}index.html` : path;
    try {
      const body = all[whole] ?? (await readFile(fileOf(whole, folders)));
      response.writeHead(200, { 'content-type': TYPES[extname(whole)] ?? 'text/html', 'content-length': Buffer.byteLength(body) });
      response.end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { url: `http://127.0.0.1:${server.address().port}/`, close: () => server.close() };
}
