/** What is under the pointer, by rays on the processor. */

import { add, cross, dot, scale, subtract, toWorld } from "./math.js";
import { taxelInWorld } from "./places.js";
import { CONE } from "./taxels.js";

/** @typedef {import("./math.js").Vec3} Vec3 */

/** Where a line met a triangle last: its way along the line, and along the triangle's sides. One for all, as millions are tried. */
const HIT = { s: 0, u: 0, v: 0 };

export class Picker {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./camera.js").Camera} camera
   */
  constructor(model, camera) {
    this.model = model;
    this.camera = camera;
    this.version = -1;
    /** Vertices in the world. */
    this.vertices = new Float32Array(0);
    /** @type {unknown} */
    this.mesh = null;
  }

  /** Vertices in the world, by the newest poses. */
  update() {
    const { mesh, rows, poseVersion } = this.model;
    if (!mesh || (this.mesh === mesh && this.version === poseVersion)) return;
    this.mesh = mesh;
    this.version = poseVersion;
    this.vertices = new Float32Array(mesh.position.length);
    for (let i = 0; i < mesh.link.length; i++)
      this.vertices.set(toWorld(rows, mesh.link[i], mesh.position, 1, 3 * i), 3 * i);
  }

  /**
   * Whether the body stands between the eye and a point, which lies on it.
   * @param {Vec3} point
   * @param {number} slack metres before the point that do not count
   */
  hides(point, slack) {
    this.update();
    const { eye } = this.camera;
    const way = subtract(point, eye);
    const end = 1 - slack / Math.hypot(...way);
    const corners = this.model.mesh?.corners ?? new Uint32Array(0);
    for (let t = 0; t < corners.length; t += 3)
      if (this.meets(eye, way, corners, t) && HIT.s > 0 && HIT.s < end) return true;
    return false;
  }

  /**
   * Whether a line goes through a triangle; where, is in `HIT` then.
   * @param {Vec3} from
   * @param {Vec3} way
   * @param {Uint32Array} corners
   * @param {number} t where the triangle is in these
   */
  meets(from, way, corners, t) {
    const at = this.vertices;
    const [a, b, c] = [3 * corners[t], 3 * corners[t + 1], 3 * corners[t + 2]];
    const [ax, ay, az] = [at[a], at[a + 1], at[a + 2]];
    const [ux, uy, uz] = [at[b] - ax, at[b + 1] - ay, at[b + 2] - az];
    const [vx, vy, vz] = [at[c] - ax, at[c + 1] - ay, at[c + 2] - az];
    const [px, py, pz] = [way[1] * vz - way[2] * vy, way[2] * vx - way[0] * vz, way[0] * vy - way[1] * vx];
    const det = ux * px + uy * py + uz * pz;
    if (Math.abs(det) < 1e-24) return false;
    const [sx, sy, sz] = [from[0] - ax, from[1] - ay, from[2] - az];
    HIT.u = (sx * px + sy * py + sz * pz) / det;
    if (HIT.u < 0 || HIT.u > 1) return false;
    const [qx, qy, qz] = [sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux];
    HIT.v = (way[0] * qx + way[1] * qy + way[2] * qz) / det;
    if (HIT.v < 0 || HIT.u + HIT.v > 1) return false;
    HIT.s = (vx * qx + vy * qy + vz * qz) / det;
    return true;
  }

  /**
   * The nearest point of the surface under a pixel, by the corners of its triangle and their weights; null where there is none.
   * @param {number} x
   * @param {number} y
   * @returns {{corners: number[], weights: Vec3} | null}
   */
  surfaceAt(x, y) {
    this.update();
    const { eye } = this.camera;
    const ray = this.camera.ray(x, y);
    const corners = this.model.mesh?.corners ?? new Uint32Array(0);
    let nearest = Infinity;
    /** @type {{corners: number[], weights: Vec3} | null} */
    let found = null;
    for (let t = 0; t < corners.length; t += 3) {
      if (!this.meets(eye, ray, corners, t) || !(HIT.s > 0 && HIT.s < nearest)) continue;
      nearest = HIT.s;
      found = { corners: [...corners.subarray(t, t + 3)], weights: [1 - HIT.u - HIT.v, HIT.u, HIT.v] };
    }
    return found;
  }

