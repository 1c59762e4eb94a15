/** Which parts of the picture have changed: a few rectangles that hold all changed taxels. */

/** @typedef {{x0: number, y0: number, x1: number, y1: number}} Rect pixels, from the top left */

/**
 * @param {Rect} a
 * @param {Rect} b
 * @returns {Rect}
 */
const around = (a, b) => ({
  x0: Math.min(a.x0, b.x0),
  y0: Math.min(a.y0, b.y0),
  x1: Math.max(a.x1, b.x1),
  y1: Math.max(a.y1, b.y1),
});

/** @param {Rect} r */
const areaOf = (r) => (r.x1 - r.x0) * (r.y1 - r.y0);

/**
 * Adds a rectangle; where there are more than `most`, the two are joined that waste least.
 * @param {Rect[]} rects
 * @param {Rect} added
 * @param {number} most
 */
export function addRect(rects, added, most) {
  rects.push(added);
  while (rects.length > most) {
    let [best, left, right] = [Infinity, 0, 1];
    for (let i = 0; i < rects.length; i++)
      for (let k = i + 1; k < rects.length; k++) {
        const waste = areaOf(around(rects[i], rects[k])) - areaOf(rects[i]) - areaOf(rects[k]);
        if (waste < best) [best, left, right] = [waste, i, k];
      }
    rects[left] = around(rects[left], rects[right]);
    rects.splice(right, 1);
  }
}

/** Where more taxels have changed than this, one rectangle holds all: looking for several would take longer than drawing more. */
const MANY = 400;

/**
 * The parts of the picture where taxels look different from before.
 * @param {Uint8Array} before four bytes a taxel
 * @param {Uint8Array} now
 * @param {Pick<import("./spots.js").Spots, "x" | "y" | "reach" | "rectOf">} spots where taxels are in the picture
 * @param {{width: number, height: number, rects: number}} limits
 * @returns {Rect[]}
 */
export function changedRects(before, now, spots, limits) {
  const [a, b] = [new Uint32Array(before.buffer), new Uint32Array(now.buffer)];
  const { x, y, reach } = spots;
  /** @type {Rect[]} */
  let rects = [];
  const all = { x0: Infinity, y0: Infinity, x1: -Infinity, y1: -Infinity };
  let changed = 0;
  for (let taxel = 0; taxel < reach.length; taxel++) {
    const far = reach[taxel];
    if (a[taxel] === b[taxel] || far === 0) continue;
    changed++;
    if (changed <= MANY) addRect(rects, spots.rectOf(taxel), limits.rects);
    all.x0 = Math.min(all.x0, x[taxel] - far);
    all.y0 = Math.min(all.y0, y[taxel] - far);
    all.x1 = Math.max(all.x1, x[taxel] + far);
    all.y1 = Math.max(all.y1, y[taxel] + far);
  }
  if (changed > MANY) rects = [all];
  return rects
    .map((r) => ({
      x0: Math.max(0, Math.floor(r.x0)),
      y0: Math.max(0, Math.floor(r.y0)),
      x1: Math.min(limits.width, Math.ceil(r.x1)),
      y1: Math.min(limits.height, Math.ceil(r.y1)),
    }))
    .filter((r) => r.x1 > r.x0 && r.y1 > r.y0);
}
