/** The touches of the body: a list, the oldest first. A click chooses one and tells more of it, a second one looks at it. */

import { byId, make, paletteColour, setText } from "./dom.js";
import { ABSENT, seconds, short, vectorWithUnit, withUnit } from "./format.js";
import { table } from "./inspect.js";
import { NO_LINK } from "./wire.js";

/** @typedef {import("./wire.js").Touch} Touch */
/** @typedef {{row: HTMLElement, link: HTMLElement, load: HTMLElement, age: HTMLElement, fields: HTMLElement, more: HTMLElement,
 *   key: string}} Row */

/** Fields of a touch that are listed. */
const FIELDS_MAX = 4;

export class TouchPanel {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./choices.js").Choices} choices
   * @param {(touch: Touch) => void} lookAt
   */
  constructor(model, choices, lookAt) {
    this.model = model;
    this.choices = choices;
    this.lookAt = lookAt;
    this.panel = byId("touches-panel", HTMLElement);
    this.list = byId("touches", HTMLElement);
    this.count = byId("touch-count", HTMLElement);
    this.nothing = make("p", "note", "Nothing touches the body.");
    /** @type {Map<number, Row>} */
    this.rows = new Map();
    choices.on("touch", () => this.update());
  }

  /** Touches of the newest frame. */
  update() {
    const { model } = this;
    this.panel.hidden = !model.welcome?.touches;
    if (this.panel.hidden) return;
    const { touches } = model;
    setText(this.count, String(touches.length));
    const present = new Set(touches.map((touch) => touch.id));
    for (const [id, { row }] of this.rows)
      if (!present.has(id)) {
        row.remove();
        this.rows.delete(id);
      }
    for (const touch of touches) {
      let entry = this.rows.get(touch.id);
      if (!entry) {
        entry = this.row(touch.id);
        this.rows.set(touch.id, entry);
      }
      this.show(touch, entry);
    }
    // In the order of the touches, also where a seek brought older ones later.
    touches.forEach((touch, i) => {
      const row = this.rows.get(touch.id)?.row;
      if (row && this.list.children[i] !== row) this.list.insertBefore(row, this.list.children[i] ?? null);
    });
    if (touches.length) this.nothing.remove();
    else this.list.append(this.nothing);
  }

  /**
   * @param {number} id
   * @returns {Row}
   */
  row(id) {
    const row = make("div", "touch");
    const dot = make("i");
    dot.style.background = paletteColour(this.model.touchColour(id));
    const [link, load, age] = ["touch-link", "touch-load", "touch-age"].map((name) => make("span", name));
    const [fields, more] = ["touch-fields", "touch-more"].map((name) => make("div", name));
    row.append(dot, make("b", "", `#${id}`), link, load, age, fields, more);
    row.addEventListener("click", () => {
      const touch = this.model.touch(id);
      if (this.choices.touch === id && touch) this.lookAt(touch);
      else this.choices.chooseTouch(id);
    });
    return { row, link, load, age, fields, more, key: "" };
  }

  /**
   * @param {Touch} touch
   * @param {Row} entry
   */
  show(touch, entry) {
    const { model, choices } = this;
    const isChosen = choices.touch === touch.id;
    entry.row.classList.toggle("chosen", isChosen);
    setText(entry.link, this.linkName(touch.link));
    setText(entry.load, model.touchLoadText(touch));
    setText(entry.age, seconds(touch.age));
    this.showFields(touch, entry);
    entry.more.hidden = !isChosen;
    if (isChosen) entry.more.replaceChildren(table(this.details(touch)));
  }

  /** @param {number} link */
  linkName(link) {
    return link === NO_LINK ? "world" : (this.model.welcome?.links[link]?.name ?? "");
  }

  /**
   * The smallest fields that hold parts of a touch, each with its share.
   * @param {Touch} touch
   * @param {Row} entry
   */
  showFields(touch, entry) {
    const about = this.model.welcome?.fields ?? [];
    const above = new Set(touch.fields.map(({ index }) => about[index]?.parent));
    const smallest = touch.fields.filter(({ index }) => !above.has(index));
    smallest.sort((a, b) => b.share - a.share);
    const listed = smallest.slice(0, FIELDS_MAX);
    const key = listed.map(({ index, share }) => `${index}:${percent(share)}`).join();
    if (key === entry.key && entry.fields.childElementCount) return;
    entry.key = key;
    const buttons = listed.map(({ index, share }) => {
      const button = make("button", "touch-field", `${about[index]?.label ?? ""} ${percent(share)}`);
      button.title = "Choose this field";
      button.addEventListener("click", (event) => {
        this.choices.choose(index);
        event.stopPropagation();
      });
      return button;
    });
    const rest = smallest.length - listed.length;
    entry.fields.replaceChildren(...buttons);
    if (!smallest.length) entry.fields.append("in no field");
    else if (rest) entry.fields.append(`and ${rest} more`);
  }

  /**
   * What else is known of a touch.
   * @param {Touch} touch
   */
  details(touch) {
    const { model } = this;
    const { quantity } = model;
    const told = (/** @type {number[]} */ value, /** @type {string} */ unit) =>
      value.some(Number.isNaN) ? ABSENT : vectorWithUnit(value, unit, quantity);
    const from = touch.frame === NO_LINK ? (model.welcome?.origin ?? [0, 0, 0]) : [0, 0, 0];
    const where = (/** @type {number[]} */ place) =>
      `${told(
        place.map((x, i) => x + from[i]),
        "m",
      )} in ${this.linkName(touch.frame)}`;
    const rows = [
      ...(touch.place.some(Number.isNaN) ? [] : [["place", where(touch.place)]]),
      ...(touch.placeSigma.some(Number.isNaN) ? [] : [["σ of the place", told(touch.placeSigma, "m")]]),
      ["position", where(touch.position)],
      ["normal", direction(touch.normal)],
      ["axis", direction(touch.axis)],
      ["spread", told(touch.spread, "m")],
      ["anisotropy", short(touch.anisotropy)],
      ["velocity", told(touch.velocity, "m/s")],
      ["peak", withUnit(touch.peak, "P", quantity)],
      ["taxels", String(touch.active)],
    ];
    if (touch.links.length > 1)
      rows.push([
        "links",
        touch.links.map(({ index, share }) => `${this.linkName(index)} ${percent(share)}`).join(", "),
      ]);
    const flags = model.touchFlags(touch);
    if (flags.length) rows.push(["flags", flags.map((flag) => flag.replaceAll("_", " ")).join(", ")]);
    return rows;
  }
}

/** @param {number} share */
function percent(share) {
  return `${Math.round(100 * share)} %`;
}

/**
 * The components of a unit vector.
 * @param {number[]} vector
 */
function direction(vector) {
  if (vector.some(Number.isNaN)) return ABSENT;
  return vector.map((x) => x.toFixed(3).replace(/^-(0\.000)$/, "$1")).join(", ");
}
