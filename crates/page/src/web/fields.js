/** The tree of fields: search, loads as bars, a click chooses, a second one looks at the field. */

import { byId, make, paletteColour, setText } from "./dom.js";
import { withUnit } from "./format.js";
import { letterName } from "./senses.js";

/** @typedef {{row: HTMLElement, bar: HTMLElement, dot: HTMLElement, value: HTMLElement, caret: HTMLElement, depth: number, open: boolean,
 *   text: string, width: number, key: string}} Row */

/** Height of a row, pixels, as in panels.css. */
const ROW_PX = 22;

export class Fields {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./choices.js").Choices} choices
   * @param {(field: number) => void} lookAt
   */
  constructor(model, choices, lookAt) {
    this.model = model;
    this.choices = choices;
    this.lookAt = lookAt;
    this.tree = byId("tree", HTMLElement);
    this.search = byId("search", HTMLInputElement);
    this.letters = byId("letters", HTMLElement);
    this.count = byId("field-count", HTMLElement);
    this.onlyTouched = byId("only-touched", HTMLInputElement);
    this.caption = byId("bar-scale", HTMLElement);
    /** @type {Map<number, Row>} */
    this.rows = new Map();
    this.largest = 0;
    /** Rows that are not folded away, in their order. @type {number[]} */
    this.listed = [];
    /** What is in sight of the tree, pixels. To ask it in every frame would cost a layout. */
    this.sight = { top: 0, height: 0 };
    /** The colours that the rows have. */
    this.coloured = { of: model.fieldColours, count: 0 };
    model.on("scene", () => this.build());
    choices.on("letter", () => this.build());
    choices.on("field", () => this.mark());
    this.search.addEventListener("input", () => this.filter());
    this.search.addEventListener("keydown", (event) => {
      if (event.key === "Escape") {
        this.search.value = "";
        this.filter();
        this.search.blur();
      } else if (event.key === "Enter") {
        const first = this.listed[0];
        if (first !== undefined) this.choose(first);
      }
      event.stopPropagation();
    });
    this.onlyTouched.addEventListener("change", () => this.filter());
    this.tree.addEventListener("keydown", (event) => this.key(event));
    this.tree.addEventListener("scroll", () => this.look(), { passive: true });
    new ResizeObserver(() => this.look()).observe(this.tree);
    this.tree.addEventListener("pointerleave", () => choices.hoverField(null));
  }

  build() {
    const fields = this.model.welcome?.fields ?? [];
    const letters = [...new Set(fields.map((field) => field.letter))];
    if (!letters.includes(this.choices.letter)) this.choices.letter = letters[0] ?? null;
    this.model.setLetter(this.choices.letter);
    this.letters.hidden = letters.length < 2;
    this.letters.replaceChildren(
      ...letters.map((letter) => {
        const button = make("button", "", letterName(letter, fields));
        button.setAttribute("aria-pressed", String(letter === this.choices.letter));
        button.addEventListener("click", () => this.choices.chooseLetter(letter));
        return button;
      }),
    );
    this.rows.clear();
    this.coloured.count = -1;
    this.largest = 0;
    setText(this.caption, "");
    const list = document.createDocumentFragment();
    const indices = fields.map((_, i) => i).filter((i) => fields[i].letter === this.choices.letter);
    /** @type {Map<number | null, number[]>} */
    const below = new Map();
    for (const i of indices) below.set(fields[i].parent, [...(below.get(fields[i].parent) ?? []), i]);
    const roots = below.get(null) ?? [];
    const many = indices.length > 40;
    const walk = (/** @type {number} */ i, /** @type {number} */ depth) => {
      const under = below.get(i) ?? [];
      const row = this.row(i, depth, under.length > 0, depth < (many ? 1 : 2));
      list.append(row.row);
      for (const child of under) walk(child, depth + 1);
    };
    for (const i of roots) walk(i, 0);
    this.tree.replaceChildren(list);
    setText(this.count, String(indices.length));
    this.filter();
    this.mark();
  }

  /**
   * @param {number} i
   * @param {number} depth
   * @param {boolean} parent
   * @param {boolean} open
   */
  row(i, depth, parent, open) {
    const field = this.model.welcome?.fields[i];
    const row = make("div", "field");
    row.style.setProperty("--depth", String(depth));
    row.tabIndex = -1;
    row.setAttribute("role", "treeitem");
    row.title = field?.label ?? "";
    const caret = make("span", "caret", parent ? (open ? "▾" : "▸") : "");
    const bar = make("span", "field-bar");
    const value = make("span", "field-value");
    const dot = make("i", "field-dot");
    // The list is of the letter that is chosen above it.
    const name = make("span", "field-name", field?.name ?? "");
    row.append(bar, caret, dot, name, value);
    const entry = {
      row,
      bar,
      dot,
      value,
      caret,
      depth,
      open,
      text: "",
      width: 0,
      key: `${field?.name} ${field?.label}`.toLowerCase(),
    };
    this.rows.set(i, entry);
    caret.addEventListener("click", (event) => {
      this.unfold(i, !entry.open);
      event.stopPropagation();
    });
    row.addEventListener("click", () => this.choose(i));
    row.addEventListener("dblclick", () => this.lookAt(i));
    row.addEventListener("pointerenter", () => this.choices.hoverField(i));
    return entry;
  }

  /** @param {number} i */
  choose(i) {
    if (this.choices.chosen === i) this.lookAt(i);
    else this.choices.choose(i);
  }

