// Starts the player of a page that holds everything: the module and the worker, and the stream or its address.

import '../player/index.js';

const element = (id) => document.getElementById(id);

/** The bytes that an element holds as base64. */
function bytesIn(id) {
  const text = atob(element(id).textContent);
  return Uint8Array.from(text, (character) => character.charCodeAt(0));
}

/** Undoes zlib. */
async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function start() {
  const player = document.createElement('splat-player');
  const worker = URL.createObjectURL(new Blob([element('worker').textContent], { type: 'text/javascript' }));
  // Not as a module: pages that are opened from a file may not start one.
  player.startWorker = () => new Worker(worker);
  player.module = await inflated(bytesIn('module'));
  document.body.append(player);
  const { url } = element('stream').dataset;
  player.open(url ? { url: new URL(url, document.baseURI).href } : { bytes: bytesIn('stream') });
}

start();
