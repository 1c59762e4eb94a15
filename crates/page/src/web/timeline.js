/** Recordings: contact over time, play, pause, step, speed, scrub, and a part that is shown larger or played again and again. */

import { byId, cssColour, fitCanvas, setText } from "./dom.js";
import { seconds } from "./format.js";
import { TimelinePointer } from "./timeline_pointer.js";
import { say } from "./wire.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 10];
/** While the pointer drags, a place is asked for at most so often. */
const SCRUB_MS = 50;

/** Height of the mark over frames whose recorded percepts differ. */
const DIFFERENCE_PX = 5;
/** Height of the line that says which part of the recording is shown. */
const OVERVIEW_PX = 3;
/** A press of a button or key shows so much less time. */
const ZOOM = 0.6;
/** A jump to the beginning of what is repeated takes at most so long. */
const JUMP_MS = 1000;

export class Timeline {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./socket.js").Connection} connection
   * @param {import("./span.js").Span} span
   */
  constructor(model, connection, span) {
    this.model = model;
    this.connection = connection;
    this.span = span;
    this.root = byId("timeline", HTMLElement);
    this.canvas = byId("timeline-canvas", HTMLCanvasElement);
    this.playButton = byId("play", HTMLButtonElement);
    this.loopButton = byId("loop", HTMLButtonElement);
    this.timeLabel = byId("time", HTMLElement);
    this.speedBox = byId("speed", HTMLSelectElement);
    this.differences = byId("differences", HTMLElement);
    /** Where the pointer was dragged to, until a frame from there comes. @type {number | null} */
    this.wanted = null;
    this.saidSeek = 0;
    this.timer = 0;
    /** When the page asked to go to the beginning of what is repeated; it asks once. */
    this.jumped = -Infinity;
    /** Whether it plays, or has stopped by itself, as it does at its end. */
    this.plays = false;
    /** @type {[string, () => void][]} */
    const buttons = [
      ["play", () => this.togglePlay()],
      ["back-step", () => this.step(-1)],
      ["forward-step", () => this.step(1)],
      ["back-touch", () => this.toTouch(-1)],
      ["forward-touch", () => this.toTouch(1)],
      ["zoom-out", () => this.zoom(-1)],
      ["zoom-in", () => this.zoom(1)],
      ["loop-from", () => this.loopEnd("from")],
      ["loop-to", () => this.loopEnd("to")],
      ["loop", () => this.toggleLoop()],
    ];
    for (const [id, act] of buttons) byId(id, HTMLButtonElement).addEventListener("click", act);
    for (const speed of SPEEDS)
      this.speedBox.add(new Option(`${speed}×`, String(speed), speed === 1, speed === 1));
    this.speedBox.addEventListener("change", () => connection.send(say.speed(Number(this.speedBox.value))));
    this.pointer = new TimelinePointer(
      this.canvas,
      span,
      (t) => this.seek(t),
      () => this.draw(),
    );
    span.on("span loop", () => this.draw());
    span.on("loop", () => this.loopButton.setAttribute("aria-pressed", String(span.loop !== null)));
    model.on("scene", () => this.begin());
    model.on("status", () => this.showStatus());
    model.on("timeline", () => this.draw());
    model.on("frame", () => this.atFrame());
  }

  get time() {
    return this.model.welcome?.time ?? null;
  }

  begin() {
    const { time } = this;
    this.root.hidden = !time;
    document.documentElement.classList.toggle("recording", !!time);
    if (time) this.span.begin(time);
    this.draw();
  }

  showStatus() {
    const { playing, speed, at_end } = this.model.status;
    if (playing || !at_end) this.plays = playing;
    setText(this.playButton, playing ? "❚❚" : "▶");
    this.playButton.title = playing ? "Pause (space)" : "Play (space)";
    this.playButton.setAttribute("aria-label", playing ? "Pause" : "Play");
    if (!SPEEDS.includes(speed) && ![...this.speedBox.options].some((o) => Number(o.value) === speed))
      this.speedBox.add(new Option(`${speed}×`, String(speed)));
    this.speedBox.value = String(speed);
  }

