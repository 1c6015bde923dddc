// Gaussians in the textures, as `wasm/src/texels.rs` of the repository writes them.

/** Words of a texel, and texels of a Gaussian: in the base texture, and in that of spherical harmonics by their degree. */
export const TEXEL = 4;
export const BASE_TEXELS = 2;
export const SH_TEXELS = [0, 2, 3, 6];

const BASE_WORDS = BASE_TEXELS * TEXEL;

/** The number that a binary16 is, from the low half of a word. */
function half(bits) {
  const [sign, exponent, fraction] = [bits & 0x8000 ? -1 : 1, (bits >> 10) & 31, bits & 1023];
  return sign * (exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15));
}

/** A quaternion w, x, y, z of its largest component's number and the three others. */
function quaternion(largest, parts) {
  const rest = Math.sqrt(Math.max(0, 1 - parts.reduce((sum, part) => sum + part * part, 0)));
  return [...parts.slice(0, largest), rest, ...parts.slice(largest)];
}

/** The Gaussian in a slot of the words of a base texture. */
export function gaussian(words, slot) {
  const [x, y, z, low, high, pair, last, light] = words.subarray(slot * BASE_WORDS, (slot + 1) * BASE_WORDS);
  const parts = [(pair & 32767) / 32767, ((pair >>> 15) & 32767) / 32767, (last & 65535) / 65535];
  return {
    position: [...new Float32Array(Uint32Array.of(x, y, z).buffer)],
    scale: [low & 65535, low >>> 16, high & 65535].map((code) => Math.exp(code / 1024 - 32)),
    opacity: (high >>> 16) / 65535,
    rotation: quaternion(pair >>> 30, parts.map((part) => (2 * part - 1) * Math.SQRT1_2)),
    colour: [last >>> 16, light & 65535, light >>> 16].map(half),
  };
}
