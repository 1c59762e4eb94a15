/** How hard each touch pressed over time, as far as the page has seen it: the server has the past of fields alone. */

import { byId, make, PALETTE, paletteColour } from "./dom.js";
import { DASHES, drawPlot } from "./plot.js";

/** @typedef {{t: number[], v: {total: number[], force: number[]}, colour: number}} Past */

/** Touches whose past is kept, the newest ones, and samples of each. */
const TOUCHES_MAX = 200;
const SAMPLES_MAX = 1 << 14;
/** Touches that are named below the plot. */
const NAMED_MAX = 8;

export class TouchPast {
  constructor() {
    /** By the ids of touches. @type {Map<number, Past>} */
    this.touches = new Map();
    /** Forces are known where the run has a unit. */
    this.hasForce = false;
  }

  forget() {
    this.touches.clear();
    this.hasForce = false;
  }

  /**
   * @param {number} t
   * @param {{id: number, total: number, force: number}[]} touches
   * @param {(id: number) => number} colourOf
   */
  take(t, touches, colourOf) {
    for (const { id, total, force } of touches) {
      let past = this.touches.get(id);
      if (!past) {
        past = { t: [], v: { total: [], force: [] }, colour: colourOf(id) };
        this.touches.set(id, past);
        if (this.touches.size > TOUCHES_MAX) this.touches.delete(Math.min(...this.touches.keys()));
      }
      this.hasForce ||= Number.isFinite(force);
      put(past, t, total, force);
    }
  }

  /**
   * The touches that were there in a time, in the order of their ids.
   * @param {number} from
   * @param {number} to
   */
  within(from, to) {
    return [...this.touches]
      .filter(([, { t }]) => t.length && t[0] <= to && t[t.length - 1] >= from)
      .sort(([a], [b]) => a - b)
      .map(([id, { t, v, colour }]) => ({ id, t, v: this.hasForce ? v.force : v.total, colour }));
  }
}

/**
 * Puts a sample where its time belongs: a recording may be played backwards in parts, and twice.
 * @param {Past} past
 * @param {number} time
 * @param {number} total
 * @param {number} force
 */
function put({ t, v }, time, total, force) {
  let at = t.length;
  if (at && time <= t[at - 1]) {
    let low = 0;
    while (low < at) {
      const middle = (low + at) >> 1;
      if (t[middle] < time) low = middle + 1;
      else at = middle;
    }
  }
  const same = t[at] === time ? 1 : 0;
  t.splice(at, same, time);
  v.total.splice(at, same, total);
  v.force.splice(at, same, force);
  if (t.length <= SAMPLES_MAX) return;
  // Some at once, as each time moves all.
  for (const list of [t, v.total, v.force]) list.splice(0, SAMPLES_MAX >> 3);
}

export class TouchPlot {
  /** @param {import("./model.js").Model} model */
  constructor(model) {
    this.model = model;
    this.past = new TouchPast();
    this.isShown = false;
    this.root = byId("touch-plot", HTMLElement);
    this.button = byId("touch-plot-button", HTMLButtonElement);
    this.canvas = make("canvas");
    this.chips = make("div", "chips");
    this.root.append(this.canvas, this.chips);
    this.named = "";
    this.run = "";
    model.on("scene", () => this.begin());
    model.on("frame", () => this.take());
  }

  begin() {
    const { welcome } = this.model;
    this.button.hidden = !welcome?.touches;
    if (welcome?.run !== this.run) this.past.forget();
    this.run = welcome?.run ?? "";
    this.show(this.isShown);
  }

  /** @param {boolean} on */
  show(on) {
    this.isShown = on;
    this.root.hidden = !on || !this.model.welcome?.touches;
    this.button.setAttribute("aria-pressed", String(on));
  }

  take() {
    const { model } = this;
    if (model.frame && model.welcome?.touches)
      this.past.take(model.frame.t, model.touches, (id) => model.touchColour(id));
  }

  get unit() {
    return this.past.hasForce ? "N" : "P";
  }

  /** @param {Omit<import("./plot.js").How, "unit">} how */
  draw(how) {
    if (this.root.hidden) return;
    const touches = this.past.within(how.from, how.to);
    const dashes = dashesOf(touches);
    const lines = touches.map(({ t, v, colour }, i) => ({
      colour: paletteColour(colour),
      dash: dashes[i],
      points: { t, v },
    }));
    drawPlot(this.canvas, lines, { ...how, unit: this.unit });
    this.name(touches.map(({ id }, i) => ({ id, ...lines[i] })));
  }

  /** @param {{id: number, colour: string, dash: number[]}[]} lines */
  name(lines) {
    const named = lines.slice(-NAMED_MAX);
    const key = named.map(({ id, colour, dash }) => `${id} ${colour} ${dash}`).join() + lines.length;
    if (key === this.named) return;
    this.named = key;
    const chips = named.map(({ id, colour, dash }) => {
      const chip = make("span", "chip plain");
      const swatch = make("i");
      swatch.style.background = swatchOf(colour, dash);
      chip.append(swatch, make("span", "", `#${id}`));
      return chip;
    });
    const more = lines.length - named.length;
    if (more) chips.unshift(make("span", "chip plain", `${more} before`));
    if (!lines.length) chips.push(make("span", "note", "No touch has been seen in this time yet."));
    this.chips.replaceChildren(...chips);
  }
}

/**
 * How lines are dashed: touches that do not meet may have one colour, and so differ by this.
 * @param {{colour: number}[]} lines
 */
export function dashesOf(lines) {
  return lines.map(({ colour }, i) => {
    const before = lines
      .slice(0, i)
      .filter((other) => other.colour % PALETTE.length === colour % PALETTE.length);
    return DASHES[before.length % DASHES.length];
  });
}

/**
 * A swatch of a line, as a CSS background.
 * @param {string} colour
 * @param {number[]} dash
 */
export function swatchOf(colour, dash) {
  if (!dash.length) return colour;
  const [on, off] = dash;
  return `repeating-linear-gradient(90deg, ${colour} 0 ${on}px, transparent ${on}px ${on + off}px)`;
}
