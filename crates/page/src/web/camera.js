/** Where the picture is taken from: an orbit around a target. The world is z up, x forward, y left. */

import { add, cross, dot, multiply, perspective, scale, subtract, unit } from "./math.js";

/** @typedef {import("./math.js").Vec3} Vec3 */

const HALF_PI = Math.PI / 2;
const TAN_HALF_Y = Math.tan((32 / 2) * (Math.PI / 180));

/** Directions from the target to the eye: yaw, pitch. */
export const PRESETS = {
  front: [0, 0],
  back: [Math.PI, 0],
  left: [HALF_PI, 0],
  right: [-HALF_PI, 0],
  top: [0, HALF_PI],
  bottom: [0, -HALF_PI],
};

/** @typedef {keyof typeof PRESETS} Preset */

/**
 * The unit vector from the target to the eye.
 * @param {number} yaw
 * @param {number} pitch
 * @returns {Vec3}
 */
function towards(yaw, pitch) {
  return [Math.cos(yaw) * Math.cos(pitch), Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch)];
}

export class Camera {
  constructor() {
    /** @type {Vec3} */
    this.target = [0, 0, 0];
    this.distance = 1;
    /** From the front, +x, towards the left, +y, rad. */
    this.yaw = 0.6;
    /** Up from the horizon, rad. */
    this.pitch = 0.35;
    this.width = 1;
    this.height = 1;
    /** Radius of the body, which sets the planes of depth. */
    this.radius = 1;
    /** Counts changes. */
    this.version = 0;
    /** Unit vectors of the view in the world; `back` points at the eye. */
    this.back = /** @type {Vec3} */ ([1, 0, 0]);
    this.right = /** @type {Vec3} */ ([0, 1, 0]);
    this.up = /** @type {Vec3} */ ([0, 0, 1]);
    this.eye = /** @type {Vec3} */ ([1, 0, 0]);
    this.clipFromWorld = new Float32Array(16);
    /** Planes of depth, m from the eye. */
    this.near = 0.1;
    this.far = 10;
    this.update();
  }

  /** Recomputes matrices from the fields above. */
  update() {
    this.back = towards(this.yaw, this.pitch);
    this.right = /** @type {Vec3} */ ([-Math.sin(this.yaw), Math.cos(this.yaw), 0]);
    this.up = cross(this.back, this.right);
    this.eye = add(this.target, scale(this.back, this.distance));
    this.near = Math.max(this.distance - 2.5 * this.radius, this.distance * 0.02, this.radius * 1e-3);
    this.far = this.distance + 4 * this.radius;
    const view = new Float32Array(16);
    [this.right, this.up, this.back].forEach((axis, row) => {
      for (let k = 0; k < 3; k++) view[4 * k + row] = axis[k];
      view[12 + row] = -dot(axis, this.eye);
    });
    view[15] = 1;
    this.clipFromWorld = multiply(
      perspective(TAN_HALF_Y, this.width / this.height, this.near, this.far),
      view,
    );
    this.version++;
  }

  /**
   * @param {number} width CSS pixels
   * @param {number} height
   */
  resize(width, height) {
    if (width === this.width && height === this.height) return;
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
    this.update();
  }

