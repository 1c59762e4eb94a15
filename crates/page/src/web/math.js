/** Small vectors and matrices. Matrices are column-major Float32Array(16), as WebGL takes them. */

/** @typedef {[number, number, number]} Vec3 */

/** @type {(a: ArrayLike<number>, b: ArrayLike<number>) => Vec3} */
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** @type {(a: ArrayLike<number>, b: ArrayLike<number>) => Vec3} */
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @type {(a: ArrayLike<number>, s: number) => Vec3} */
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
/** @type {(a: ArrayLike<number>, b: ArrayLike<number>) => number} */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @type {(a: ArrayLike<number>, b: ArrayLike<number>) => Vec3} */
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
/** @type {(a: ArrayLike<number>) => Vec3} */
export const unit = (a) => scale(a, 1 / (Math.hypot(a[0], a[1], a[2]) || 1));

/**
 * The 3×4 matrix of a pose: three rows of four.
 * @param {ArrayLike<number>} poses x, y, z and quaternion x, y, z, w, for each link
 * @param {number} link
 * @param {Float32Array} out
 */
export function poseToRows(poses, link, out) {
  const i = 7 * link;
  const [qx, qy, qz, qw] = [poses[i + 3], poses[i + 4], poses[i + 5], poses[i + 6]];
  const o = 12 * link;
  out[o] = 1 - 2 * (qy * qy + qz * qz);
  out[o + 1] = 2 * (qx * qy - qz * qw);
  out[o + 2] = 2 * (qx * qz + qy * qw);
  out[o + 3] = poses[i];
  out[o + 4] = 2 * (qx * qy + qz * qw);
  out[o + 5] = 1 - 2 * (qx * qx + qz * qz);
  out[o + 6] = 2 * (qy * qz - qx * qw);
  out[o + 7] = poses[i + 1];
  out[o + 8] = 2 * (qx * qz - qy * qw);
  out[o + 9] = 2 * (qy * qz + qx * qw);
  out[o + 10] = 1 - 2 * (qx * qx + qy * qy);
  out[o + 11] = poses[i + 2];
}

/**
 * A point (w = 1) or direction (w = 0) of a link in the world.
 * @param {Float32Array} rows
 * @param {number} link an index past the end stands for the world itself
 * @param {ArrayLike<number>} p
 * @param {number} w
 * @param {number} [at] where in `p` it begins
 * @returns {Vec3}
 */
export function toWorld(rows, link, p, w, at = 0) {
  const o = 12 * link;
  const [x, y, z] = [p[at], p[at + 1], p[at + 2]];
  if (o + 12 > rows.length) return [x, y, z];
  return [
    rows[o] * x + rows[o + 1] * y + rows[o + 2] * z + rows[o + 3] * w,
    rows[o + 4] * x + rows[o + 5] * y + rows[o + 6] * z + rows[o + 7] * w,
    rows[o + 8] * x + rows[o + 9] * y + rows[o + 10] * z + rows[o + 11] * w,
  ];
}

/**
 * A point (w = 1) or direction (w = 0) of the world in the frame of a link: the inverse of `toWorld`.
 * @param {Float32Array} rows
 * @param {number} link
 * @param {ArrayLike<number>} p
 * @param {number} w
 * @returns {Vec3}
 */
export function toLink(rows, link, p, w) {
  const o = 12 * link;
  if (o + 12 > rows.length) return [p[0], p[1], p[2]];
  const [x, y, z] = [p[0] - w * rows[o + 3], p[1] - w * rows[o + 7], p[2] - w * rows[o + 11]];
  return [
    rows[o] * x + rows[o + 4] * y + rows[o + 8] * z,
    rows[o + 1] * x + rows[o + 5] * y + rows[o + 9] * z,
    rows[o + 2] * x + rows[o + 6] * y + rows[o + 10] * z,
  ];
}

/**
 * Clip from view.
 * @param {number} tanHalfY tangent of half the vertical angle of view
 * @param {number} aspect
 * @param {number} near
 * @param {number} far
 */
export function perspective(tanHalfY, aspect, near, far) {
  const out = new Float32Array(16);
  out[0] = 1 / (tanHalfY * aspect);
  out[5] = 1 / tanHalfY;
  out[10] = -(far + near) / (far - near);
  out[11] = -1;
  out[14] = (-2 * far * near) / (far - near);
  return out;
}

/**
 * @param {Float32Array} a
 * @param {Float32Array} b
 */
export function multiply(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  return out;
}
