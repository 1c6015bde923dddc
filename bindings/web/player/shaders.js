// The programs of the GPU: Gaussians to ellipses as `render/` of the repository draws them.

/**
 * Functions that read a Gaussian by its slot from the textures, for this renderer and those of other engines:
 * `wasm/src/texels.rs` of the repository says what the words are.
 */
export const SLOTS = `
const int GSS_ROW = 512;

uvec4 gssTexel(highp usampler2D from, int slot, int number, int perGaussian) {
  return texelFetch(from, ivec2((slot % GSS_ROW) * perGaussian + number, slot / GSS_ROW), 0);
}

vec3 gssScale(uvec4 low, uvec4 high) {
  return exp(vec3(low.w & 65535u, low.w >> 16, high.x & 65535u) / 1024.0 - 32.0);
}

float gssOpacity(uvec4 high) {
  return float(high.x >> 16) / 65535.0;
}

// The colour of degree 0.
vec3 gssColour(uvec4 high) {
  return vec3(unpackHalf2x16(high.z).y, unpackHalf2x16(high.w));
}

// A quaternion: w, x, y, z.
vec4 gssRotation(uvec4 high) {
  vec3 parts = vec3(float(high.y & 32767u) / 32767.0, float(high.y >> 15 & 32767u) / 32767.0, float(high.z & 65535u) / 65535.0);
  parts = (2.0 * parts - 1.0) * 0.70710678;
  float rest = sqrt(max(0.0, 1.0 - dot(parts, parts)));
  uint largest = high.y >> 30;
  if (largest == 0u) return vec4(rest, parts);
  if (largest == 1u) return vec4(parts.x, rest, parts.yz);
  if (largest == 2u) return vec4(parts.xy, rest, parts.z);
  return vec4(parts, rest);
}

int gssHarmonicTexels(int degree) {
  return degree == 1 ? 2 : degree == 2 ? 3 : 6;
}

// Coefficient number of the harmonics: its three values in the order of the halves of the words.
vec3 gssCoefficient(highp usampler2D harmonics, int slot, int number, int perGaussian) {
  vec3 value;
  for (int channel = 0; channel < 3; channel++) {
    int which = 3 * number + channel;
    uint word = gssTexel(harmonics, slot, which / 8, perGaussian)[which / 2 % 4];
    vec2 both = unpackHalf2x16(word);
    value[channel] = which % 2 == 0 ? both.x : both.y;
  }
  return value;
}

// What spherical harmonics of degree 1 to 3 add to the colour in a direction from the camera.
vec3 gssHarmonics(highp usampler2D harmonics, int slot, int degree, vec3 direction) {
  int texels = gssHarmonicTexels(degree);
  float x = direction.x, y = direction.y, z = direction.z;
  float xx = x * x, yy = y * y, zz = z * z;
  vec3 c0 = gssCoefficient(harmonics, slot, 0, texels);
  vec3 c1 = gssCoefficient(harmonics, slot, 1, texels);
  vec3 c2 = gssCoefficient(harmonics, slot, 2, texels);
  vec3 sum = 0.48860251 * (-y * c0 + z * c1 - x * c2);
  if (degree < 2) return sum;
  vec3 c3 = gssCoefficient(harmonics, slot, 3, texels);
  vec3 c4 = gssCoefficient(harmonics, slot, 4, texels);
  vec3 c5 = gssCoefficient(harmonics, slot, 5, texels);
  vec3 c6 = gssCoefficient(harmonics, slot, 6, texels);
  vec3 c7 = gssCoefficient(harmonics, slot, 7, texels);
  sum += 1.09254843 * (x * y * c3 - y * z * c4 - x * z * c6) + 0.31539157 * (2.0 * zz - xx - yy) * c5 + 0.54627422 * (xx - yy) * c7;
  if (degree < 3) return sum;
  vec3 c8 = gssCoefficient(harmonics, slot, 8, texels);
  vec3 c9 = gssCoefficient(harmonics, slot, 9, texels);
  vec3 c10 = gssCoefficient(harmonics, slot, 10, texels);
  vec3 c11 = gssCoefficient(harmonics, slot, 11, texels);
  vec3 c12 = gssCoefficient(harmonics, slot, 12, texels);
  vec3 c13 = gssCoefficient(harmonics, slot, 13, texels);
  vec3 c14 = gssCoefficient(harmonics, slot, 14, texels);
  return sum - 0.59004359 * y * (3.0 * xx - yy) * c8 + 2.89061144 * x * y * z * c9 - 0.45704580 * y * (4.0 * zz - xx - yy) * c10
    + 0.37317633 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy) * c11 - 0.45704580 * x * (4.0 * zz - xx - yy) * c12
    + 1.44530572 * z * (xx - yy) * c13 - 0.59004359 * x * (xx - 3.0 * yy) * c14;
}`;

