/** Helpers for the document. Text from the server goes through `textContent` only. */

/** Tells listeners of a topic that something changed. */
export class Observed {
  constructor() {
    /** @type {Map<string, (() => void)[]>} */
    this.listeners = new Map();
  }

  /**
   * @param {string} topics one or several, with spaces between
   * @param {() => void} listener
   */
  on(topics, listener) {
    for (const topic of topics.split(" "))
      this.listeners.set(topic, [...(this.listeners.get(topic) ?? []), listener]);
  }

  /** @param {string} topic */
  tell(topic) {
    for (const listener of this.listeners.get(topic) ?? []) listener();
  }
}

/**
 * The element with an id, which must be of a class.
 * @template {Element} T
 * @param {string} id
 * @param {new () => T} kind
 * @returns {T}
 */
export function byId(id, kind) {
  const element = document.getElementById(id);
  if (!(element instanceof kind)) throw new Error(`The page has no ${kind.name} with the id ${id}.`);
  return element;
}

/**
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {string} [className]
 * @param {string} [text]
 * @returns {HTMLElementTagNameMap[K]}
 */
export function make(tag, className, text) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text !== undefined) element.textContent = text;
  return element;
}

/**
 * Sets the text of an element only where it differs, as layout costs time.
 * @param {Element} element
 * @param {string} text
 */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * Calls `work` at most once in `ms`, the last time included.
 * @param {number} ms
 * @param {() => void} work
 */
export function atMostEvery(ms, work) {
  let last = -Infinity;
  let waiting = false;
  return () => {
    if (waiting) return;
    const left = last + ms - performance.now();
    waiting = true;
    const go = () => {
      waiting = false;
      last = performance.now();
      work();
    };
    if (left <= 0) requestAnimationFrame(go);
    else setTimeout(() => requestAnimationFrame(go), left);
  };
}

/**
 * Fits a canvas to its element's size on the screen; gives its context, scaled to CSS pixels, or null while it is hidden.
 * @param {HTMLCanvasElement} canvas
 */
export function fitCanvas(canvas) {
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (!width || !height) return null;
  const ratio = Math.min(2, window.devicePixelRatio || 1);
  const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
  const context = canvas.getContext("2d");
  if (!context) return null;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

/**
 * Hands a file over to the browser's downloads.
 * @param {Blob} blob
 * @param {string} name
 */
export function saveFile(blob, name) {
  const link = make("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/**
 * A colour of the style sheet.
 * @param {string} name of the variable, without its dashes
 */
export function cssColour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** Colours that tell things apart, also for colour-blind people (after Okabe and Ito, then Tol). */
export const PALETTE = [
  [0x56, 0xb4, 0xe9],
  [0xe6, 0x9f, 0x00],
  [0x00, 0x9e, 0x73],
  [0x3b, 0x8c, 0xf0],
  [0xd5, 0x5e, 0x00],
  [0xcc, 0x79, 0xa7],
  [0xf0, 0xe4, 0x42],
  [0x44, 0xaa, 0x99],
  [0xaa, 0x44, 0x99],
  [0x99, 0x99, 0x33],
  [0x88, 0x88, 0xdd],
  [0xcc, 0x66, 0x77],
];

/** @param {number} index */
export function paletteColour(index) {
  return `rgb(${PALETTE[index % PALETTE.length].join(" ")})`;
}
