/** What the camera looks at: a field, taxels, the whole body, or the side that is touched, until somebody turns the body. */

import { chooseDirection } from "./camera.js";
import { dot, toWorld } from "./math.js";
import { taxelInWorld } from "./places.js";

/** @typedef {import("./math.js").Vec3} Vec3 */

/** @type {Vec3} */
const NO_NORMAL = [0, 0, 0];

export class Aim {
  /**
   * @param {HTMLElement} stage
   * @param {import("./model.js").Model} model
   * @param {import("./camera.js").Camera} camera
   * @param {import("./choices.js").Choices} choices
   * @param {() => void} moved
   */
  constructor(stage, model, camera, choices, moved) {
    this.model = model;
    this.camera = camera;
    this.choices = choices;
    this.moved = moved;
    /** Whether somebody has turned the body: from then on it stays as it is. */
    this.turned = false;
    /** The touch or field whose side was shown last. */
    this.shownSide = "";
    for (const event of ["pointerdown", "wheel"])
      stage.addEventListener(event, () => (this.turned = true), { passive: true });
    // Before the key acts.
    window.addEventListener(
      "keydown",
      (event) => {
        if (/^(Arrow\w+|[0-9f+=-])$/.test(event.key)) this.turned = true;
      },
      { capture: true },
    );
  }

  /** Shows a body for the first time. */
  begin() {
    const { mesh } = this.model;
    if (!mesh) return;
    const normals = Array.from(mesh.taxelId, (_, taxel) => this.normalOf(taxel) ?? [0, 0, 1]);
    const areas = Array.from(mesh.taxelRadius, (r) => r * r);
    chooseDirection(this.camera, /** @type {Vec3[]} */ (normals), areas);
    this.atAll();
  }

  /** @param {number} taxel */
  normalOf(taxel) {
    return taxelInWorld(this.model, taxel)?.normal;
  }

  /** @param {import("./camera.js").Preset} name */
  from(name) {
    this.camera.preset(name);
    this.atAll();
  }

  /** @param {number} field */
  atField(field) {
    this.atTaxels(this.model.welcome?.fields[field]?.members ?? []);
  }

  /** @param {number[]} members taxels */
  atTaxels(members) {
    const { camera, model } = this;
    if (!members.length) return;
    const normals = members.map((taxel) => this.normalOf(taxel) ?? NO_NORMAL);
    const mean = [0, 1, 2].map((k) => normals.reduce((sum, normal) => sum + normal[k], 0) / normals.length);
    // Taxels that look one way are seen from that side; those that go around the body from where we are.
    if (Math.hypot(...mean) > 0.6) {
      camera.yaw = Math.atan2(mean[1], mean[0]) + 0.25;
      camera.pitch = Math.max(-1.3, Math.min(1.3, Math.asin(mean[2] / Math.hypot(...mean)) + 0.2));
      camera.update();
    }
    camera.frame(
      members.map((taxel) => taxelInWorld(model, taxel)?.point ?? camera.target),
      0.24,
    );
    this.moved();
  }

  /** Takes in the whole body. */
  atAll() {
    const { camera, model } = this;
    const { mesh, rows } = model;
    if (!mesh) return;
    const vertices = mesh.link.length;
    const step = Math.max(1, Math.floor(vertices / 3000));
    /** @type {Vec3[]} */
    const points = [];
    for (let i = 0; i < vertices; i += step)
      points.push(toWorld(rows, mesh.link[i], mesh.position, 1, 3 * i));
    if (!points.length)
      for (let i = 0; i < mesh.taxelId.length; i++) points.push(taxelInWorld(model, i)?.point ?? [0, 0, 0]);
    const [low, high] = [0, 1, 2].reduce(
      ([lo, hi], k) => [
        [...lo, points.reduce((m, p) => Math.min(m, p[k]), Infinity)],
        [...hi, points.reduce((m, p) => Math.max(m, p[k]), -Infinity)],
      ],
      /** @type {[number[], number[]]} */ ([[], []]),
    );
    camera.radius = Math.max(1e-3, Math.hypot(...high.map((h, k) => h - low[k])) / 2);
    camera.frame(points, 0.08);
    this.moved();
  }

  /** The taxels of the oldest touch, or where touches are not looked for those of the field that is followed. */
  touched() {
    const { choices, model } = this;
    if (model.welcome?.touches) {
      const [touch] = model.touches;
      return { name: `touch ${touch?.id}`, members: [...(touch?.taxels ?? [])] };
    }
    const { field } = choices;
    const members = field !== null && model.inContact.has(field) ? model.welcome?.fields[field]?.members : [];
    return { name: `field ${field}`, members: members ?? [] };
  }

  /** Turns the body so that the side that is touched is seen, until somebody turns it. */
  showTouchedSide() {
    const { camera, model } = this;
    if (this.turned) return;
    const { name, members } = this.touched();
    if (!members.length || name === this.shownSide) return;
    this.shownSide = name;
    const normals = members.map((taxel) => this.normalOf(taxel) ?? NO_NORMAL);
    const facing = normals.reduce((sum, normal) => sum + dot(normal, camera.back), 0) / normals.length;
    if (facing > 0.2) return;
    chooseDirection(
      camera,
      normals,
      members.map((taxel) => (model.mesh?.taxelRadius[taxel] ?? 0) ** 2),
    );
    this.atAll();
  }
}
