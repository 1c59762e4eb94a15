/** The highest pressure of each taxel over what is repeated, or else what the timeline shows, in place of the pressures of a moment. */

import { Observed } from "./dom.js";
import { say } from "./wire.js";

export class Peaks extends Observed {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./span.js").Span} span
   * @param {import("./socket.js").Connection} connection
   */
  constructor(model, span, connection) {
    super();
    this.model = model;
    this.span = span;
    this.connection = connection;
    this.isOn = false;
    this.id = 0;
    /** Whether an answer is awaited: a span that is dragged would ask for many. */
    this.isAsked = false;
    span.on("span loop", () => this.ask());
    model.on("scene", () => {
      this.isAsked = false;
      this.ask();
    });
    model.on("peaks", () => this.answered());
  }

  get part() {
    const { from, to } = this.span.loop ?? this.span;
    return { from, to };
  }

  toggle() {
    this.show(!this.isOn);
  }

  /** @param {boolean} isOn */
  show(isOn) {
    if (isOn === this.isOn || (isOn && this.model.sense !== "pressure")) return;
    this.isOn = isOn;
    if (!isOn) this.model.showPeaks(null);
    this.ask();
    this.tell("peaks");
  }

  ask() {
    if (!this.isOn || this.isAsked || !this.model.welcome?.time) return;
    const { from, to } = this.part;
    this.isAsked = true;
    this.connection.send(say.peaks(++this.id, from, to));
  }

  answered() {
    const { model } = this;
    const { answeredPeaks } = model;
    if (answeredPeaks?.id !== this.id) return;
    this.isAsked = false;
    if (!this.isOn) return;
    model.showPeaks(answeredPeaks);
    const { from, to } = this.part;
    if (from !== answeredPeaks.from || to !== answeredPeaks.to) this.ask();
  }
}
