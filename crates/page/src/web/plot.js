/** Draws one plot: lines over time in one unit. Each pixel shows the least and the most of its time, so no peak is lost. */

import { cssColour, fitCanvas } from "./dom.js";
import { scaleFor, short, tickText, ticks } from "./format.js";

/** @typedef {{colour: string, dash?: number[], period?: number, ring?: import("./plots.js").Ring,
 *   band?: {least: Float32Array, most: Float32Array}, points?: {t: number[], v: number[]}}} Line */
/** @typedef {{from: number, to: number, now: number, unit: string, quantity: string, live: boolean, pointer: number | null,
 *   until: number, spacing: number, bandRange: {from: number, to: number}}} How */

/** Dashes of lines of one colour in one plot. @type {number[][]} */
export const DASHES = [[], [5, 3], [1.5, 3], [8, 3, 1.5, 3]];

const EDGE = { left: 38, right: 6, top: 14, bottom: 17 };

/**
 * Least and most of each pixel, NaN where there is nothing.
 * @param {Line} line
 * @param {How} how
 * @param {number} pixels
 */
export function byPixel(line, how, pixels) {
  const least = new Float32Array(pixels).fill(NaN);
  const most = new Float32Array(pixels).fill(NaN);
  const put = (/** @type {number} */ x, /** @type {number} */ low, /** @type {number} */ high) => {
    if (low !== low || x < 0 || x >= pixels) return;
    if (!(least[x] <= low)) least[x] = low;
    if (!(most[x] >= high)) most[x] = high;
  };
  const perSecond = pixels / (how.to - how.from);
  /** Pixels that one sample stands for. */
  let reach = 1;
  if (line.points) {
    const { t, v } = line.points;
    for (let k = 0; k < t.length; k++)
      if (t[k] >= how.from && t[k] <= how.to)
        put(Math.min(pixels - 1, Math.floor((t[k] - how.from) * perSecond)), v[k], v[k]);
    reach = Math.max(1, 3 * perSecond * usualStep(t));
  } else if (how.live && line.ring) {
    const { t, v, begin, size } = line.ring;
    const mask = t.length - 1;
    let first = NaN;
    let count = 0;
    for (let k = size - 1; k >= 0; k--) {
      const at = (begin + k) & mask;
      if (t[at] < how.from) break;
      first = t[at];
      count++;
      put(Math.min(pixels - 1, Math.floor((t[at] - how.from) * perSecond)), v[at], v[at]);
    }
    if (count > 1) reach = (1.6 * perSecond * (how.to - first)) / count;
  } else if (line.band) {
    const bins = line.band.least.length;
    const width = (how.bandRange.to - how.bandRange.from) / bins;
    for (let i = 0; i < bins; i++) {
      const t = how.bandRange.from + (i + 0.5) * width;
      put(Math.floor((t - how.from) * perSecond), line.band.least[i], line.band.most[i]);
    }
    // A recording with fewer frames than pixels leaves bins empty between them.
    reach = 1.6 * Math.max(1, perSecond * how.spacing, perSecond * width);
  }
  return { least, most, reach };
}

/** Steps that are looked at to find the usual one. */
const STEPS_MAX = 200;

/**
 * The median of the newest steps between times.
 * @param {number[]} t ascending
 */
