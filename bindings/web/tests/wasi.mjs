// Runs a program that was compiled for wasm32-wasip1: node wasi.mjs PROGRAM [ARGUMENT...]. Cargo starts tests with it.
import { readFileSync } from 'node:fs';
import { WASI } from 'node:wasi';

const args = process.argv.slice(2);
const wasi = new WASI({ version: 'preview1', args });
const { instance } = await WebAssembly.instantiate(readFileSync(args[0]), wasi.getImportObject());
process.exitCode = wasi.start(instance);
