/** What is under the pointer, by rays on the processor through trees of boxes. */

import { LinkTrees } from "./box_tree.js";
import { add, cross, dot, scale, subtract, toWorld } from "./math.js";
import { taxelInWorld } from "./places.js";
import { Surface } from "./surface.js";
import { CONE, unsentBehind } from "./taxels.js";
import { HEALTH, NO_LINK } from "./wire.js";

/** @typedef {import("./math.js").Vec3} Vec3 */

/** A taxel is found so far from its middle, pixels, where its disc is smaller. */
const REACH_PX = 4;
/** The radius up to which a disc with its rim covers others, of the disc's own. */
const RIM = 1.05;
const NOT_SENT = HEALTH.indexOf("not sent");

export class Picker {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./camera.js").Camera} camera
   */
  constructor(model, camera) {
    this.model = model;
    this.camera = camera;
    this.version = -1;
    /** @type {import("./wire.js").Mesh | null} */
    this.mesh = null;
    this.surface = new Surface({
      position: new Float32Array(0),
      link: new Uint32Array(0),
      corners: new Uint32Array(0),
    });
    this.taxels = new LinkTrees(new Float32Array(0), []);
    this.behind = 0;
  }

  /** Takes the newest body and poses. */
  update() {
    const { mesh, rows, poseVersion } = this.model;
    if (!mesh || (this.mesh === mesh && this.version === poseVersion)) return;
    if (this.mesh !== mesh) {
      this.mesh = mesh;
      this.surface = new Surface(mesh);
      this.taxels = new LinkTrees(discBoxes(mesh), mesh.taxelLink);
      this.behind = unsentBehind(mesh);
    }
    this.version = poseVersion;
    this.surface.pose(rows);
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
    let isHidden = false;
    this.surface.along(this.model.rows, eye, way, end, ({ s }) => {
      isHidden ||= s > 0 && s < end;
      return isHidden ? -1 : end;
    });
    return isHidden;
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
    /** @type {{corners: number[], weights: Vec3} | null} */
    let found = null;
    this.surface.along(this.model.rows, eye, ray, Infinity, ({ triangle, s, u, v }, nearest) => {
      if (!(s > 0 && s < nearest)) return nearest;
      const corners = this.model.mesh?.corners.subarray(3 * triangle, 3 * triangle + 3) ?? [];
      found = { corners: [...corners], weights: [1 - u - v, u, v] };
      return s;
    });
    return found;
  }

  /**
   * Where a point of the surface is in the world now.
   * @param {number[]} corners
   * @param {Vec3} weights
   */
  pointAt(corners, weights) {
    const { mesh, rows } = this.model;
    const at = corners.map((corner) =>
      toWorld(rows, mesh?.link[corner] ?? NO_LINK, mesh?.position ?? [], 1, 3 * corner),
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
   * How far behind others a taxel is drawn, m.
   * @param {number} taxel
   */
  behindOf(taxel) {
    return this.model.health?.[taxel] === NOT_SENT ? this.behind : 0;
  }

  /**
   * Whether the disc of another taxel is drawn over the middle of this one.
   * @param {number} taxel
   * @param {Vec3} point its middle
   * @param {number} radius
   */
  isCovered(taxel, point, radius) {
    this.update();
    const { model, camera } = this;
    const way = subtract(point, camera.eye);
    const depth = -dot(way, camera.back);
    const behind = this.behindOf(taxel);
    let isCovered = false;
    this.taxels.along(model.rows, camera.eye, way, 1, (other, until) => {
      const place = other === taxel ? null : taxelInWorld(model, other);
      if (!place) return until;
      const reach = 4 * (place.radius + radius);
      const between = subtract(place.point, point);
      if (dot(between, between) > reach * reach) return until;
      // Where the line of sight meets the other disc's plane.
      const s = dot(place.normal, subtract(place.point, camera.eye)) / dot(place.normal, way);
      const off = subtract(add(camera.eye, scale(way, s)), place.point);
      const distance = Math.hypot(...off);
      const height = s * depth + CONE * distance + this.behindOf(other);
      isCovered = dot(place.normal, way) < 0 && distance < place.radius * RIM && height < depth + behind;
      return isCovered ? -1 : until;
    });
    return isCovered;
  }

  /**
   * The taxel under a pixel, or null.
   * @param {number} x
   * @param {number} y
   * @param {boolean} through also those that the body hides
   */
  taxelAt(x, y, through) {
    this.update();
    const { model, camera } = this;
    const ray = camera.ray(x, y);
    /** @type {{taxel: number, depth: number}[]} */
    const found = [];
    const look = (/** @type {number} */ taxel, /** @type {number} */ until) => {
      const place = taxelInWorld(model, taxel);
      if (!place) return until;
      const toEye = subtract(camera.eye, place.point);
      const facing = dot(place.normal, toEye);
      if (!through && facing <= 0 && model.mesh?.corners.length) return until;
      // Distance of the disc's middle from the ray, in the ray's plane across.
      const off = cross(toEye, ray);
      const depth = -dot(toEye, ray);
      const reach = Math.max(place.radius, REACH_PX / camera.pixelsPerMetre(Math.max(depth, 1e-9)));
      if (depth > 0 && dot(off, off) < reach * reach)
        found.push({ taxel, depth: depth + this.behindOf(taxel) });
      return until;
    };
    this.taxels.along(model.rows, camera.eye, ray, Infinity, look, REACH_PX / camera.pixelsPerMetre(1));
    found.sort((a, b) => a.depth - b.depth || a.taxel - b.taxel);
    for (const { taxel } of found) {
      const place = taxelInWorld(model, taxel);
      if (place && (through || !this.hides(place.point, 0.7 * place.radius))) return taxel;
    }
    return null;
  }
}

/**
 * Boxes around the discs of taxels with their rims, in the frames of links.
 * @param {import("./wire.js").Mesh} mesh
 */
function discBoxes({ taxelPosition, taxelRadius }) {
  const boxes = new Float32Array(6 * taxelRadius.length);
  taxelRadius.forEach((radius, taxel) => {
    for (let k = 0; k < 3; k++) {
      boxes[6 * taxel + k] = taxelPosition[3 * taxel + k] - RIM * radius;
      boxes[6 * taxel + 3 + k] = taxelPosition[3 * taxel + k] + RIM * radius;
    }
  });
  return boxes;
}