function usualStep(t) {
  const steps = t.slice(-STEPS_MAX).map((time, i, all) => (i ? time - all[i - 1] : 0));
  steps.shift();
  return steps.sort((a, b) => a - b)[steps.length >> 1] ?? 0;
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {Line[]} lines
 * @param {How} how
 */
export function drawPlot(canvas, lines, how) {
  const fitted = fitCanvas(canvas);
  if (!fitted) return;
  const { context, width, height } = fitted;
  const wide = Math.max(1, Math.floor(width - EDGE.left - EDGE.right));
  const high = height - EDGE.top - EDGE.bottom;
  const data = lines.map((line) => byPixel(line, how, wide));
  let [low, top] = [Infinity, -Infinity];
  for (const { least, most } of data)
    for (let x = 0; x < wide; x++)
      if (least[x] === least[x]) [low, top] = [Math.min(low, least[x]), Math.max(top, most[x])];
  const empty = !(top >= low);
  if (empty) [low, top] = [0, 1];
  const by = scaleFor(how.unit, Math.max(Math.abs(low), Math.abs(top)), how.quantity);
  if (low > 0) low = 0;
  if (top < 0) top = 0;
  if (top === low) top = low + 1 / by.factor;
  const marks = ticks(low * by.factor, top * by.factor, 3);
  const step = marks.length > 1 ? marks[1] - marks[0] : 1;
  const least = Math.floor((low * by.factor) / step + 1e-6) * step;
  const most = Math.max(Math.ceil((top * by.factor) / step - 1e-6) * step, least + step);
  const y = (/** @type {number} */ value) =>
    EDGE.top + high - ((value * by.factor - least) / (most - least)) * high;
  const x = (/** @type {number} */ t) => EDGE.left + ((t - how.from) / (how.to - how.from)) * wide;
  axes(context, width, height, { least, most, unit: by.unit }, how, x);
  context.save();
  context.beginPath();
  context.rect(EDGE.left, 0, wide, height);
  context.clip();
  data.forEach((one, i) => drawLine(context, one, lines[i], y));
  if (!how.live) {
    if (how.until < how.to) {
      context.fillStyle = cssColour("hatch");
      const from = Math.max(EDGE.left, x(how.until));
      context.fillRect(from, EDGE.top, EDGE.left + wide - from, high);
    }
    context.fillStyle = cssColour("accent");
    context.fillRect(Math.round(x(how.now)) - 0.5, EDGE.top - 3, 1.5, high + 3);
  }
  context.restore();
  if (how.pointer !== null) readOut(context, width, height, data, lines, how, by);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {ReturnType<typeof byPixel>} data
 * @param {Line} line
 * @param {(value: number) => number} y
 */
function drawLine(context, data, { colour, dash = [], period = Infinity }, y) {
  context.beginPath();
  for (const run of runsOf(data, period)) {
    let end = 0;
    run.forEach(({ x, low, high }, i) => {
      const px = EDGE.left + x + 0.5;
      const [bottom, top] = [y(low), y(high)];
      // From the nearer end of this pixel's range to the other.
      const ordered = Math.abs(end - bottom) < Math.abs(end - top) ? [bottom, top] : [top, bottom];
      if (i === 0) context.moveTo(px, ordered[0]);
      else context.lineTo(px, ordered[0]);
      context.lineTo(px, ordered[1] === ordered[0] ? ordered[0] + 0.01 : ordered[1]);
      end = ordered[1];
    });
  }
  context.setLineDash(dash);
  context.lineJoin = "round";
  context.lineWidth = 1.5;
  context.strokeStyle = colour;
  context.stroke();
  context.setLineDash([]);
}

/**
 * The pixels of a line, one list for each stretch that is drawn without a break. An angle that goes past its end comes back at
 * the other one, which is no motion through all that is between: there the line breaks.
 * @param {ReturnType<typeof byPixel>} data
 * @param {number} period of an angle; infinite for all else
 */
export function runsOf({ least, most, reach }, period) {
  /** @type {{x: number, low: number, high: number}[][]} */
  const runs = [];
  /** @type {{x: number, low: number, high: number} | undefined} */
  let last;
  for (let x = 0; x < least.length; x++) {
    const [low, high] = [least[x], most[x]];
    if (low !== low) continue;
    // What has both ends of an angle in one pixel has gone past its end.
    const isPast = high - low > period / 2;
    const follows =
      last &&
      x - last.x <= Math.max(1, reach) &&
      !isPast &&
      Math.max(low - last.high, last.low - high) <= period / 2;
    if (isPast) runs.push([{ x, low, high: low }], [{ x, low: high, high }]);
    else if (follows) runs[runs.length - 1].push({ x, low, high });
    else runs.push([{ x, low, high }]);
    last = isPast ? undefined : { x, low, high };
  }
  return runs;
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number} width
 * @param {number} height
 * @param {{least: number, most: number, unit: string}} range
 * @param {How} how
 * @param {(t: number) => number} x
 */
function axes(context, width, height, range, how, x) {
  const bottom = height - EDGE.bottom;
  const values = ticks(range.least, range.most, 3);
  context.font = "10px system-ui, sans-serif";
  context.fillStyle = cssColour("faint");
  context.strokeStyle = cssColour("grid");
  context.lineWidth = 1;
  context.beginPath();
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const value of values) {
    const part = (value - range.least) / (range.most - range.least);
    const py = Math.round(bottom - part * (bottom - EDGE.top)) + 0.5;
    context.moveTo(EDGE.left, py);
    context.lineTo(width - EDGE.right, py);
    context.fillText(tickText(value, values), EDGE.left - 5, py);
  }
  context.textBaseline = "alphabetic";
  context.textAlign = "center";
  const times = how.live ? ticks(how.from - how.to, 0, 5) : ticks(how.from, how.to, 5);
  for (const time of times) {
    const px = x(how.live ? how.to + time : time);
    if (px > width - 16 || px < EDGE.left + 6) continue;
    context.fillText(`${tickText(time, times)} s`, px, height - 4);
  }
  context.stroke();
  context.textAlign = "right";
  if (how.pointer === null) context.fillText(range.unit, width - EDGE.right, EDGE.top - 4);
}

/**
 * The values under the pointer.
 * @param {CanvasRenderingContext2D} context
 * @param {number} width
 * @param {number} height
 * @param {ReturnType<typeof byPixel>[]} data
 * @param {Line[]} lines
 * @param {How} how
 * @param {{factor: number, unit: string}} by
 */
function readOut(context, width, height, data, lines, how, by) {
  const px = (how.pointer ?? 0) * width;
  const at = Math.round(px - EDGE.left);
  if (at < 0 || at >= width - EDGE.left - EDGE.right) return;
  context.fillStyle = cssColour("faint");
  context.fillRect(px, EDGE.top, 1, height - EDGE.top - EDGE.bottom);
  const t = how.from + (at / (width - EDGE.left - EDGE.right)) * (how.to - how.from);
  const texts = [{ text: `${t.toFixed(2)} s`, colour: cssColour("faint") }];
  data.forEach((one, i) => {
    let near = -1;
    for (let d = 0; d <= Math.max(1, one.reach) && near < 0; d++)
      for (const x of [at - d, at + d]) if (one.most[x] === one.most[x]) near = x;
    if (near >= 0) texts.push({ text: short(one.most[near] * by.factor), colour: lines[i].colour });
  });
  context.font = "600 10px system-ui, sans-serif";
  const total = texts.reduce((sum, { text }) => sum + context.measureText(text).width + 8, 0);
  let x = Math.max(EDGE.left, Math.min(width - total, px - total / 2));
  context.textAlign = "left";
  context.fillStyle = cssColour("panel");
  context.fillRect(x - 3, 0, total, 12);
  for (const { text, colour } of texts) {
    context.fillStyle = colour;
    context.fillText(text, x, 9.5);
    x += context.measureText(text).width + 8;
  }
}
