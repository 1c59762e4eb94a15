/** The legend: colours of what is shown of taxels, with units, and how their states look. */

import { hasArrows, WIDTHS_AT_MOST } from "./arrows.js";
import { make, setText } from "./dom.js";
import { clock, scaleFor, seconds, short, tickText, ticks, withUnit } from "./format.js";
import { letterName } from "./senses.js";
import { HEALTH } from "./wire.js";

/** Ticks closer to the end of the bar than this part of it would lie under the number there. */
const NEAR_END = 0.15;

/**
 * The ticks of a bar from 0 to `most`: round ones, and the last at its end with its number.
 * @param {number} most
 */
export function endedTicks(most) {
  const places = ticks(0, most, 4);
  const round = places.filter((place) => place < (1 - NEAR_END) * most);
  const isRound = Math.abs(places[places.length - 1] - most) < 1e-6 * most;
  const end = { part: 1, text: isRound ? tickText(most, places) : short(most) };
  return [...round.map((place) => ({ part: place / most, text: tickText(place, places) })), end];
}

/**
 * The ticks of a bar between two values: round ones, and both ends with their numbers.
 * @param {number} least
 * @param {number} most
 */
export function ticksBetween(least, most) {
  const part = (/** @type {number} */ x) => (x - least) / (most - least);
  const places = ticks(least, most, 4);
  const within = places.filter((x) => part(x) > NEAR_END && part(x) < 1 - NEAR_END);
  const text = (/** @type {number} */ x) => {
    const isRound = places.some((place) => Math.abs(place - x) < 1e-6 * (most - least));
    return isRound ? tickText(x, places) : short(x);
  };
  return [least, ...within, most].map((x) => ({ part: part(x), text: text(x) }));
}

/** What is shown of taxels in senses that have scales of their own. */
const OWN = {
  temperature: { title: "Temperature", unit: "°C", factor: 1 },
  proximity: { title: "Distance", unit: "mm", factor: 1e3 },
};

export class Legend {
  /**
   * @param {HTMLElement} root
   * @param {import("./model.js").Model} model
   * @param {import("./choices.js").Choices} choices
   */
  constructor(root, model, choices) {
    this.root = root;
    this.model = model;
    this.choices = choices;
    this.letters = make("div", "segments legend-letters");
    this.arrow = make("div", "legend-arrow");
    this.title = make("div", "legend-title");
    this.canvas = make("canvas", "legend-bar");
    this.canvas.width = 256;
    this.canvas.height = 1;
    this.ticks = make("div", "legend-ticks");
    this.source = make("div", "legend-source");
    this.auto = make("button", "small", "Autoscale");
    this.auto.title = "Scale the colours to the largest pressure from now on (A)";
    this.auto.addEventListener("click", () => this.toggle());
    this.states = make("div", "legend-states");
    const head = make("div", "legend-head");
    head.append(this.title, this.auto);
    this.zero = make("span", "legend-zero");
    this.zeroText = make("span", "", "0");
    this.zero.append(make("i"), this.zeroText);
    this.zero.title = "A taxel that feels nothing";
    const foot = make("div", "legend-foot");
    foot.append(this.source, this.zero);
    root.append(this.letters, head, this.canvas, this.ticks, foot, this.arrow, this.states);
    this.since = "";
    this.shown = "";
    this.counts = "";
    this.maximum = NaN;
    model.on("scene scale", () => this.update());
    model.on("scene", () => this.showLetters());
    choices.on("letter", () => this.showLetters());
  }

  /** What taxels can be coloured by, where that is more than one sense. */
  showLetters() {
    const fields = this.model.welcome?.fields ?? [];
    const letters = [...new Set(fields.map((field) => field.letter))];
    this.letters.hidden = !this.model.senses || letters.length < 2;
    const { letter: chosen } = this.choices;
    const shown = letters.includes(chosen) ? chosen : letters[0];
    this.letters.replaceChildren(
      ...letters.map((letter) => {
        const button = make("button", "small", letterName(letter, fields));
        button.title = `Colour taxels by ${button.textContent}`;
        button.setAttribute("aria-pressed", String(letter === shown));
        button.addEventListener("click", () => this.choices.chooseLetter(letter));
        return button;
      }),
    );
  }

