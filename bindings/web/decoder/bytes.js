// What counts as bytes.

/** The bytes of an ArrayBuffer or of any view of one, without a copy. Throws a TypeError that names what is given otherwise. */
export function bytesOf(given) {
  if (ArrayBuffer.isView(given)) return new Uint8Array(given.buffer, given.byteOffset, given.byteLength);
  // By its name, since that of another window is no instance of ours.
  const type = Object.prototype.toString.call(given).slice(8, -1);
  if (type === 'ArrayBuffer' || type === 'SharedArrayBuffer') return new Uint8Array(given);
  const advice = type === 'Blob' || type === 'File' ? ': give await blob.arrayBuffer()' : '';
  throw new TypeError(`bytes are an ArrayBuffer or a view of one, not ${type}${advice}`);
}
