// The programs of the GPU: Gaussians to ellipses as `render/` of the repository draws them.

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

const int ROW = 512;
const int ORDER_ROW = 1024;
const int BATCH = 128;
const float LOW_PASS = 0.3;
const float SQRT_HALF = 0.70710678;

int slot;

uvec4 texel(usampler2D from, int number, int perGaussian) {
  return texelFetch(from, ivec2((slot % ROW) * perGaussian + number, slot / ROW), 0);
}

vec4 quaternion(uint pair, uint last) {
  vec3 parts = vec3(float(pair & 32767u) / 32767.0, float(pair >> 15 & 32767u) / 32767.0, float(last) / 65535.0);
  parts = (2.0 * parts - 1.0) * SQRT_HALF;
  float rest = sqrt(max(0.0, 1.0 - dot(parts, parts)));
  uint largest = pair >> 30;
  if (largest == 0u) return vec4(rest, parts);
  if (largest == 1u) return vec4(parts.x, rest, parts.yz);
  if (largest == 2u) return vec4(parts.xy, rest, parts.z);
  return vec4(parts, rest);
}

mat3 semiAxes(vec4 q, vec3 scale) {
  float w = q.x, x = q.y, y = q.z, z = q.w;
  return mat3(
    vec3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)) * scale.x,
    vec3(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)) * scale.y,
    vec3(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)) * scale.z);
}

/** Coefficient \`number\` of the harmonics of the slot: its three values in the order of the halves of the words. */
vec3 coefficient(int number, int perGaussian) {
  vec3 value;
  for (int channel = 0; channel < 3; channel++) {
    int which = 3 * number + channel;
    uint word = texel(harmonics, which / 8, perGaussian)[which / 2 % 4];
    vec2 both = unpackHalf2x16(word);
    value[channel] = which % 2 == 0 ? both.x : both.y;
  }
  return value;
}

vec3 harmonicColour(vec3 direction) {
  int perGaussian = shDegree == 1 ? 2 : shDegree == 2 ? 3 : 6;
  float x = direction.x, y = direction.y, z = direction.z;
  float xx = x * x, yy = y * y, zz = z * z;
  vec3 sum = 0.48860251 * (-y * coefficient(0, perGaussian) + z * coefficient(1, perGaussian) - x * coefficient(2, perGaussian));
  if (shDegree < 2) return sum;
  sum += 1.09254843 * (x * y * coefficient(3, perGaussian) - y * z * coefficient(4, perGaussian) - x * z * coefficient(6, perGaussian))
    + 0.31539157 * (2.0 * zz - xx - yy) * coefficient(5, perGaussian) + 0.54627422 * (xx - yy) * coefficient(7, perGaussian);
  if (shDegree < 3) return sum;
  return sum - 0.59004359 * y * (3.0 * xx - yy) * coefficient(8, perGaussian) + 2.89061144 * x * y * z * coefficient(9, perGaussian)
    - 0.45704580 * y * (4.0 * zz - xx - yy) * coefficient(10, perGaussian)
    + 0.37317633 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy) * coefficient(11, perGaussian)
    - 0.45704580 * x * (4.0 * zz - xx - yy) * coefficient(12, perGaussian)
    + 1.44530572 * z * (xx - yy) * coefficient(13, perGaussian) - 0.59004359 * x * (xx - 3.0 * yy) * coefficient(14, perGaussian);
}

void main() {
  gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
  int rank = gl_InstanceID * BATCH + gl_VertexID / 4;
  if (rank >= count) return;
  slot = int(texelFetch(order, ivec2(rank % ORDER_ROW, rank / ORDER_ROW), 0).x);
  uvec4 low = texel(base, 0, 2);
  uvec4 high = texel(base, 1, 2);
  vec3 away = uintBitsToFloat(low.xyz) - position;
  vec3 at = away * axes;
  float opacity = float(high.x >> 16) / 65535.0;
  if (at.z < near || opacity == 0.0) return;

  // The Jacobian is not followed beyond the picture and 15 % on either side.
  vec2 bound = 0.65 * size / focal;
  vec2 slope = clamp(at.xy / at.z, -bound, bound);
  vec3 across = (axes[0] - axes[2] * slope.x) * (focal.x / at.z);
  vec3 down = (axes[1] - axes[2] * slope.y) * (focal.y / at.z);
  vec3 scale = exp(vec3(low.w & 65535u, low.w >> 16, high.x & 65535u) / 1024.0 - 32.0);
  mat3 own = semiAxes(quaternion(high.y, high.z & 65535u), scale);
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

  vec3 light = vec3(unpackHalf2x16(high.z).y, unpackHalf2x16(high.w));
  if (shDegree > 0) light += harmonicColour(normalize(away));
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
