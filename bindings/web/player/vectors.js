// Vectors of three numbers, as arrays.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(...a);

/** The unit vector along `a`; `otherwise` where `a` has no direction. */
export function normalize(a, otherwise = [0, 0, 1]) {
  const size = length(a);
  return size > 0 ? scale(a, 1 / size) : otherwise;
}

/** The columns of the matrix of a quaternion w, x, y, z of any length. */
export function columns([w, x, y, z]) {
  const two = 2 / (w * w + x * x + y * y + z * z || 1);
  return [
    [1 - two * (y * y + z * z), two * (x * y + w * z), two * (x * z - w * y)],
    [two * (x * y - w * z), 1 - two * (x * x + z * z), two * (y * z + w * x)],
    [two * (x * z + w * y), two * (y * z - w * x), 1 - two * (x * x + y * y)],
  ];
}
