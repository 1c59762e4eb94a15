/** Pauses a live view: frames go on arriving, what is shown stays, and the newest is shown when it goes on. */

import { Observed } from "./dom.js";

/** @typedef {import("./wire.js").Frame} Frame */
/** @typedef {import("./wire.js").Samples} Samples */

/** Samples of the plots that are kept meanwhile: as many as a plot keeps. */
const SAMPLES_MAX = 1 << 16;

/** A frame has only what differs from the one before. */
const SECTIONS = /** @type {const} */ (["pressure", "health", "pose", "percepts", "touches", "selfContacts"]);

/**
 * The newer frame, with what it leaves out as it was in the older one. Samples are apart.
 * @param {Frame | null} older
 * @param {Frame} newer
 * @returns {Frame}
 */
export function merged(older, newer) {
  const frame = { ...newer, samples: null };
  for (const section of SECTIONS)
    Object.assign(frame, { [section]: newer[section] ?? older?.[section] ?? null });
  return frame;
}

export class Hold extends Observed {
  /** @param {import("./model.js").Model} model */
  constructor(model) {
    super();
    this.model = model;
    /** @type {Date | null} */
    this.since = null;
    /** Frames that have come since. */
    this.frames = 0;
    /** @type {Frame | null} */
    this.newest = null;
    /** @type {Samples[]} */
    this.samples = [];
    this.sampleCount = 0;
  }

  get isOn() {
    return this.since !== null;
  }

  /**
   * Shows a frame, or keeps it.
   * @param {Frame} frame
   */
  take(frame) {
    if (!this.isOn) {
      this.model.apply(frame);
      return;
    }
    this.frames++;
    this.newest = merged(this.newest, frame);
    if (!frame.samples) return;
    this.samples.push(frame.samples);
    this.sampleCount += frame.samples.t.length;
    while (this.sampleCount > SAMPLES_MAX && this.samples.length > 1)
      this.sampleCount -= this.samples.shift()?.t.length ?? 0;
  }

  /** A body at rest and a recording have nothing to hold. */
  toggle() {
    const { model } = this;
    if (this.isOn) this.release();
    else if (model.welcome?.mode === "live" && model.frame && !model.isAtRest) {
      this.since = new Date();
      this.tell("hold");
    }
  }

  release() {
    const { newest, samples, model } = this;
    this.forget();
    for (const one of samples) {
      model.samples = one;
      model.tell("samples");
    }
    if (newest) model.apply(newest);
  }

  /** Nothing is kept any more, as what comes next is of another connection. */
  forget() {
    if (!this.isOn) return;
    this.since = this.newest = null;
    this.samples = [];
    this.frames = this.sampleCount = 0;
    this.tell("hold");
  }
}
