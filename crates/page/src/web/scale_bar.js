/** In the corner of the picture: how long things are at the middle of the view, and where the world's axes point. */

import { cssColour, fitCanvas } from "./dom.js";
import { dot } from "./math.js";

/** The bar is at most so long, pixels. */
const LONGEST_PX = 96;
/** Length of an axis, pixels. */
const AXIS_PX = 19;
/** Axes of the world with their colours in the style sheet. @type {[string, import("./math.js").Vec3, string][]} */
const AXES = [
  ["x", [1, 0, 0], "axis-x"],
  ["y", [0, 1, 0], "axis-y"],
  ["z", [0, 0, 1], "axis-z"],
];

/**
 * The longest round length of at most `most` metres, with its text.
 * @param {number} most m
 */
export function roundLength(most) {
  const power = 10 ** Math.floor(Math.log10(Math.max(most, 1e-9)));
  const metres = ([5, 2, 1].find((digit) => digit * power <= most) ?? 1) * power;
  const mm = metres * 1e3;
  if (mm >= 1000) return { metres, text: `${Number(metres.toPrecision(1))} m` };
  return mm >= 10
    ? { metres, text: `${Number((mm / 10).toPrecision(1))} cm` }
    : { metres, text: `${Number(mm.toPrecision(1))} mm` };
}

export class ScaleBar {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {import("./camera.js").Camera} camera
   */
  constructor(canvas, camera) {
    this.canvas = canvas;
    this.camera = camera;
    this.drawn = "";
  }

  draw() {
    const { camera } = this;
    const key = [camera.version, cssColour("text")].join();
    if (key === this.drawn) return;
    const fitted = fitCanvas(this.canvas);
    if (!fitted) return;
    this.drawn = key;
    const { context, width, height } = fitted;
    context.lineCap = "round";
    context.lineJoin = "round";
    context.font = "600 11px system-ui, sans-serif";
    this.bar(context, width - 10, height - 12);
    this.axes(context, { x: 30, y: height - 30 });
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {number} right
   * @param {number} y
   */
  bar(context, right, y) {
    const { metres, text } = roundLength(LONGEST_PX * this.camera.metresPerPixel);
    const left = right - metres / this.camera.metresPerPixel;
    const path = new Path2D();
    path.moveTo(left, y - 4);
    path.lineTo(left, y);
    path.lineTo(right, y);
    path.lineTo(right, y - 4);
    for (const [width, colour] of /** @type {[number, string][]} */ ([
      [4, "halo"],
      [1.5, "text"],
    ])) {
      context.lineWidth = width;
      context.strokeStyle = cssColour(colour);
      context.stroke(path);
    }
    context.textAlign = "center";
    context.textBaseline = "bottom";
    this.text(context, text, (left + right) / 2, y - 5, cssColour("text"));
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {{x: number, y: number}} at
   */
  axes(context, at) {
    const { right, up, back } = this.camera;
    // The farthest first, so that nearer ones lie over it.
    const seen = AXES.map(([name, axis, colour]) => ({
      name,
      colour: cssColour(colour),
      x: AXIS_PX * dot(axis, right),
      y: -AXIS_PX * dot(axis, up),
      depth: dot(axis, back),
    })).sort((a, b) => a.depth - b.depth);
    context.textAlign = "center";
    context.textBaseline = "middle";
    for (const { name, colour, x, y, depth } of seen) {
      // One that points away is fainter.
      context.globalAlpha = depth < -0.2 ? 0.6 : 1;
      context.lineWidth = 2;
      context.strokeStyle = colour;
      context.beginPath();
      context.moveTo(at.x, at.y);
      context.lineTo(at.x + x, at.y + y);
      context.stroke();
      const size = Math.hypot(x, y);
      const beyond = size > 4 ? 1 + 8 / size : 0;
      this.text(context, name, at.x + beyond * x, at.y + beyond * y + (beyond ? 0 : -9), colour);
    }
    context.globalAlpha = 1;
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {string} text
   * @param {number} x
   * @param {number} y
   * @param {string} colour
   */
  text(context, text, x, y, colour) {
    context.lineWidth = 3;
    context.strokeStyle = cssColour("halo");
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
  }
}
