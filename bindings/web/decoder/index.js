export { Decoder, ROW, hasSimd, loadModule } from './decoder.js';
export { DecoderWorker } from './client.js';
