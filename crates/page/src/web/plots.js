/** Which outputs are plotted over time, and their values: samples of every frame, or least and most of each pixel. */

import { byId, make, paletteColour, setText } from "./dom.js";
import { clock, seconds } from "./format.js";
import { DASHES, drawPlot } from "./plot.js";
import { unitOf } from "./senses.js";
import { swatchOf, TouchPlot } from "./touch_plot.js";
import { say } from "./wire.js";

/** @typedef {import("./wire.js").Series} Series */
/** @typedef {{t: Float64Array, v: Float32Array, begin: number, size: number}} Ring */

const SERIES_MAX = 16;
/** Samples that are kept of a series; a power of two. */
const SAMPLES_MAX = 1 << 16;
/** Fields that are plotted as they are touched, until somebody chooses others. */
const FOLLOWED_MAX = 5;
/** A field takes the place of another where it is pressed so many times as hard. */
const HARDER = 1.5;
const WINDOWS_S = [2, 5, 10, 30, 60, 120, 300];

/** Angles that come back: an axis is the same after half a turn, a direction after a whole one. */
const PERIODS = new Map([
  ["orientation", Math.PI],
  ["principal_axis", Math.PI],
  ["direction", 2 * Math.PI],
]);

/** @param {Series} s */
const keyOf = (s) => `${s.field}/${s.column}/${s.component}`;

export class Plots {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./socket.js").Connection} connection
   * @param {import("./span.js").Span} span what is shown of a recording
   */
  constructor(model, connection, span) {
    this.model = model;
    this.span = span;
    this.connection = connection;
    this.root = byId("plots", HTMLElement);
    this.note = byId("plots-note", HTMLElement);
    /** @type {Series[]} */
    this.series = [];
    /** Whether the fields that are touched are plotted: until somebody chooses what is. */
    this.follows = true;
    /** The column of which these are plotted. */
    this.followed = "";
    /** How hard each of the plotted fields was pressed at most. @type {Map<number, number>} */
    this.mostLoads = new Map();
    /** Series by the number of the `series` message that asked for them. @type {Series[][]} */
    this.asked = [[]];
    /** @type {Map<string, Ring>} */
    this.rings = new Map();
    this.window = 10;
    /** @type {Map<string, {least: Float32Array, most: Float32Array}>} */
    this.bands = new Map();
    this.bandRange = { from: 0, to: 1 };
    this.historyId = 0;
    /** @type {Map<number, Series[]>} */
    this.pending = new Map();
    /** What was asked for has changed since. */
    this.stale = false;
    this.bins = 300;
    /** @type {Map<string, {box: HTMLElement, canvas: HTMLCanvasElement, chips: HTMLElement}>} */
    this.groups = new Map();
    this.body = "";
    this.run = "";
    /** Where the pointer is, as a part of the width. @type {number | null} */
    this.pointer = null;
    /** Goes to a moment of a recording. @type {(t: number) => void} */
    this.onSeek = () => {};
    /** Called when touches are plotted or not any more. */
    this.onTouchPlot = () => {};
    this.touches = new TouchPlot(model);
    this.listen(this.touches.canvas);
    span.on("span", () => {
      this.askHistory();
      this.draw();
    });
    model.on("samples", () => this.take());
    model.on("history", () => this.takeHistory());
    model.on("timeline", () => this.askHistory());
  }

  /** After every welcome: asks again, as the server knows nothing of us. */
  begin() {
    const { welcome } = this.model;
    if (!welcome) return;
    this.asked = [[]];
    this.pending.clear();
    if (welcome.run !== this.run) {
      this.run = welcome.run;
      this.rings.clear();
      this.bands.clear();
    }
    // The same fields again, perhaps from a server that was started anew: the user's plots stay.
    const body = welcome.fields.map((field) => `${field.letter} ${field.name}`).join("\n");
    if (body !== this.body) {
      this.body = body;
      this.series = [];
      this.follows = true;
      this.mostLoads.clear();
    }
    this.ask();
  }

  /**
   * Plots the fields that are touched, as long as nobody has chosen what is plotted.
   * @param {number[]} touched the hardest pressed first
   */
  follow(touched) {
    const { model } = this;
    const column = model.plottedColumn;
    if (!this.follows || !column) return;
    if (this.followed !== column) this.mostLoads.clear();
    this.followed = column;
    const components = model.welcome?.columns.find((c) => c.name === column)?.components ?? 1;
    const before = [...this.mostLoads.keys()].join();
    for (const field of touched.slice(0, FOLLOWED_MAX)) {
      const load = model.strength(field);
      const most = this.mostLoads.get(field);
      if (most !== undefined) this.mostLoads.set(field, Math.max(most, load));
      else if (this.mostLoads.size < FOLLOWED_MAX) this.mostLoads.set(field, load);
      else {
        const [least] = [...this.mostLoads].sort((a, b) => a[1] - b[1]);
        if (load <= HARDER * least[1]) continue;
        this.mostLoads.delete(least[0]);
        this.mostLoads.set(field, load);
      }
    }
    if ([...this.mostLoads.keys()].join() === before) return;
    this.series = [...this.mostLoads.keys()]
      .sort((a, b) => a - b)
      .flatMap((field) =>
        Array.from({ length: components }, (_, component) => ({ field, column, component })),
      )
      .slice(0, SERIES_MAX);
    this.ask();
  }

