/** The part of a recording that the timeline and the plots show, and the part that is played again and again. */

import { Observed } from "./dom.js";

/** What is shown holds at least so many frames. */
const FRAMES_MIN = 4;
/** When the playhead leaves what is shown, the next part begins so far before it, as a part of what is shown. */
const BEFORE = 0.05;

export class Span extends Observed {
  constructor() {
    super();
    /** The whole recording, s. */
    this.start = 0;
    this.end = 1;
    /** What is shown of it, s. */
    this.from = 0;
    this.to = 1;
    /** The least time that can be shown, s. */
    this.least = 1e-3;
    /** What is played again and again, s. @type {{from: number, to: number} | null} */
    this.loop = null;
    /** Whether what is shown goes on with the playhead: until somebody looks elsewhere. */
    this.follows = true;
    this.now = 0;
  }

  /**
   * Another recording; the same one again, as after a lost connection, leaves all as it is.
   * @param {{start_s: number, end_s: number, frames: number}} time
   */
  begin(time) {
    if (time.start_s === this.start && time.end_s === this.end) return;
    [this.start, this.end] = [this.from, this.to] = [time.start_s, time.end_s];
    this.least = (FRAMES_MIN * (this.end - this.start)) / Math.max(FRAMES_MIN, time.frames);
    this.loop = null;
    this.follows = true;
    this.tell("span");
    this.tell("loop");
  }

  get length() {
    return this.to - this.from;
  }

  get isWhole() {
    return this.from <= this.start && this.to >= this.end;
  }

  /** @param {number} t */
  holds(t) {
    return t >= this.from && t <= this.to;
  }

  /**
   * @param {number} from
   * @param {number} to
   */
  show(from, to) {
    const length = Math.max(this.least, Math.min(this.end - this.start, to - from));
    if (!Number.isFinite(length)) return;
    const begin = Math.max(this.start, Math.min(this.end - length, from));
    if (begin === this.from && begin + length === this.to) return;
    [this.from, this.to] = [begin, length < this.end - this.start ? begin + length : this.end];
    this.follows = this.holds(this.now);
    this.tell("span");
  }

  showAll() {
    this.show(this.start, this.end);
  }

  /**
   * @param {number} factor of the time that is shown
   * @param {number} about this time stays where it is
   */
  zoom(factor, about) {
    const length = Math.max(this.least, Math.min(this.end - this.start, this.length * factor));
    const part = Math.max(0, Math.min(1, (about - this.from) / this.length));
    this.show(about - part * length, about + (1 - part) * length);
  }

  /** @param {number} seconds */
  pan(seconds) {
    this.show(this.from + seconds, this.to + seconds);
  }

  /**
   * Shows the next part when the playhead leaves the one that is shown.
   * @param {number} t where it is
   */
  follow(t) {
    if (t === this.now) return;
    const back = t < this.now;
    this.now = t;
    if (this.holds(t)) this.follows = true;
    else if (this.follows) {
      const from = back ? t - (1 - BEFORE) * this.length : t - BEFORE * this.length;
      this.show(from, from + this.length);
    }
  }

  /**
   * @param {number} a either end
   * @param {number} b
   */
  setLoop(a, b) {
    const within = (/** @type {number} */ t) => Math.max(this.start, Math.min(this.end, t));
    const [from, to] = [within(Math.min(a, b)), within(Math.max(a, b))];
    this.loop = to > from ? { from, to } : null;
    this.tell("loop");
  }

  /**
   * Moves one end; the other one stays, or is that of the recording where it would lie on the wrong side.
   * @param {"from" | "to"} end
   * @param {number} t
   */
  setLoopEnd(end, t) {
    const loop = this.loop ?? { from: this.start, to: this.end };
    if (end === "from") this.setLoop(t, loop.to > t ? loop.to : this.end);
    else this.setLoop(loop.from < t ? loop.from : this.start, t);
  }

  /** Repeats what is shown, or nothing. */
  toggleLoop() {
    if (this.loop) this.setLoop(0, 0);
    else this.setLoop(this.from, this.to);
  }
}
