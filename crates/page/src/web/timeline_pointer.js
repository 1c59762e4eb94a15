/** The pointer on the timeline: a drag seeks, with Shift it chooses what is repeated, the wheel and two fingers zoom. */

/** A drag with Shift that is shorter repeats nothing, pixels. */
const LOOP_LEAST_PX = 4;

export class TimelinePointer {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {import("./span.js").Span} span
   * @param {(t: number) => void} seek
   * @param {() => void} draw
   */
  constructor(canvas, span, seek, draw) {
    this.canvas = canvas;
    this.span = span;
    this.seek = seek;
    /** The moment under the pointer. @type {number | null} */
    this.hover = null;
    /** Where a drag with Shift began. @type {{x: number, t: number} | null} */
    this.loopFrom = null;
    /** Pointers that are down, by their ids. @type {Map<number, number>} */
    this.down = new Map();
    canvas.addEventListener("pointerdown", (event) => this.begin(event));
    canvas.addEventListener("pointermove", (event) => {
      this.hover = this.timeAt(event.offsetX);
      this.move(event);
      draw();
    });
    canvas.addEventListener("pointerup", (event) => this.end(event));
    canvas.addEventListener("pointercancel", (event) => this.end(event));
    canvas.addEventListener("pointerleave", () => {
      this.hover = null;
      draw();
    });
    canvas.addEventListener("dblclick", () => span.showAll());
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
  }

  /** @param {number} x */
  timeAt(x) {
    const part = Math.max(0, Math.min(1, x / this.canvas.clientWidth));
    return this.span.from + part * this.span.length;
  }

  /** @param {PointerEvent} event */
  begin(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.down.set(event.pointerId, event.offsetX);
    const t = this.timeAt(event.offsetX);
    this.loopFrom = event.shiftKey && this.down.size === 1 ? { x: event.offsetX, t } : null;
    if (!this.loopFrom && this.down.size === 1) this.seek(t);
  }

  /** @param {PointerEvent} event */
  move(event) {
    const before = this.down.get(event.pointerId);
    if (before === undefined) return;
    const x = event.offsetX;
    this.down.set(event.pointerId, x);
    if (this.down.size === 2) {
      const [[, other]] = [...this.down].filter(([id]) => id !== event.pointerId);
      this.pinch(before, x, other);
    } else if (this.loopFrom) {
      if (Math.abs(x - this.loopFrom.x) >= LOOP_LEAST_PX) this.span.setLoop(this.loopFrom.t, this.timeAt(x));
    } else if (this.down.size === 1) this.seek(this.timeAt(x));
  }

  /**
   * Both fingers stay on their moments.
   * @param {number} before where the one that moves was, pixels
   * @param {number} now where it is
   * @param {number} other where the other one is
   */
  pinch(before, now, other) {
    if (Math.abs(now - other) < 10 || Math.abs(before - other) < 10) return;
    this.span.zoom((before - other) / (now - other), this.timeAt(other));
  }

  /** @param {PointerEvent} event */
  end(event) {
    const { loopFrom } = this;
    if (loopFrom && Math.abs(event.offsetX - loopFrom.x) < LOOP_LEAST_PX) this.span.setLoop(0, 0);
    this.loopFrom = null;
    this.down.delete(event.pointerId);
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    event.preventDefault();
    const { deltaX, deltaY } = event;
    const along = event.shiftKey && !deltaX ? deltaY : deltaX;
    if (Math.abs(along) > Math.abs(deltaY) || (event.shiftKey && along))
      this.span.pan((along / this.canvas.clientWidth) * this.span.length);
    else if (deltaY) this.span.zoom(Math.exp(deltaY * 0.0025), this.timeAt(event.offsetX));
  }
}