  /**
   * Where a point of the surface is in the world now.
   * @param {number[]} corners
   * @param {Vec3} weights
   */
  pointAt(corners, weights) {
    this.update();
    const at = corners.map(
      (corner) => /** @type {Vec3} */ ([...this.vertices.subarray(3 * corner, 3 * corner + 3)]),
    );
    return at.reduce((sum, point, k) => add(sum, scale(point, weights[k])), /** @type {Vec3} */ ([0, 0, 0]));
  }

  /**
   * Where the middle of a taxel is in the picture, or null where it cannot be seen.
   * @param {number} taxel
   */
  pixelOf(taxel) {
    const place = taxelInWorld(this.model, taxel);
    if (!place) return null;
    const { camera, model } = this;
    const toEye = subtract(camera.eye, place.point);
    const facing = dot(place.normal, toEye) / Math.hypot(...toEye);
    // Nearly from the side a disc is thinner than a pixel.
    if ((model.mesh?.corners.length ? facing : Math.abs(facing)) < 0.15) return null;
    const at = camera.project(place.point);
    if (at.depth <= 0 || at.x < 0 || at.y < 0 || at.x >= camera.width || at.y >= camera.height) return null;
    if (this.isCovered(taxel, place.point, place.radius)) return null;
    return this.hides(place.point, 0.7 * place.radius) ? null : at;
  }

  /**
   * Whether the disc of another taxel is drawn over the middle of this one.
   * @param {number} taxel
   * @param {Vec3} point its middle
   * @param {number} radius
   */
  isCovered(taxel, point, radius) {
    const { model, camera } = this;
    const count = model.mesh?.taxelId.length ?? 0;
    const way = subtract(point, camera.eye);
    const depth = -dot(way, camera.back);
    for (let other = 0; other < count; other++) {
      const place = other === taxel ? null : taxelInWorld(model, other);
      if (!place) continue;
      const reach = 4 * (place.radius + radius);
      const between = subtract(place.point, point);
      if (dot(between, between) > reach * reach) continue;
      // Where the line of sight meets the other disc's plane.
      const s = dot(place.normal, subtract(place.point, camera.eye)) / dot(place.normal, way);
      const off = subtract(add(camera.eye, scale(way, s)), place.point);
      const distance = Math.hypot(...off);
      if (dot(place.normal, way) < 0 && distance < place.radius * 1.05 && s * depth + CONE * distance < depth)
        return true;
    }
    return false;
  }

  /**
   * The taxel under a pixel, or null.
   * @param {number} x
   * @param {number} y
   * @param {boolean} through also those that the body hides
   */
  taxelAt(x, y, through) {
    const { model, camera } = this;
    const count = model.mesh?.taxelId.length ?? 0;
    const ray = camera.ray(x, y);
    /** @type {{taxel: number, depth: number}[]} */
    const found = [];
    for (let taxel = 0; taxel < count; taxel++) {
      const place = taxelInWorld(model, taxel);
      if (!place) continue;
      const toEye = subtract(camera.eye, place.point);
      const facing = dot(place.normal, toEye);
      if (!through && facing <= 0 && model.mesh?.corners.length) continue;
      // Distance of the disc's middle from the ray, in the ray's plane across.
      const off = cross(toEye, ray);
      const depth = -dot(toEye, ray);
      const reach = Math.max(place.radius, 4 / camera.pixelsPerMetre(Math.max(depth, 1e-9)));
      if (depth > 0 && dot(off, off) < reach * reach) found.push({ taxel, depth });
    }
    found.sort((a, b) => a.depth - b.depth);
    for (const { taxel } of found) {
      const place = taxelInWorld(model, taxel);
      if (place && (through || !this.hides(place.point, 0.7 * place.radius))) return taxel;
    }
    return null;
  }
}