  /**
   * @param {number} yaw rad
   * @param {number} pitch rad
   */
  orbit(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-HALF_PI, Math.min(HALF_PI, this.pitch + pitch));
    this.update();
  }

  /** Metres that one pixel covers at the target. */
  get metresPerPixel() {
    return (2 * TAN_HALF_Y * this.distance) / this.height;
  }

  /**
   * @param {number} dx pixels to the right
   * @param {number} dy pixels down
   */
  pan(dx, dy) {
    const s = this.metresPerPixel;
    this.target = add(this.target, add(scale(this.right, -dx * s), scale(this.up, dy * s)));
    this.update();
  }

  /**
   * Comes nearer by `factor` while the point under the pointer stays where it is.
   * @param {number} factor
   * @param {number} [x] CSS pixels from the left
   * @param {number} [y]
   */
  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const before = this.metresPerPixel;
    const least = this.radius * 0.02;
    this.distance = Math.max(least, Math.min(this.radius * 40, this.distance / factor));
    const gain = before - this.metresPerPixel;
    const [dx, dy] = [x - this.width / 2, y - this.height / 2];
    this.target = add(this.target, add(scale(this.right, dx * gain), scale(this.up, -dy * gain)));
    this.update();
  }

  /** @param {Preset} name */
  preset(name) {
    [this.yaw, this.pitch] = PRESETS[name];
    this.update();
  }

  /**
   * Takes in all of `points` from the present direction.
   * @param {Vec3[]} points
   * @param {number} margin part of the picture that stays free around them
   */
  frame(points, margin = 0.07) {
    if (!points.length) return;
    const tanY = TAN_HALF_Y * (1 - 2 * margin);
    const tanX = tanY * (this.width / this.height);
    // In the view's axes, a point at (x, y, z) lies within the picture of an eye at (0, 0, d) where |x| ≤ tan (d − z).
    const local = points.map((p) => [dot(p, this.right), dot(p, this.up), dot(p, this.back)]);
    const side = (/** @type {number} */ axis, /** @type {number} */ tan) => {
      let [most, least] = [-Infinity, Infinity];
      for (const p of local) {
        most = Math.max(most, p[axis] + tan * p[2]);
        least = Math.min(least, p[axis] - tan * p[2]);
      }
      return { centre: (most + least) / 2, depth: (most - least) / (2 * tan) };
    };
    const [x, y] = [side(0, tanX), side(1, tanY)];
    const nearest = local.reduce((most, p) => Math.max(most, p[2]), -Infinity);
    const farthest = local.reduce((least, p) => Math.min(least, p[2]), Infinity);
    const middle = (nearest + farthest) / 2;
    const eye = Math.max(x.depth, y.depth, nearest + this.radius * 0.02);
    this.distance = Math.max(eye - middle, this.radius * 0.02);
    this.target = add(add(scale(this.right, x.centre), scale(this.up, y.centre)), scale(this.back, middle));
    this.update();
  }

  /**
   * Where a point of the world is in the picture, CSS pixels; `depth` is its distance along the line of sight.
   * @param {ArrayLike<number>} p
   */
  project(p) {
    const m = this.clipFromWorld;
    const w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
    const x = (m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12]) / w;
    const y = (m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13]) / w;
    return { x: ((x + 1) / 2) * this.width, y: ((1 - y) / 2) * this.height, depth: w };
  }

  /** CSS pixels that one metre covers at a depth. @param {number} depth */
  pixelsPerMetre(depth) {
    return this.height / (2 * TAN_HALF_Y * depth);
  }

  /**
   * The unit vector of sight through a pixel.
   * @param {number} x
   * @param {number} y
   */
  ray(x, y) {
    const tx = ((2 * x) / this.width - 1) * TAN_HALF_Y * (this.width / this.height);
    const ty = (1 - (2 * y) / this.height) * TAN_HALF_Y;
    return unit(subtract(add(scale(this.right, tx), scale(this.up, ty)), this.back));
  }
}

/**
 * Chooses the direction that shows most of the skin, from a few that suit a first picture.
 * @param {Camera} camera
 * @param {Vec3[]} normals of taxels in the world
 * @param {number[]} areas
 */
export function chooseDirection(camera, normals, areas) {
  let best = -Infinity;
  let choice = [0.6, 0.3];
  for (const [yaw, pitch, liking] of [
    [0.5, 0.2, 1.3],
    [-0.5, 0.2, 1.25],
    [0.45, 0.95, 1],
    [0.45, -0.95, 0.95],
    [Math.PI - 0.5, 0.2, 0.9],
  ]) {
    const back = towards(yaw, pitch);
    let seen = 0;
    normals.forEach((normal, i) => (seen += areas[i] * Math.max(0, dot(normal, back))));
    if (seen * liking > best) [best, choice] = [seen * liking, [yaw, pitch]];
  }
  [camera.yaw, camera.pitch] = choice;
  camera.update();
}
