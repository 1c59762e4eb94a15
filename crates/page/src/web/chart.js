/** The flat chart (u, v) of the field that is shown: taxels, centroid, orientation, axis. Like a figure in a paper. */

import { cssColour, fitCanvas, setText } from "./dom.js";
import { tickText, ticks } from "./format.js";
import { axisEllipse, motionArrow, orientationLine } from "./places.js";
import { colourIndex } from "./taxels.js";
import { HEALTH } from "./wire.js";

const EDGE = { left: 34, right: 10, top: 8, bottom: 28 };

export class ChartPanel {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {HTMLElement} note
   * @param {import("./model.js").Model} model
   * @param {import("./choices.js").Choices} choices
   */
  constructor(canvas, note, model, choices) {
    this.canvas = canvas;
    this.note = note;
    this.model = model;
    this.choices = choices;
    /** Where taxels are drawn, to be hovered. @type {{taxel: number, x: number, y: number, radius: number}[]} */
    this.places = [];
    canvas.addEventListener("pointermove", (event) => {
      const near = this.places.find(
        (p) => Math.hypot(event.offsetX - p.x, event.offsetY - p.y) < Math.max(6, p.radius),
      );
      choices.hoveredTaxel = near?.taxel ?? null;
      choices.tell("hover");
    });
    canvas.addEventListener("pointerleave", () => {
      choices.hoveredTaxel = null;
      choices.tell("hover");
    });
  }