  /**
   * @param {number} i
   * @param {boolean} open
   */
  unfold(i, open) {
    const entry = this.rows.get(i);
    if (!entry || !entry.caret.textContent) return;
    entry.open = open;
    setText(entry.caret, open ? "▾" : "▸");
    this.filter();
  }

  /** Shows the rows that match the search, with all that are above them. */
  filter() {
    const fields = this.model.welcome?.fields ?? [];
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const touched = this.onlyTouched.checked;
    /** @type {Set<number>} */
    const shown = new Set();
    for (const [i, entry] of this.rows) {
      if (words.length || touched) {
        const fits = words.every((word) => entry.key.includes(word));
        if (!fits || (touched && !this.model.inContact.has(i))) continue;
        for (let at = /** @type {number | null} */ (i); at !== null; at = fields[at].parent) shown.add(at);
      } else {
        let open = true;
        for (let at = fields[i].parent; at !== null; at = fields[at].parent)
          open &&= !!this.rows.get(at)?.open;
        if (open) shown.add(i);
      }
    }
    this.listed = [];
    for (const [i, entry] of this.rows) {
      entry.row.hidden = !shown.has(i);
      if (!entry.row.hidden) this.listed.push(i);
    }
    this.showLoads();
  }

  /** Takes which rows are in sight. */
  look() {
    this.sight = { top: this.tree.scrollTop, height: this.tree.clientHeight };
    this.showLoads();
  }

  /** Shows which field is chosen. */
  mark() {
    const { chosen, field } = this.choices;
    for (const [i, entry] of this.rows) {
      entry.row.classList.toggle("chosen", i === chosen);
      entry.row.classList.toggle("followed", i === field && chosen === null);
      entry.row.tabIndex = i === chosen || (chosen === null && entry.depth === 0) ? 0 : -1;
    }
    if (field === null) return;
    const fields = this.model.welcome?.fields ?? [];
    for (let at = fields[field]?.parent ?? null; at !== null; at = fields[at].parent) this.unfold(at, true);
    const row = this.rows.get(field)?.row;
    if (chosen !== null) row?.scrollIntoView({ block: "nearest" });
    else if (row && !this.tree.matches(":hover")) {
      // What is followed changes by itself: only the tree scrolls, and nothing under the pointer.
      const top = ROW_PX * this.listed.indexOf(field);
      const { sight } = this;
      if (top < sight.top || top + ROW_PX > sight.top + sight.height)
        this.tree.scrollTop = top - sight.height / 3;
    }
  }

  /** Totals of the newest frame. */
  update() {
    const { model } = this;
    for (const i of model.inContact.keys()) this.largest = Math.max(this.largest, model.load(i));
    if (this.largest > 0)
      setText(this.caption, `full bar: ${withUnit(this.largest, model.loadUnit, model.quantity)}`);
    if (this.onlyTouched.checked) this.filter();
    else this.showLoads();
  }

  /** Shows loads in the rows that are in sight: there may be thousands of others. */
  showLoads() {
    const { model, sight } = this;
    this.showColours();
    const first = Math.floor(sight.top / ROW_PX);
    for (const i of this.listed.slice(first, first + Math.ceil(sight.height / ROW_PX) + 1)) {
      const entry = this.rows.get(i);
      if (!entry) continue;
      const touched = model.inContact.has(i);
      const load = touched ? model.load(i) : 0;
      const text = touched ? model.loadText(i) : "";
      if (text !== entry.text) {
        if (!text !== !entry.text) entry.row.classList.toggle("touched", touched);
        entry.text = text;
        setText(entry.value, text);
      }
      const width = this.largest > 0 ? Math.round((100 * load) / this.largest) : 0;
      if (width !== entry.width) {
        entry.width = width;
        entry.bar.style.width = `${width}%`;
      }
    }
  }

  /** Shows the colours of fields that have got one since, or have them no more. */
  showColours() {
    const { fieldColours } = this.model;
    const { of, count } = this.coloured;
    if (of === fieldColours && count === fieldColours.size) return;
    this.coloured = { of: fieldColours, count: fieldColours.size };
    for (const [i, { dot }] of this.rows) this.showColour(i, dot);
  }

  /**
   * The colour that a field has elsewhere, once it has one.
   * @param {number} field
   * @param {HTMLElement} dot
   */
  showColour(field, dot) {
    const number = this.model.fieldColours.get(field);
    const colour = number === undefined ? "" : paletteColour(number);
    if (dot.dataset.colour === colour) return;
    dot.dataset.colour = colour;
    dot.style.background = colour;
    dot.hidden = !colour;
  }

  /**
   * The next or previous field, from the one that is chosen.
   * @param {number} by
   */
  step(by) {
    const list = this.listed;
    if (!list.length) return;
    const at = this.choices.chosen === null ? -1 : list.indexOf(this.choices.chosen);
    const next = at < 0 ? (by > 0 ? 0 : list.length - 1) : (at + by + list.length) % list.length;
    this.choices.choose(list[next]);
    if (this.tree.contains(document.activeElement)) this.rows.get(list[next])?.row.focus();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { chosen } = this.choices;
    const act = {
      ArrowDown: () => this.step(1),
      ArrowUp: () => this.step(-1),
      ArrowRight: () => chosen !== null && this.unfold(chosen, true),
      ArrowLeft: () => chosen !== null && this.unfold(chosen, false),
      Enter: () => chosen !== null && this.lookAt(chosen),
    }[event.key];
    if (!act) return;
    act();
    event.preventDefault();
    event.stopPropagation();
  }
}