  /** @param {number[]} differing */
  showDifferences(differing) {
    const count = differing.reduce((sum, of) => sum + of, 0);
    this.differences.hidden = count === 0;
    setText(this.differences, `${count} ${count === 1 ? "frame differs" : "frames differ"}`);
  }

  togglePlay() {
    if (this.time) this.connection.send(this.model.status.playing ? say.pause() : say.play());
  }

  /** @param {number} frames */
  step(frames) {
    if (this.time) this.connection.send(say.step(frames));
  }

  /**
   * The next faster or slower speed.
   * @param {number} by
   */
  faster(by) {
    if (!this.time) return;
    const at = SPEEDS.findIndex((speed) => speed >= this.model.status.speed);
    const next = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, (at < 0 ? SPEEDS.length - 1 : at) + by))];
    this.connection.send(say.speed(next));
  }

  /**
   * Pauses and goes to a moment.
   * @param {number} t
   */
  seek(t) {
    const { time } = this;
    if (!time) return;
    this.wanted = Math.max(time.start_s, Math.min(time.end_s, t));
    // Whoever goes somewhere wants to see it.
    this.span.follows = true;
    if (this.timer) return;
    const go = () => {
      this.timer = 0;
      if (this.wanted === null) return;
      if (this.model.status.playing) this.connection.send(say.pause());
      this.connection.send(say.seek(this.wanted));
      this.saidSeek = performance.now();
      this.wanted = null;
    };
    this.timer = window.setTimeout(go, Math.max(0, this.saidSeek + SCRUB_MS - performance.now()));
  }

  /** @param {number} seconds */
  jump(seconds) {
    this.seek((this.model.frame?.t ?? 0) + seconds);
  }

  /**
   * Goes to where the next touch begins, or the one before.
   * @param {1 | -1} way
   */
  toTouch(way) {
    const { time } = this;
    const { peak } = this.model.timeline;
    if (!time || !peak.length) return;
    const bin = (time.end_s - time.start_s) / peak.length;
    const onsets = peak.flatMap((p, i) => (p !== null && (i === 0 || peak[i - 1] === null) ? [i] : []));
    const now = Math.floor(((this.model.frame?.t ?? time.start_s) - time.start_s) / bin + 1e-6);
    const next = way > 0 ? onsets.find((i) => i > now) : onsets.filter((i) => i < now).pop();
    // At the end of its part of the recording it has begun.
    if (next !== undefined) this.seek(time.start_s + (next + 0.999) * bin);
  }

  /** Shows the next part where the playhead leaves what is shown, and begins what is repeated anew. */
  atFrame() {
    const { time, span, model } = this;
    const t = model.frame?.t;
    if (!time || t === undefined) return;
    span.follow(t);
    const { loop } = span;
    if (!loop || this.timer) return;
    if (t < loop.to) this.jumped = -Infinity;
    else this.repeat(loop.from);
  }

  /** @param {number} from */
  repeat(from) {
    if (!this.plays || performance.now() - this.jumped < JUMP_MS) return;
    this.jumped = performance.now();
    // At its end a recording has stopped, perhaps without the page having heard of it.
    this.connection.send(say.play());
    this.connection.send(say.seek(from));
  }

  /** @param {1 | -1} way nearer, or farther */
  zoom(way) {
    const now = this.model.frame?.t ?? this.span.from;
    const about = this.span.holds(now) ? now : this.span.from + this.span.length / 2;
    if (this.time) this.span.zoom(way > 0 ? ZOOM : 1 / ZOOM, about);
  }

  /** @param {"from" | "to"} end that is now where the playhead is */
  loopEnd(end) {
    const t = this.model.frame?.t;
    if (this.time && t !== undefined) this.span.setLoopEnd(end, t);
  }

  toggleLoop() {
    if (this.time) this.span.toggleLoop();
  }

  draw() {
    const { time } = this;
    if (!time) return;
    const now = this.model.frame?.t ?? time.start_s;
    setText(this.timeLabel, `${seconds(now)} / ${seconds(time.end_s)}`);
    const fitted = fitCanvas(this.canvas);
    if (!fitted) return;
    const { context, width, height } = fitted;
    const { span } = this;
    const x = (/** @type {number} */ t) => ((t - span.from) / span.length) * width;
    const { peak, until, differing } = this.model.timeline;
    const most = peak.reduce((/** @type {number} */ m, p) => Math.max(m, p ?? 0), 0);
    const computed = Math.max(0, Math.min(width, x(until)));
    context.fillStyle = cssColour("track");
    context.fillRect(0, 0, width, height);
    if (computed < width) {
      context.save();
      context.beginPath();
      context.rect(computed, 0, width - computed, height);
      context.clip();
      context.strokeStyle = cssColour("hatch");
      context.lineWidth = 2;
      context.beginPath();
      for (let at = computed - height; at < width; at += 7) {
        context.moveTo(at, height);
        context.lineTo(at + height, 0);
      }
      context.stroke();
      context.restore();
      if (width - computed > 110) {
        context.font = "11px system-ui, sans-serif";
        context.fillStyle = cssColour("faint");
        context.textAlign = "right";
        context.textBaseline = "middle";
        context.fillText("not computed yet", width - 8, height / 2);
      }
    }
    context.fillStyle = cssColour("contact");
    const bin = (time.end_s - time.start_s) / Math.max(1, peak.length);
    const wide = (bin / span.length) * width;
    const left = (/** @type {number} */ i) => x(time.start_s + i * bin);
    peak.forEach((p, i) => {
      if (p === null || !(most > 0) || left(i) > width || left(i) + wide < 0) return;
      const h = 3 + (height - 8) * Math.sqrt(p / most);
      context.fillRect(left(i), height - h, wide + 0.3, h);
    });
    context.fillStyle = cssColour("warn");
    differing.forEach((count, i) => {
      if (count > 0) context.fillRect(left(i), 0, wide + 0.3, DIFFERENCE_PX);
    });
    this.showDifferences(differing);
    this.drawLoop(context, x, height);
    if (!span.isWhole) this.drawOverview(context, time, width, height);
    const at = x(now);
    context.fillStyle = cssColour("accent");
    context.fillRect(at - 1, 0, 2, height);
    context.beginPath();
    context.arc(at, 5, 5, 0, 2 * Math.PI);
    context.fill();
    const { hover } = this.pointer;
    if (hover !== null) {
      const px = x(hover);
      context.fillStyle = cssColour("text");
      context.fillRect(px, 0, 1, height);
      context.font = "11px system-ui, sans-serif";
      context.textBaseline = "top";
      context.textAlign = px > width - 60 ? "right" : "left";
      context.fillText(seconds(hover), px + (px > width - 60 ? -5 : 5), 2);
    }
  }

  /**
   * What is repeated, between two brackets.
   * @param {CanvasRenderingContext2D} context
   * @param {(t: number) => number} x
   * @param {number} height
   */
  drawLoop(context, x, height) {
    const { loop } = this.span;
    if (!loop) return;
    const [from, to] = [x(loop.from), x(loop.to)];
    context.fillStyle = cssColour("bar");
    context.fillRect(from, 0, to - from, height);
    context.strokeStyle = cssColour("text");
    context.lineWidth = 2;
    for (const [edge, inwards] of [
      [from, 5],
      [to, -5],
    ]) {
      context.beginPath();
      context.moveTo(edge + inwards, 1);
      context.lineTo(edge + Math.sign(inwards), 1);
      context.lineTo(edge + Math.sign(inwards), height - 1);
      context.lineTo(edge + inwards, height - 1);
      context.stroke();
    }
  }

  /**
   * Which part of the recording is shown.
   * @param {CanvasRenderingContext2D} context
   * @param {{start_s: number, end_s: number}} time
   * @param {number} width
   * @param {number} height
   */
  drawOverview(context, time, width, height) {
    const { from, length } = this.span;
    const perSecond = width / (time.end_s - time.start_s);
    context.fillStyle = cssColour("line");
    context.fillRect(0, height - OVERVIEW_PX, width, OVERVIEW_PX);
    context.fillStyle = cssColour("text");
    const shown = Math.max(4, length * perSecond);
    const left = Math.min(width - shown, (from - time.start_s) * perSecond);
    context.fillRect(left, height - OVERVIEW_PX, shown, OVERVIEW_PX);
  }
}