  /**
   * Adds all components of a column, or takes them away where they are plotted.
   * @param {number} field
   * @param {string} column
   */
  toggle(field, column) {
    this.follows = false;
    const components = this.model.welcome?.columns.find((c) => c.name === column)?.components ?? 1;
    if (this.has(field, column)) {
      this.series = this.series.filter((s) => s.field !== field || s.column !== column);
    } else {
      for (let component = 0; component < components; component++) {
        if (this.series.length >= SERIES_MAX) {
          setText(this.note, `At most ${SERIES_MAX} lines: take one away first.`);
          break;
        }
        this.series.push({ field, column, component });
      }
    }
    this.ask();
  }

  /** The outputs that are plotted, each once. */
  chosen() {
    return this.series.filter(({ component }) => component === 0);
  }

  /**
   * Plots these outputs and no others.
   * @param {{field: number, column: string}[]} outputs
   */
  plot(outputs) {
    this.follows = false;
    this.series = outputs
      .flatMap(({ field, column }) => {
        const components = this.model.welcome?.columns.find((c) => c.name === column)?.components ?? 1;
        return Array.from({ length: components }, (_, component) => ({ field, column, component }));
      })
      .slice(0, SERIES_MAX);
    this.ask();
  }

  /** Touches over time, on and off. */
  toggleTouches() {
    if (!this.model.welcome?.touches) return;
    this.touches.show(!this.touches.isShown);
    this.onTouchPlot();
    this.draw();
  }

  /**
   * @param {number} field
   * @param {string} column
   */
  has(field, column) {
    return this.series.some((s) => s.field === field && s.column === column);
  }

  /** @param {Series} one */
  remove(one) {
    this.follows = false;
    this.series = this.series.filter((s) => keyOf(s) !== keyOf(one));
    setText(this.note, "");
    this.ask();
  }

  ask() {
    const list = this.series.map(({ field, column, component }) => ({ field, column, component }));
    if (this.model.welcome?.mode === "live") {
      this.asked.push(list);
      this.connection.send(say.series(list));
      for (const key of this.rings.keys()) if (!list.some((s) => keyOf(s) === key)) this.rings.delete(key);
    }
    this.askHistory();
    this.build();
    this.model.tell("series");
  }

  askHistory() {
    const { welcome } = this.model;
    if (!welcome?.time || !this.series.length) return;
    if (this.pending.size) {
      // One at a time: the answer to this one asks for the next.
      this.stale = true;
      return;
    }
    this.stale = false;
    const list = this.series.map(({ field, column, component }) => ({ field, column, component }));
    const id = this.nextId();
    this.pending.set(id, list);
    this.connection.send(say.history(id, this.span.from, this.span.to, this.bins, list));
  }

  /** The number of the next request for the past. */
  nextId() {
    return ++this.historyId;
  }

  /** @param {Series} series */
  ringOf(series) {
    return this.rings.get(keyOf(series));
  }

  takeHistory() {
    const { history } = this.model;
    const list = history && this.pending.get(history.id);
    if (!history || !list) return;
    this.pending.clear();
    if (this.stale) setTimeout(() => this.askHistory(), 300);
    this.bandRange = { from: history.from, to: history.to };
    this.bands = new Map(list.map((s, i) => [keyOf(s), { least: history.least[i], most: history.most[i] }]));
    this.draw();
  }

  /** Keeps the samples of a live frame. */
  take() {
    const { samples } = this.model;
    if (!samples) return;
    const list = this.asked[samples.answers || this.asked.length - 1];
    if (!list || samples.values.length < list.length) return;
    list.forEach((s, i) => {
      let ring = this.rings.get(keyOf(s));
      if (!ring) {
        ring = { t: new Float64Array(SAMPLES_MAX), v: new Float32Array(SAMPLES_MAX), begin: 0, size: 0 };
        this.rings.set(keyOf(s), ring);
      }
      for (let k = 0; k < samples.t.length; k++) {
        const at = (ring.begin + ring.size) & (SAMPLES_MAX - 1);
        ring.t[at] = samples.t[k];
        ring.v[at] = samples.values[i][k];
        if (ring.size < SAMPLES_MAX) ring.size++;
        else ring.begin = (ring.begin + 1) & (SAMPLES_MAX - 1);
      }
    });
  }

  /** One plot for each unit. */
  build() {
    const { welcome } = this.model;
    if (!welcome) return;
    const units = [...new Set(this.series.map((s) => this.unitOf(s)))];
    this.groups.clear();
    this.root.replaceChildren(
      ...units.map((unit) => {
        const box = make("div", "plot");
        const canvas = make("canvas");
        const chips = make("div", "chips");
        box.append(canvas, chips);
        for (const s of this.series.filter((one) => this.unitOf(one) === unit)) chips.append(this.chip(s));
        this.groups.set(unit, { box, canvas, chips });
        this.listen(canvas);
        return box;
      }),
    );
    if (this.series.length < SERIES_MAX) setText(this.note, this.series.length ? "" : this.emptyNote());
    this.draw();
  }

