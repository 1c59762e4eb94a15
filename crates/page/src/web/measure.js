/** The straight distance between two places on the body that are clicked: taxels, or points of its surface. */

import { cssColour, Observed } from "./dom.js";
import { subtract } from "./math.js";
import { taxelInWorld } from "./places.js";

/** @typedef {import("./math.js").Vec3} Vec3 */
/** A place that stays where it is on the body when that moves.
 * @typedef {{taxel: number} | {corners: number[], weights: Vec3}} Place */

/**
 * Millimetres with two digits after the point below 10 mm, else with one.
 * @param {number} metres
 */
export function distanceText(metres) {
  const mm = metres * 1e3;
  return `${mm < 10 ? mm.toFixed(2) : mm.toFixed(1)} mm`;
}

export class Measure extends Observed {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./pick.js").Picker} picker
   */
  constructor(model, picker) {
    super();
    this.model = model;
    this.picker = picker;
    this.isOn = false;
    /** At most two. @type {Place[]} */
    this.places = [];
    model.on("scene", () => this.end());
  }

  toggle() {
    this.isOn = !this.isOn;
    this.places = [];
    this.tell("measure");
  }

  end() {
    if (this.isOn) this.toggle();
  }

  /**
   * Takes a place; a third one begins anew.
   * @param {number} x
   * @param {number} y
   * @param {boolean} through also taxels that the body hides
   */
  click(x, y, through) {
    const taxel = this.picker.taxelAt(x, y, through);
    const place = taxel === null ? this.picker.surfaceAt(x, y) : { taxel };
    if (!place) return;
    this.places = this.places.length === 1 ? [...this.places, place] : [place];
    this.tell("measure");
  }

  /** @param {Place} place */
  pointOf(place) {
    if ("taxel" in place) return taxelInWorld(this.model, place.taxel)?.point ?? null;
    return this.picker.pointAt(place.corners, place.weights);
  }

  /** Metres, or null before there are two places. */
  get distance() {
    const [a, b] = this.places.map((place) => this.pointOf(place));
    return a && b ? Math.hypot(...subtract(a, b)) : null;
  }

  /** What is to be done next, or what was measured. */
  get text() {
    if (!this.isOn) return "";
    const { distance, places } = this;
    if (distance === null)
      return places.length
        ? `From ${this.nameOf(places[0])}: click the other end.`
        : "Distance: click two places.";
    return `${places.map((place) => this.nameOf(place)).join(" to ")}: ${distanceText(distance)}`;
  }

  /** @param {Place} place */
  nameOf(place) {
    return "taxel" in place ? `taxel ${this.model.mesh?.taxelId[place.taxel]}` : "the surface";
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {import("./percepts.js").Marks} marks
   */
  draw(context, marks) {
    const flat = this.places.map((place) => marks.camera.project(this.pointOf(place) ?? [0, 0, 0]));
    if (flat.some(({ depth }) => depth <= 0)) return;
    const colour = cssColour("measure");
    if (flat.length > 1) marks.line(context, flat, colour, 2, [7, 4]);
    for (const at of flat) marks.dot(context, at, 3.6, colour);
    const { distance } = this;
    if (distance === null) return;
    const middle = { x: (flat[0].x + flat[1].x) / 2, y: (flat[0].y + flat[1].y) / 2 };
    marks.label(context, middle, distanceText(distance), colour, []);
  }
}
