/** A body without a source: its taxels, their spacing, and what is odd about its layout. */

import { byId, make, setText } from "./dom.js";
import { table } from "./inspect.js";
import { withUnit } from "./format.js";

/** Taxels whose nearest neighbour is looked for, at most: more say nothing new. */
const SAMPLES = 800;
/** Distances that are measured for it at most, as the first picture waits meanwhile. */
const DISTANCES_MAX = 1e7;

export class RestPanel {
  /** @param {import("./model.js").Model} model */
  constructor(model) {
    this.model = model;
    this.panel = byId("rest-panel", HTMLElement);
    this.body = byId("rest", HTMLElement);
    this.count = byId("rest-count", HTMLElement);
    /** The body whose spacings are known. @type {import("./wire.js").Mesh | null} */
    this.mesh = null;
    this.spacing = [NaN];
    model.on("frame events", () => this.update());
  }

  update() {
    const { model } = this;
    const { mesh, welcome, isAtRest } = model;
    this.panel.hidden = !isAtRest;
    document.documentElement.classList.toggle("rest", isAtRest);
    if (!isAtRest || !mesh || !welcome) return;
    if (this.mesh !== mesh) {
      this.mesh = mesh;
      this.spacing = spacings(mesh);
    }
    const { spacing } = this;
    const middle = spacing[Math.floor(spacing.length / 2)];
    setText(this.count, `${mesh.taxelId.length} taxels`);
    const rows = [
      ["links", String(welcome.links.length)],
      ["fields", String(new Set(welcome.fields.map((field) => field.name)).size)],
      ["spacing", `median ${withUnit(middle, "m", "")}, least ${withUnit(spacing[0], "m", "")}`],
    ];
    const findings = model.events.filter((event) => event.kind === "notice").map((event) => event.text);
    if (!findings.length) findings.push("Looking for defects of the layout …");
    this.body.replaceChildren(table(rows), ...findings.map((finding) => make("p", "finding", finding)));
  }
}

/**
 * Distances from taxels to the nearest other of the same link, the least first, m.
 * @param {import("./wire.js").Mesh} mesh
 */
export function spacings({ taxelPosition: at, taxelLink: link }) {
  const count = link.length;
  const step = Math.max(1, Math.ceil(count / SAMPLES), Math.ceil(count ** 2 / DISTANCES_MAX));
  /** @type {number[]} */
  const found = [];
  for (let i = 0; i < count; i += step) {
    const [x, y, z] = [at[3 * i], at[3 * i + 1], at[3 * i + 2]];
    let least = Infinity;
    for (let k = 0; k < count; k++) {
      if (k === i || link[k] !== link[i]) continue;
      const dx = x - at[3 * k];
      const dy = y - at[3 * k + 1];
      const dz = z - at[3 * k + 2];
      const squared = dx * dx + dy * dy + dz * dz;
      // Taxels at one place are one sensor to look at.
      if (squared > 1e-18 && squared < least) least = squared;
    }
    if (least < Infinity) found.push(Math.sqrt(least));
  }
  return found.sort((a, b) => a - b);
}
