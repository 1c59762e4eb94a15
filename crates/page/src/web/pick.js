/** What is under the pointer, by rays on the processor. */

import { add, cross, dot, scale, subtract, toWorld } from "./math.js";
import { taxelInWorld } from "./places.js";
import { CONE } from "./taxels.js";

/** @typedef {import("./math.js").Vec3} Vec3 */

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
    const at = this.vertices;
    for (let t = 0; t < corners.length; t += 3) {
      const [a, b, c] = [3 * corners[t], 3 * corners[t + 1], 3 * corners[t + 2]];
      const [ax, ay, az] = [at[a], at[a + 1], at[a + 2]];
      const [ux, uy, uz] = [at[b] - ax, at[b + 1] - ay, at[b + 2] - az];
      const [vx, vy, vz] = [at[c] - ax, at[c + 1] - ay, at[c + 2] - az];
      const [px, py, pz] = [way[1] * vz - way[2] * vy, way[2] * vx - way[0] * vz, way[0] * vy - way[1] * vx];
      const det = ux * px + uy * py + uz * pz;
      if (Math.abs(det) < 1e-24) continue;
      const [sx, sy, sz] = [eye[0] - ax, eye[1] - ay, eye[2] - az];
      const u = (sx * px + sy * py + sz * pz) / det;
      if (u < 0 || u > 1) continue;
      const [qx, qy, qz] = [sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux];
      const v = (way[0] * qx + way[1] * qy + way[2] * qz) / det;
      if (v < 0 || u + v > 1) continue;
      const s = (vx * qx + vy * qy + vz * qz) / det;
      if (s > 0 && s < end) return true;
    }
    return false;
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
