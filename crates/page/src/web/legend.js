/** The legend: colours of pressure with units, and how states of taxels look. */

import { make, setText } from "./dom.js";
import { clock, scaleFor, seconds, short, tickText, ticks } from "./format.js";
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

export class Legend {
  /**
   * @param {HTMLElement} root
   * @param {import("./model.js").Model} model
   */
  constructor(root, model) {
    this.root = root;
    this.model = model;
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
    const zero = make("span", "legend-zero");
    zero.append(make("i"), "0");
    zero.title = "A taxel that feels nothing";
    const foot = make("div", "legend-foot");
    foot.append(this.source, zero);
    root.append(head, this.canvas, this.ticks, foot, this.states);
    this.since = "";
    this.shown = "";
    this.counts = "";
    this.maximum = NaN;
    model.on("scene scale", () => this.update());
  }

  toggle() {
    this.since = clock(new Date());
    this.model.setAutoscale(this.model.autoscale === null);
  }

  update() {
    const { model } = this;
    const { welcome } = model;
    if (!welcome) return;
    const most = model.scaleMax;
    this.maximum = most;
    const by = scaleFor("P", most, model.quantity);
    const what =
      model.quantity === "N" ? "Force of a taxel" : model.quantity === "Pa" ? "Pressure" : "Raw value";
    const { peaks } = model;
    setText(this.title, `${peaks ? `Highest ${what.toLowerCase()}` : what}, ${by.unit}`);
    this.paint(welcome.colours);
    this.ticks.replaceChildren(
      ...endedTicks(most * by.factor).map(({ part, text }) => {
        const tick = make("span", "", text);
        tick.style.left = `${100 * part}%`;
        return tick;
      }),
    );
    const auto = model.autoscale !== null;
    if (peaks) setText(this.source, `from ${seconds(peaks.from)} to ${seconds(peaks.to)}`);
    else setText(this.source, auto ? `autoscale since ${this.since}` : this.sourceText(model.scale.from));
    this.root.classList.toggle("auto", auto);
    setText(this.auto, auto ? "Fixed scale" : "Autoscale");
  }

  /** @param {string} from */
  sourceText(from) {
    switch (from) {
      case "calibration":
        return "fixed by the calibration";
      case "raw range":
        return "fixed to the raw range";
      case "recording":
        return "fixed to the recording’s maximum";
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
    for (const state of model.health) counts[state]++;
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