  emptyNote() {
    const byHand = "Press ∿ beside an output of a field to plot it.";
    return this.follows ? `Fields are plotted as they are touched. ${byHand}` : byHand;
  }

  /** @param {Series} s */
  unitOf(s) {
    const { welcome, quantity } = this.model;
    const column = welcome?.columns.find((c) => c.name === s.column);
    return unitOf(column, welcome?.fields[s.field]?.letter, quantity);
  }

  /**
   * How a line is dashed: lines of one field have one colour, so those in one plot differ by this.
   * @param {Series} s
   */
  dashOf(s) {
    const alike = this.series.filter((one) => one.field === s.field && this.unitOf(one) === this.unitOf(s));
    return DASHES[alike.findIndex((one) => keyOf(one) === keyOf(s)) % DASHES.length] ?? [];
  }

  /** @param {Series} s */
  chip(s) {
    const chip = make("span", "chip");
    const swatch = make("i");
    swatch.style.background = swatchOf(paletteColour(this.model.fieldColour(s.field)), this.dashOf(s));
    const field = this.model.welcome?.fields[s.field];
    const close = make("button", "", "×");
    close.title = "Take this line away";
    close.addEventListener("click", () => this.remove(s));
    chip.title = field?.name ?? "";
    chip.append(swatch, make("span", "", `${field?.name ?? ""}${this.labelOf(s)}`), close);
    return chip;
  }

  /**
   * What a line shows of its field.
   * @param {Series} s
   */
  labelOf(s) {
    const letter = this.model.welcome?.fields[s.field]?.letter;
    const components = this.model.welcome?.columns.find((c) => c.name === s.column)?.components ?? 1;
    const part =
      components === 2 ? [" u", " v"][s.component] : components === 3 ? [" x", " y", " z"][s.component] : "";
    return `${letter ? ` (${letter})` : ""} ${s.column}${part}`;
  }

  /** @param {HTMLCanvasElement} canvas */
  listen(canvas) {
    const t = (/** @type {number} */ x) => timeAt(this.span, x, canvas.clientWidth);
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.zoom(event.deltaY > 0 ? 1.3 : 1 / 1.3, t(event.offsetX));
      },
      { passive: false },
    );
    canvas.addEventListener("dblclick", () =>
      this.model.welcome?.time ? this.span.showAll() : this.zoom(2, 0),
    );
    canvas.addEventListener("click", (event) => {
      if (this.model.welcome?.time) this.onSeek(t(event.offsetX));
    });
    canvas.addEventListener("pointermove", (event) => {
      this.pointer = event.offsetX / canvas.clientWidth;
      this.draw();
    });
    canvas.addEventListener("pointerleave", () => {
      this.pointer = null;
      this.draw();
    });
  }

  /**
   * @param {number} factor of the time that is shown
   * @param {number} about this time stays where it is
   */
  zoom(factor, about) {
    if (!this.model.welcome?.time) {
      const at = WINDOWS_S.indexOf(this.window) + (factor > 1 ? 1 : -1);
      this.window = WINDOWS_S[Math.max(0, Math.min(WINDOWS_S.length - 1, at))];
      this.draw();
      return;
    }
    this.span.zoom(factor, about);
  }

  /** The time that is shown, and the moment of the frame. */
  range() {
    const now = this.model.frame?.t ?? 0;
    if (this.model.welcome?.time) return { from: this.span.from, to: this.span.to, now };
    return { from: now - this.window, to: now, now };
  }

  draw() {
    const { welcome } = this.model;
    if (!welcome) return;
    const how = {
      ...this.range(),
      quantity: this.model.quantity,
      bandRange: this.bandRange,
      live: welcome.mode === "live",
      pointer: this.pointer,
      spacing: welcome.time ? (welcome.time.end_s - welcome.time.start_s) / welcome.time.frames : 0,
      until: welcome.time ? this.model.timeline.until : Infinity,
    };
    this.touches.draw(how);
    for (const [unit, { canvas }] of this.groups) {
      this.bins = Math.max(50, Math.min(4096, canvas.clientWidth));
      const lines = this.series
        .filter((s) => this.unitOf(s) === unit)
        .map((s) => ({
          colour: paletteColour(this.model.fieldColour(s.field)),
          dash: this.dashOf(s),
          period: PERIODS.get(s.column),
          ring: this.rings.get(keyOf(s)),
          band: this.bands.get(keyOf(s)),
        }));
      drawPlot(canvas, lines, { ...how, unit });
    }
  }

  /** What the head of the panel says. */
  caption() {
    if (this.model.welcome?.time) return `${seconds(this.span.from)} – ${seconds(this.span.to)}`;
    return `${this.window} s to ${clock(new Date())}`;
  }
}

/**
 * @param {{from: number, length: number}} span
 * @param {number} x pixels
 * @param {number} width
 */
const timeAt = (span, x, width) => span.from + (x / width) * span.length;