/** Slots to ellipses: a quad for each, which reaches as far as alpha is 1/255. */
export const VERTEX = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;

uniform usampler2D base;
uniform usampler2D harmonics;
uniform usampler2D order;
uniform int count;
uniform int shDegree;
uniform bool isAntialiased;
uniform vec3 position;
uniform mat3 axes;      // columns: right, down and ahead of the camera
uniform vec2 focal;     // pixels
uniform vec2 size;      // pixels
uniform float near;

out vec2 offset;
flat out vec4 colour;

const int ORDER_ROW = 1024;
const int BATCH = 128;
const float LOW_PASS = 0.3;
${SLOTS}

mat3 semiAxes(vec4 q, vec3 scale) {
  float w = q.x, x = q.y, y = q.z, z = q.w;
  return mat3(
    vec3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)) * scale.x,
    vec3(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)) * scale.y,
    vec3(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)) * scale.z);
}

void main() {
  gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
  int rank = gl_InstanceID * BATCH + gl_VertexID / 4;
  if (rank >= count) return;
  int slot = int(texelFetch(order, ivec2(rank % ORDER_ROW, rank / ORDER_ROW), 0).x);
  uvec4 low = gssTexel(base, slot, 0, 2);
  uvec4 high = gssTexel(base, slot, 1, 2);
  vec3 away = uintBitsToFloat(low.xyz) - position;
  vec3 at = away * axes;
  float opacity = gssOpacity(high);
  if (at.z < near || opacity == 0.0) return;

  // The Jacobian is not followed beyond the picture and 15 % on either side.
  vec2 bound = 0.65 * size / focal;
  vec2 slope = clamp(at.xy / at.z, -bound, bound);
  vec3 across = (axes[0] - axes[2] * slope.x) * (focal.x / at.z);
  vec3 down = (axes[1] - axes[2] * slope.y) * (focal.y / at.z);
  mat3 own = semiAxes(gssRotation(high), gssScale(low, high));
  vec3 u = across * own;
  vec3 v = down * own;
  float xy = dot(u, v);
  vec3 crossed = cross(u, v);
  float sharp = dot(crossed, crossed);
  float wide = dot(u, u) + LOW_PASS;
  float tall = dot(v, v) + LOW_PASS;
  float determinant = sharp + LOW_PASS * (wide - LOW_PASS + tall);
  if (isAntialiased) opacity *= sqrt(sharp / determinant);
  float reach = 2.0 * log(255.0 * opacity);
  if (!(reach > 0.0)) return;

  float middle = 0.5 * (wide + tall);
  float apart = length(vec2(0.5 * (wide - tall), xy));
  float most = middle + apart;
  vec2 along = wide >= tall ? vec2(most - tall, xy) : vec2(xy, most - wide);
  along = apart > 1e-6 * middle ? normalize(along) : vec2(1.0, 0.0);
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1 & 1) * 2.0 - 1.0;
  offset = corner * sqrt(reach);
  vec2 centre = focal * (at.xy / at.z) + 0.5 * size;
  vec2 place = centre + along * (sqrt(most) * offset.x) + vec2(-along.y, along.x) * (sqrt(determinant / most) * offset.y);

  vec3 light = gssColour(high);
  if (shDegree > 0) light += gssHarmonics(harmonics, slot, shDegree, normalize(away));
  colour = vec4(max(light, 0.0), opacity);
  gl_Position = vec4(2.0 * place / size - 1.0, 0.0, 1.0) * vec4(1.0, -1.0, 1.0, 1.0);
}`;

/** Alpha at a pixel: at most 0.99, and nothing below 1/255. */
export const FRAGMENT = `#version 300 es
precision highp float;
in vec2 offset;
flat in vec4 colour;
out vec4 shade;

void main() {
  float alpha = min(0.99, colour.a * exp(-0.5 * dot(offset, offset)));
  if (alpha < 1.0 / 255.0) discard;
  shade = vec4(colour.rgb * alpha, alpha);
}`;
