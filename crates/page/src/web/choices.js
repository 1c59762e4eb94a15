/** What the user has chosen to see. */

import { Observed, PALETTE } from "./dom.js";

/** What has marks on the body. The first is there where touches are looked for. */
export const MARKS = /** @type {const} */ ([
  "touches",
  "whole fields",
  "smallest fields",
  "chosen field",
  "none",
]);

/** A field is left for another that is pressed so many times as hard. */
const MUCH_HARDER = 4;

export class Choices extends Observed {
  constructor() {
    super();
    const system = matchMedia("(prefers-color-scheme: dark)");
    this.dark = system.matches;
    system.addEventListener("change", () => {
      this.dark = system.matches;
      this.tell("look");
    });
    /** The field that the user has clicked. @type {number | null} */
    this.chosen = null;
    /** The field that is shown while none is chosen: the one with a touch. @type {number | null} */
    this.followed = null;
    /** @type {number | null} */
    this.hoveredField = null;
    /** @type {number | null} */
    this.hoveredTaxel = null;
    /** @type {string | null} */
    this.letter = null;
    /** @type {(typeof MARKS[number])[]} */
    this.offered = [...MARKS];
    /** @type {typeof MARKS[number]} */
    this.marks = "touches";
    /** The touch that the user has clicked, by its id. @type {number | null} */
    this.touch = null;
    /** The body is translucent and hidden taxels show through it. */
    this.xray = false;
    this.body = true;
    this.taxels = true;
    /** Taxels have rings in the colour of their field. */
    this.tint = false;
    this.labels = true;
    /** Taxels show their ids. */
    this.ids = false;
  }

  /** The field whose percept and chart are shown. */
  get field() {
    return this.chosen ?? this.followed;
  }

  /**
   * Another body: nothing of it is chosen yet.
   * @param {boolean} hasTouches whether touches are looked for
   */
  forget(hasTouches) {
    this.offered = hasTouches ? [...MARKS] : MARKS.slice(1);
    this.marks = this.offered[0];
    this.tell("offered");
    this.tell("look");
    this.touch = null;
    this.chosen = this.followed = this.hoveredField = this.hoveredTaxel = null;
    this.tell("field");
  }

  /** @param {number | null} field */
  choose(field) {
    this.chosen = field;
    this.tell("field");
  }

  /**
   * Shows another letter.
   * @param {string | null} letter
   */
  chooseLetter(letter) {
    this.letter = letter;
    this.followed = null;
    this.choose(null);
    this.tell("letter");
    this.tell("look");
  }

  /** @param {number | null} id */
  chooseTouch(id) {
    this.touch = id;
    this.tell("touch");
  }

  /** What has marks next. */
  nextMarks() {
    this.marks = this.offered[(this.offered.indexOf(this.marks) + 1) % this.offered.length];
    this.tell("look");
  }

  /**
   * Whether touches have marks.
   * @param {import("./model.js").Model} model
   */
  showsTouches(model) {
    return this.marks === "touches" && !!model.welcome?.touches;
  }

  /** @param {number | null} field */
  hoverField(field) {
    if (field === this.hoveredField) return;
    this.hoveredField = field;
    this.tell("hover");
  }

  /** @param {"xray" | "body" | "taxels" | "tint" | "labels" | "ids"} name */
  toggle(name) {
    this[name] = !this[name];
    this.tell("look");
  }

  /**
   * Follows the strongest touch, and stays with a field as long as it is touched and none is pressed much harder.
   * @param {import("./model.js").Model} model
   */
  follow(model) {
    const fields = model.welcome?.fields;
    if (!fields || this.chosen !== null) return;
    const stays = this.followed !== null && model.inContact.has(this.followed) ? this.followed : null;
    const touched = [...model.inContact.keys()].filter((field) => fields[field]?.letter === this.letter);
    const whole = touched.filter((field) => this.isWhole(model, field));
    let most = -Infinity;
    let best = this.followed;
    for (const field of whole.length ? whole : touched)
      if (model.strength(field) > most) [most, best] = [model.strength(field), field];
    if (stays !== null && most <= MUCH_HARDER * model.strength(stays)) return;
    if (best === null) best = fields.findIndex((field) => field.chart && field.letter === this.letter);
    if (best === this.followed || best < 0) return;
    this.followed = best;
    this.tell("field");
  }

  /**
   * Whether a field is the largest with a chart among those above it.
   * @param {import("./model.js").Model} model
   * @param {number} index
   */
  isWhole(model, index) {
    const fields = model.welcome?.fields ?? [];
    if (!fields[index]?.chart || fields[index].letter !== this.letter) return false;
    for (let above = fields[index].parent; above !== null; above = fields[above].parent)
      if (fields[above].chart) return false;
    return true;
  }

  /**
   * The fields that touches lie on, those alone that hold no other such field: the hardest pressed first.
   * @param {import("./model.js").Model} model
   */
  smallestTouched(model) {
    const fields = model.welcome?.fields ?? [];
    const touched = [...model.inContact.keys()].filter((f) => fields[f]?.letter === this.letter);
    const above = new Set(touched.map((f) => fields[f].parent));
    const smallest = touched.filter((f) => !above.has(f));
    return smallest.sort((a, b) => model.strength(b) - model.strength(a) || a - b);
  }

  /**
   * The fields in contact that have marks.
   * @param {import("./model.js").Model} model
   */
  marked(model) {
    const fields = model.welcome?.fields ?? [];
    const touched = [...model.inContact.keys()].filter((f) => fields[f]?.letter === this.letter);
    /** @type {Set<number>} */
    const marked = new Set();
    if (this.marks === "whole fields") {
      for (const f of touched) if (this.isWhole(model, f)) marked.add(f);
    } else if (this.marks === "smallest fields") {
      const above = new Set(touched.map((f) => fields[f].parent));
      for (const f of touched) if (fields[f].chart && !above.has(f)) marked.add(f);
    }
    const areOfFields = this.marks !== "none" && this.marks !== "touches";
    if (areOfFields && this.chosen !== null && model.inContact.has(this.chosen)) marked.add(this.chosen);
    return [...marked];
  }

  /**
   * Colours of the rings by taxel: each touch has its own, and so has the field that is chosen or hovered, or all whole fields.
   * @param {import("./model.js").Model} model
   */
  rings(model) {
    const fields = model.welcome?.fields ?? [];
    /** @type {Map<number, number[]>} */
    const rings = new Map();
    if (this.tint) {
      fields.forEach((field, f) => {
        if (!this.isWhole(model, f)) return;
        const colour = PALETTE[model.fieldColour(f) % PALETTE.length];
        for (const taxel of field.members) rings.set(taxel, colour);
      });
    }
    if (this.showsTouches(model))
      for (const touch of model.touches) {
        const colour = PALETTE[model.touchColour(touch.id) % PALETTE.length];
        for (const taxel of touch.taxels) rings.set(taxel, colour);
      }
    const accent = this.dark ? [126, 226, 214] : [0, 104, 96];
    for (const f of [this.chosen, this.hoveredField])
      if (f !== null) for (const taxel of fields[f]?.members ?? []) rings.set(taxel, accent);
    if (this.hoveredTaxel !== null) rings.set(this.hoveredTaxel, this.dark ? [255, 255, 255] : [0, 0, 0]);
    return rings;
  }
}
