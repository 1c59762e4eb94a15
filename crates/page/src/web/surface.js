/** Where lines meet the surface of a body whose links move. */

import { LinkTrees } from "./box_tree.js";
import { toWorld } from "./math.js";
import { NO_LINK } from "./wire.js";

/** @typedef {import("./math.js").Vec3} Vec3 */
/** Where a line meets a triangle: its way along the line, and along the triangle's sides.
 * @typedef {{triangle: number, s: number, u: number, v: number}} Hit */

export class Surface {
  /** @param {Pick<import("./wire.js").Mesh, "position" | "link" | "corners">} mesh */
  constructor(mesh) {
    this.mesh = mesh;
    const { position, link, corners } = mesh;
    const count = corners.length / 3;
    const links = new Uint32Array(count);
    /** Triangles over joints, with corners on several links: they alone change their shape as links move. @type {number[]} */
    this.seams = [];
    /** By triangle, its corners in the frame of its link; those of seams in the world. */
    this.places = new Float32Array(9 * count);
    this.boxes = new Float32Array(6 * count);
    for (let triangle = 0; triangle < count; triangle++) {
      for (let k = 0; k < 9; k++)
        this.places[9 * triangle + k] = position[3 * corners[3 * triangle + Math.floor(k / 3)] + (k % 3)];
      this.fillBox(triangle);
      const of = link[corners[3 * triangle]];
      const isOfOne = of === link[corners[3 * triangle + 1]] && of === link[corners[3 * triangle + 2]];
      links[triangle] = isOfOne ? of : NO_LINK;
      if (!isOfOne) this.seams.push(triangle);
    }
    this.trees = new LinkTrees(this.boxes, links);
    /** The one for all: thousands are tried. @type {Hit} */
    this.hit = { triangle: 0, s: 0, u: 0, v: 0 };
  }

  /** @param {number} triangle */
  fillBox(triangle) {
    const { boxes, places } = this;
    for (let k = 0; k < 3; k++) {
      const [a, b, c] = [
        places[9 * triangle + k],
        places[9 * triangle + 3 + k],
        places[9 * triangle + 6 + k],
      ];
      boxes[6 * triangle + k] = Math.min(a, b, c);
      boxes[6 * triangle + 3 + k] = Math.max(a, b, c);
    }
  }

  /**
   * Puts the seams where they are in the world.
   * @param {Float32Array} rows of the links
   */
  pose(rows) {
    const { position, link, corners } = this.mesh;
    for (const triangle of this.seams) {
      for (let k = 0; k < 3; k++) {
        const corner = corners[3 * triangle + k];
        this.places.set(toWorld(rows, link[corner], position, 1, 3 * corner), 9 * triangle + 3 * k);
      }
      this.fillBox(triangle);
    }
    this.trees.trees.get(NO_LINK)?.fit(this.boxes);
  }

  /**
   * Calls `take` where a line meets a triangle, before the line's start too.
   * @param {Float32Array} rows of the links
   * @param {Vec3} from
   * @param {Vec3} way
   * @param {number} until as for `BoxTree.along`
   * @param {(hit: Hit, until: number) => number} take gives where the line ends from now on; a negative number ends the search
   */
  along(rows, from, way, until, take) {
    this.trees.along(rows, from, way, until, (triangle, end, near, there) =>
      this.meets(near, there, triangle) ? take(this.hit, end) : end,
    );
  }

  /**
   * Whether a line in the frame of a triangle's link goes through it; where, is in `hit` then.
   * @param {Vec3} from
   * @param {Vec3} way
   * @param {number} triangle
   */
  meets(from, way, triangle) {
    const { hit, places: at } = this;
    const a = 9 * triangle;
    const [ax, ay, az] = [at[a], at[a + 1], at[a + 2]];
    const [ux, uy, uz] = [at[a + 3] - ax, at[a + 4] - ay, at[a + 5] - az];
    const [vx, vy, vz] = [at[a + 6] - ax, at[a + 7] - ay, at[a + 8] - az];
    const [px, py, pz] = [way[1] * vz - way[2] * vy, way[2] * vx - way[0] * vz, way[0] * vy - way[1] * vx];
    const det = ux * px + uy * py + uz * pz;
    if (Math.abs(det) < 1e-24) return false;
    const [sx, sy, sz] = [from[0] - ax, from[1] - ay, from[2] - az];
    hit.u = (sx * px + sy * py + sz * pz) / det;
    if (hit.u < 0 || hit.u > 1) return false;
    const [qx, qy, qz] = [sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux];
    hit.v = (way[0] * qx + way[1] * qy + way[2] * qz) / det;
    if (hit.v < 0 || hit.u + hit.v > 1) return false;
    hit.s = (vx * qx + vy * qy + vz * qz) / det;
    hit.triangle = triangle;
    return true;
  }
}