  toggle() {
    if (this.model.sense === "temperature" || this.model.sense === "proximity") return;
    this.since = clock(new Date());
    this.model.setAutoscale(this.model.autoscale === null);
  }

  update() {
    const { model } = this;
    const { welcome } = model;
    if (!welcome) return;
    const { sense } = model;
    const own = sense === "temperature" || sense === "proximity";
    this.auto.hidden = own;
    this.zero.hidden = sense === "temperature";
    setText(this.zeroText, sense === "proximity" ? "nothing near" : "0");
    this.paint(welcome.colours);
    this.arrow.hidden = !hasArrows(model);
    const width = model.scaleMax / WIDTHS_AT_MOST;
    setText(this.arrow, `arrow a taxel wide: ${withUnit(width, "P", model.quantity)}`);
    if (own) {
      const { title, unit, factor } = OWN[sense];
      const ends = model.senses?.ends(sense);
      setText(this.title, `${title}, ${unit}`);
      this.showTicks(ends ? ticksBetween(factor * ends.least, factor * ends.most) : []);
      setText(this.source, ends ? this.sourceText(ends.from, sense) : "nothing is read yet");
      this.root.classList.remove("auto");
      return;
    }
    const most = model.scaleMax;
    this.maximum = most;
    const by = scaleFor("P", most, model.quantity);
    const ofPressure =
      model.quantity === "N" ? "Force of a taxel" : model.quantity === "Pa" ? "Pressure" : "Raw value";
    const what = sense === "shear" ? "Shear of a taxel" : ofPressure;
    const { peaks } = model;
    setText(this.title, `${peaks ? `Highest ${what.toLowerCase()}` : what}, ${by.unit}`);
    this.showTicks(endedTicks(most * by.factor));
    const auto = model.autoscale !== null;
    if (peaks) setText(this.source, `from ${seconds(peaks.from)} to ${seconds(peaks.to)}`);
    else setText(this.source, auto ? `autoscale since ${this.since}` : this.sourceText(model.scaleFrom));
    this.root.classList.toggle("auto", auto);
    setText(this.auto, auto ? "Fixed scale" : "Autoscale");
  }

  /** @param {{part: number, text: string}[]} places */
  showTicks(places) {
    this.ticks.replaceChildren(
      ...places.map(({ part, text }) => {
        const tick = make("span", "", text);
        tick.style.left = `${100 * part}%`;
        return tick;
      }),
    );
  }

  /**
   * @param {string} from
   * @param {import("./senses.js").Sense} [sense]
   */
  sourceText(from, sense = "pressure") {
    switch (from) {
      case "calibration":
        return "fixed by the calibration";
      case "raw range":
        return sense === "proximity" ? "fixed to the range" : "fixed to the raw range";
      case "recording":
        return sense === "temperature"
          ? "fixed to the recording’s range"
          : "fixed to the recording’s maximum";
      case "grown":
        return "grown with the data so far";
      default:
        return from;
    }
  }

  /** @param {number[][]} colours */
  paint(colours) {
    const key = colours.join();
    const context = this.canvas.getContext("2d");
    if (key === this.shown || !context) return;
    this.shown = key;
    const image = context.createImageData(256, 1);
    colours.forEach(([r, g, b], i) => image.data.set([r, g, b, 255], 4 * i));
    context.putImageData(image, 0, 0);
  }

  /** Says how many taxels are in a state that is not good. */
  updateStates() {
    const { model } = this;
    if (model.autoscale !== null && model.scaleMax !== this.maximum) this.update();
    if (!model.frame) return;
    const counts = new Array(HEALTH.length).fill(0);
    model.health.forEach((state, taxel) => {
      if (model.senses?.reads(taxel, model.sense) ?? true) counts[state]++;
    });
    if (model.isAtRest) counts.fill(0);
    this.root.hidden = model.isAtRest;
    const key = counts.slice(1).join();
    if (key === this.counts) return;
    this.counts = key;
    this.states.replaceChildren(
      ...HEALTH.flatMap((name, state) => {
        if (state === 0 || !counts[state]) return [];
        const line = make("div", "legend-state");
        line.append(make("i", `state s${state}`), make("span", "", `${counts[state]} ${name}`));
        return [line];
      }),
    );
  }
}