  draw() {
    const { model, choices } = this;
    const { welcome, mesh } = model;
    const f = choices.field;
    const field = f === null ? null : welcome?.fields[f];
    this.places = [];
    if (f === null || !field || !mesh || !welcome) {
      this.say("Choose a field to see its chart.");
      return;
    }
    const { chart } = field;
    if (!chart) {
      this.say(`This field has no chart: ${field.no_chart ?? "no reason is known"}.`);
      return;
    }
    this.say("");
    const fitted = fitCanvas(this.canvas);
    if (!fitted) return;
    const { context, width, height } = fitted;
    let [u0, u1, v0, v1] = [Infinity, -Infinity, Infinity, -Infinity];
    field.members.forEach((taxel, i) => {
      const [u, v] = chart.uv[i];
      const r = mesh.taxelRadius[taxel] * 1.4;
      [u0, u1, v0, v1] = [Math.min(u0, u - r), Math.max(u1, u + r), Math.min(v0, v - r), Math.max(v1, v + r)];
    });
    const [wide, high] = [width - EDGE.left - EDGE.right, height - EDGE.top - EDGE.bottom];
    const s = Math.min(wide / (u1 - u0), high / (v1 - v0));
    const x = (/** @type {number} */ u) => EDGE.left + wide / 2 + (u - (u0 + u1) / 2) * s;
    const y = (/** @type {number} */ v) => EDGE.top + high / 2 - (v - (v0 + v1) / 2) * s;
    const at = (/** @type {number[]} */ uv) => ({ x: x(uv[0]), y: y(uv[1]) });
    this.axes(context, width, height, x, y, s);
    field.members.forEach((taxel, i) => {
      const place = at(chart.uv[i]);
      const radius = Math.max(2, mesh.taxelRadius[taxel] * s);
      this.places.push({ taxel, radius, ...place });
      this.disc(context, place, radius, taxel, welcome.colours);
    });
    const centroid = model.value(f, "centroid");
    if (!centroid) return;
    const c = at([centroid[0], centroid[1]]);
    const [ink, halo] = [cssColour("text"), cssColour("halo")];
    const stroke = (
      /** @type {Path2D} */ path,
      /** @type {number} */ w,
      /** @type {number[]} */ dash = [],
    ) => {
      context.setLineDash(dash);
      context.lineWidth = w + 2;
      context.strokeStyle = halo;
      context.stroke(path);
      context.lineWidth = w;
      context.strokeStyle = ink;
      context.stroke(path);
      context.setLineDash([]);
    };
    const ellipse = axisEllipse(model, f);
    if (ellipse) {
      const path = new Path2D();
      path.ellipse(c.x, c.y, ellipse.a * s, ellipse.b * s, -ellipse.angle, 0, 2 * Math.PI);
      const [dx, dy] = [Math.cos(ellipse.angle) * ellipse.a * s, -Math.sin(ellipse.angle) * ellipse.a * s];
      stroke(path, 1.2);
      const axis = new Path2D();
      axis.moveTo(c.x - dx, c.y - dy);
      axis.lineTo(c.x + dx, c.y + dy);
      stroke(axis, 1.2, [3, 3]);
    }
    const line = orientationLine(model, f);
    if (line) {
      const path = new Path2D();
      const [a, b] = line.map(at);
      path.moveTo(a.x, a.y);
      path.lineTo(b.x, b.y);
      stroke(path, 2);
    }
    const arrow = motionArrow(model, f);
    if (arrow && Math.hypot(arrow[0], arrow[1]) * s > 5) {
      const end = { x: c.x + arrow[0] * s, y: c.y - arrow[1] * s };
      const angle = Math.atan2(end.y - c.y, end.x - c.x);
      const path = new Path2D();
      path.moveTo(c.x, c.y);
      path.lineTo(end.x, end.y);
      for (const side of [-2.6, 2.6]) {
        path.moveTo(end.x, end.y);
        path.lineTo(end.x + 6 * Math.cos(angle + side), end.y + 6 * Math.sin(angle + side));
      }
      stroke(path, 1.6);
    }
    const cross = new Path2D();
    for (const [dx, dy] of [
      [5, 0],
      [0, 5],
    ]) {
      cross.moveTo(c.x - dx, c.y - dy);
      cross.lineTo(c.x + dx, c.y + dy);
    }
    stroke(cross, 2);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {number} width
   * @param {number} height
   * @param {(u: number) => number} x
   * @param {(v: number) => number} y
   * @param {number} s pixels per metre
   */
  axes(context, width, height, x, y, s) {
    const inner = { right: width - EDGE.right, bottom: height - EDGE.bottom };
    const from = (/** @type {number} */ px) => ((px - x(0)) / s) * 1e3;
    const us = ticks(from(EDGE.left), from(inner.right), 5);
    const vs = ticks(((y(0) - inner.bottom) / s) * 1e3, ((y(0) - EDGE.top) / s) * 1e3, 4);
    context.font = "10px system-ui, sans-serif";
    context.fillStyle = cssColour("faint");
    context.strokeStyle = cssColour("grid");
    context.lineWidth = 1;
    context.beginPath();
    context.textAlign = "center";
    context.textBaseline = "top";
    for (const u of us) {
      const px = Math.round(x(u / 1e3)) + 0.5;
      context.moveTo(px, EDGE.top);
      context.lineTo(px, inner.bottom);
      context.fillText(tickText(u, us), px, inner.bottom + 4);
    }
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const v of vs) {
      const py = Math.round(y(v / 1e3)) + 0.5;
      context.moveTo(EDGE.left, py);
      context.lineTo(inner.right, py);
      context.fillText(tickText(v, vs), EDGE.left - 5, py);
    }
    context.stroke();
    context.textBaseline = "alphabetic";
    context.fillText("u → and v ↑ in mm", inner.right, height - 2);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {{x: number, y: number}} at
   * @param {number} radius
   * @param {number} taxel
   * @param {number[][]} colours
   */
  disc(context, at, radius, taxel, colours) {
    const { model } = this;
    const p = model.pressure[taxel];
    const state = HEALTH[model.health[taxel]];
    const known = p === p;
    context.beginPath();
    context.arc(at.x, at.y, radius, 0, 2 * Math.PI);
    const atRest = model.colourAtRest(taxel);
    if (atRest) {
      context.fillStyle = `rgb(${atRest.join(" ")})`;
      context.fill();
    } else if (known) {
      context.fillStyle =
        p > 0 ? `rgb(${colours[colourIndex(p, model.scaleMax)].join(" ")})` : cssColour("rest");
      context.fill();
    }
    context.lineWidth = taxel === this.choices.hoveredTaxel ? 2.5 : 1;
    context.strokeStyle = taxel === this.choices.hoveredTaxel ? cssColour("accent") : cssColour("disc-rim");
    if (state === "not sent") {
      context.lineWidth = 1;
    } else if (state !== "good" || !known) {
      context.strokeStyle = cssColour("text");
      context.lineWidth = state === "saturated" ? 2.5 : 1.25;
      if (state === "stale" || state === "out of range") context.setLineDash([2, 2]);
    }
    context.stroke();
    context.setLineDash([]);
    if (state === "faulty" || state === "left out") {
      const r = radius * 0.6;
      context.beginPath();
      context.moveTo(at.x - (state === "faulty" ? r : 0), at.y - r);
      context.lineTo(at.x + (state === "faulty" ? r : 0), at.y + r);
      if (state === "faulty") {
        context.moveTo(at.x - r, at.y + r);
        context.lineTo(at.x + r, at.y - r);
      }
      context.stroke();
    }
  }

  /** @param {string} text */
  say(text) {
    setText(this.note, text);
    this.note.hidden = text === "";
    this.canvas.hidden = text !== "";
  }
}
