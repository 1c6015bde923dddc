// Serves the packages and some streams to a browser on this machine.
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const ROOT = fileURLToPath(new URL('..', import.meta.url));
const TYPES = { '.js': 'text/javascript', '.wasm': 'application/wasm', '.html': 'text/html', '.gss': 'application/octet-stream' };

const PAGE = `<!doctype html><meta charset="utf-8"><title>Test</title><meta name="viewport" content="width=device-width">
<link rel="icon" href="data:,"><style>html, body { margin: 0; height: 100% } splat-player { height: 100% }</style>
<script type="importmap">{ "imports": { "@splatstream/decoder": "/decoder/index.js" } }</script>
<script type="module" src="/player/index.js"></script>`;

/** Starts a server; `files` are other files by their path. Gives its address and what ends it. */
export async function serve(files = {}) {
  const server = createServer(async (request, response) => {
    const { pathname } = new URL(request.url, 'http://localhost');
    try {
      const body = pathname === '/' ? PAGE : files[pathname] ?? (await readFile(join(ROOT, normalize(pathname))));
      response.writeHead(200, { 'content-type': TYPES[extname(pathname)] ?? 'text/html', 'content-length': Buffer.byteLength(body) });
      response.end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { url: `http://127.0.0.1:${server.address().port}/`, close: () => server.close() };
}
