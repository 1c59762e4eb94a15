/** Where the discs of taxels are in the picture. */

/** How far a disc and its ring reach past its radius: a part of it, and pixels. */
const RIM_PART = 1.15;
const RING_PX = 7;

/** Middles and reaches of discs, pixels of the picture from its top left. What is not drawn reaches nowhere. */
export class Spots {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./camera.js").Camera} camera
   */
  constructor(model, camera) {
    this.model = model;
    this.camera = camera;
    this.x = new Float32Array(0);
    this.y = new Float32Array(0);
    /** 0 where a disc is not drawn: it looks away, or lies behind the eye. */
    this.reach = new Float32Array(0);
    /** What they are of. */
    this.view = "";
    /** @type {import("./wire.js").Mesh | null} */
    this.mesh = null;
  }

  /**
   * Takes the newest view.
   * @param {number} scale pixels of the picture in a CSS pixel
   * @param {boolean} bothSides whether discs that look away are drawn, too
   */
  update(scale, bothSides) {
    const { model, camera } = this;
    const { mesh, rows } = model;
    const view = [camera.version, model.poseVersion, scale, bothSides].join();
    if (!mesh || (this.mesh === mesh && this.view === view)) return;
    const count = mesh.taxelId.length;
    if (this.mesh !== mesh) [this.x, this.y, this.reach] = [0, 1, 2].map(() => new Float32Array(count));
    [this.mesh, this.view] = [mesh, view];
    // Written out, without the vectors of math.js: there may be many taxels, and this is for every drawing in motion.
    const { taxelLink, taxelPosition: at, taxelNormal: to, taxelRadius } = mesh;
    const { clipFromWorld: m, width, height } = camera;
    const [ex, ey, ez] = camera.eye;
    const pixels = camera.pixelsPerMetre(1) * scale * RIM_PART;
    for (let i = 0; i < count; i++) {
      let [x, y, z] = [at[3 * i], at[3 * i + 1], at[3 * i + 2]];
      let [nx, ny, nz] = [to[3 * i], to[3 * i + 1], to[3 * i + 2]];
      const o = 12 * taxelLink[i];
      if (o + 12 <= rows.length) {
        [x, y, z] = [
          rows[o] * x + rows[o + 1] * y + rows[o + 2] * z + rows[o + 3],
          rows[o + 4] * x + rows[o + 5] * y + rows[o + 6] * z + rows[o + 7],
          rows[o + 8] * x + rows[o + 9] * y + rows[o + 10] * z + rows[o + 11],
        ];
        [nx, ny, nz] = [
          rows[o] * nx + rows[o + 1] * ny + rows[o + 2] * nz,
          rows[o + 4] * nx + rows[o + 5] * ny + rows[o + 6] * nz,
          rows[o + 8] * nx + rows[o + 9] * ny + rows[o + 10] * nz,
        ];
      }
      const depth = m[3] * x + m[7] * y + m[11] * z + m[15];
      const faces = nx * (ex - x) + ny * (ey - y) + nz * (ez - z) >= 0;
      if (depth <= 0 || !(bothSides || faces)) {
        this.reach[i] = 0;
        continue;
      }
      const right = (m[0] * x + m[4] * y + m[8] * z + m[12]) / depth;
      const up = (m[1] * x + m[5] * y + m[9] * z + m[13]) / depth;
      this.x[i] = ((right + 1) / 2) * width * scale;
      this.y[i] = ((1 - up) / 2) * height * scale;
      this.reach[i] = (taxelRadius[i] * pixels) / depth + RING_PX;
    }
  }

  /**
   * The part of the picture that a disc and its ring cover.
   * @param {number} taxel
   * @returns {import("./dirty.js").Rect}
   */
  rectOf(taxel) {
    const [x, y, reach] = [this.x[taxel], this.y[taxel], this.reach[taxel]];
    return { x0: x - reach, y0: y - reach, x1: x + reach, y1: y + reach };
  }

  /**
   * Whether a disc is drawn and lies in a part of the picture.
   * @param {number} taxel
   * @param {import("./dirty.js").Rect} rect
   */
  isIn(taxel, { x0, y0, x1, y1 }) {
    const [x, y, reach] = [this.x[taxel], this.y[taxel], this.reach[taxel]];
    return reach > 0 && x + reach > x0 && x - reach < x1 && y + reach > y0 && y - reach < y1;
  }
}
