/** Recordings: contact over time, play, pause, step, speed, scrub, a link to the moment. */

import { byId, cssColour, fitCanvas, setText } from "./dom.js";
import { seconds } from "./format.js";
import { say } from "./wire.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 10];
/** While the pointer drags, a place is asked for at most so often. */
const SCRUB_MS = 50;

/** Height of the mark over frames whose recorded percepts differ. */
const DIFFERENCE_PX = 5;

export class Timeline {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./socket.js").Connection} connection
   */
  constructor(model, connection) {
    this.model = model;
    this.connection = connection;
    this.root = byId("timeline", HTMLElement);
    this.canvas = byId("timeline-canvas", HTMLCanvasElement);
    this.playButton = byId("play", HTMLButtonElement);
    this.time = byId("time", HTMLElement);
    this.speedBox = byId("speed", HTMLSelectElement);
    this.differences = byId("differences", HTMLElement);
    this.linkButton = byId("link", HTMLButtonElement);
    /** @type {number | null} */
    this.hover = null;
    this.dragging = false;
    /** Where the pointer was dragged to, until a frame from there comes. @type {number | null} */
    this.wanted = null;
    this.saidSeek = 0;
    this.timer = 0;
    this.playButton.addEventListener("click", () => this.togglePlay());
    byId("back-step", HTMLButtonElement).addEventListener("click", () => this.step(-1));
    byId("forward-step", HTMLButtonElement).addEventListener("click", () => this.step(1));
    byId("back-touch", HTMLButtonElement).addEventListener("click", () => this.toTouch(-1));
    byId("forward-touch", HTMLButtonElement).addEventListener("click", () => this.toTouch(1));
    this.linkButton.addEventListener("click", () => void this.copyLink());
    for (const speed of SPEEDS)
      this.speedBox.add(new Option(`${speed}×`, String(speed), speed === 1, speed === 1));
    this.speedBox.addEventListener("change", () => connection.send(say.speed(Number(this.speedBox.value))));
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.dragging = true;
      this.seek(this.timeAt(event.offsetX));
    });
    canvas.addEventListener("pointermove", (event) => {
      this.hover = this.timeAt(event.offsetX);
      if (this.dragging) this.seek(this.hover);
      this.draw();
    });
    canvas.addEventListener("pointerup", () => (this.dragging = false));
    canvas.addEventListener("pointercancel", () => (this.dragging = false));
    canvas.addEventListener("pointerleave", () => {
      this.hover = null;
      this.draw();
    });
    model.on("scene", () => this.begin());
    model.on("status", () => this.showStatus());
    model.on("timeline", () => this.draw());
  }

  get span() {
    return this.model.welcome?.time ?? null;
  }

  begin() {
    this.root.hidden = !this.span;
    document.documentElement.classList.toggle("recording", !!this.span);
    this.draw();
  }

  showStatus() {
    const { playing, speed } = this.model.status;
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

  /** @param {number} x */
  timeAt(x) {
    const time = this.span;
    if (!time) return 0;
    const part = Math.max(0, Math.min(1, x / this.canvas.clientWidth));
    return time.start_s + part * (time.end_s - time.start_s);
  }

  togglePlay() {
    if (this.span) this.connection.send(this.model.status.playing ? say.pause() : say.play());
  }

  /** @param {number} frames */
  step(frames) {
    if (this.span) this.connection.send(say.step(frames));
  }

  /**
   * The next faster or slower speed.
   * @param {number} by
   */
  faster(by) {
    if (!this.span) return;
    const at = SPEEDS.findIndex((speed) => speed >= this.model.status.speed);
    const next = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, (at < 0 ? SPEEDS.length - 1 : at) + by))];
    this.connection.send(say.speed(next));
  }

  /**
   * Pauses and goes to a moment.
   * @param {number} t
   */
  seek(t) {
    const time = this.span;
    if (!time) return;
    this.wanted = Math.max(time.start_s, Math.min(time.end_s, t));
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
    const time = this.span;
    const { peak } = this.model.timeline;
    if (!time || !peak.length) return;
    const bin = (time.end_s - time.start_s) / peak.length;
    const onsets = peak.flatMap((p, i) => (p !== null && (i === 0 || peak[i - 1] === null) ? [i] : []));
    const now = Math.floor(((this.model.frame?.t ?? time.start_s) - time.start_s) / bin + 1e-6);
    const next = way > 0 ? onsets.find((i) => i > now) : onsets.filter((i) => i < now).pop();
    // At the end of its part of the recording it has begun.
    if (next !== undefined) this.seek(time.start_s + (next + 0.999) * bin);
  }

  async copyLink() {
    const t = this.model.frame?.t;
    if (t === undefined || !this.span) return;
    history.replaceState(null, "", `${location.pathname}${location.search}#t=${Number(t.toFixed(6))}`);
    let done = "Link copied, without the token";
    try {
      await navigator.clipboard.writeText(location.href);
    } catch {
      done = "Link is in the address bar";
    }
    setText(this.linkButton, done);
    setTimeout(() => setText(this.linkButton, "Link"), 1600);
  }

  draw() {
    const time = this.span;
    if (!time) return;
    const now = this.model.frame?.t ?? time.start_s;
    setText(this.time, `${seconds(now)} / ${seconds(time.end_s)}`);
    const fitted = fitCanvas(this.canvas);
    if (!fitted) return;
    const { context, width, height } = fitted;
    const x = (/** @type {number} */ t) => ((t - time.start_s) / (time.end_s - time.start_s)) * width;
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
    const bin = width / Math.max(1, peak.length);
    peak.forEach((p, i) => {
      if (p === null || !(most > 0)) return;
      const h = 3 + (height - 8) * Math.sqrt(p / most);
      context.fillRect(i * bin, height - h, bin + 0.3, h);
    });
    context.fillStyle = cssColour("warn");
    differing.forEach((count, i) => {
      if (count > 0) context.fillRect(i * bin, 0, bin + 0.3, DIFFERENCE_PX);
    });
    this.showDifferences(differing);
    const at = x(now);
    context.fillStyle = cssColour("accent");
    context.fillRect(at - 1, 0, 2, height);
    context.beginPath();
    context.arc(at, 5, 5, 0, 2 * Math.PI);
    context.fill();
    if (this.hover !== null) {
      const px = x(this.hover);
      context.fillStyle = cssColour("text");
      context.fillRect(px, 0, 1, height);
      context.font = "11px system-ui, sans-serif";
      context.textBaseline = "top";
      context.textAlign = px > width - 60 ? "right" : "left";
      context.fillText(seconds(this.hover), px + (px > width - 60 ? -5 : 5), 2);
    }
  }
}
