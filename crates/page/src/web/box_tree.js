/** A tree of boxes around things in space. A line finds the things near it without a look at all of them. */

import { toLink } from "./math.js";

/** @typedef {import("./math.js").Vec3} Vec3 */

/** The most things in a box that is not divided further. */
const LEAF_MAX = 4;
/** Boxes are wider than their things by this share of the largest coordinate: more than rounding to single precision. */
const SLACK = 1e-6;

export class BoxTree {
  /**
   * @param {Float32Array} boxes least x, y, z and greatest x, y, z of each thing; the tree may have a part of them
   * @param {Iterable<number>} things those of the tree
   */
  constructor(boxes, things) {
    /** Things in the order of the boxes that have them. */
    this.order = Int32Array.from(things);
    const { length } = this.order;
    /** By node, parents first: the node after all of its descendants. */
    this.next = new Int32Array(2 * length);
    /** By node: where its things begin in `order`, and how many there are; none where it has two nodes below. */
    this.begin = new Int32Array(2 * length);
    this.count = new Uint8Array(2 * length);
    this.nodes = 0;
    if (length) this.divide(0, length, boxes);
    /** By node, like `boxes`. */
    this.boxes = new Float32Array(6 * this.nodes);
    this.slack = 0;
    this.fit(boxes);
  }

  /**
   * Adds the node of some things and those below it.
   * @param {number} begin in `order`
   * @param {number} end
   * @param {Float32Array} boxes
   */
  divide(begin, end, boxes) {
    const node = this.nodes++;
    if (end - begin <= LEAF_MAX) {
      this.begin[node] = begin;
      this.count[node] = end - begin;
    } else {
      const middle = this.halve(begin, end, boxes);
      this.divide(begin, middle, boxes);
      this.divide(middle, end, boxes);
    }
    this.next[node] = this.nodes;
  }

  /**
   * Sorts things into those on either side of the middle of their longest axis; gives where the second ones begin.
   * @param {number} begin
   * @param {number} end
   * @param {Float32Array} boxes
   */
  halve(begin, end, boxes) {
    const { order } = this;
    // Twice the centres of the boxes: they are only compared.
    let [axis, extent, middle] = [0, -1, 0];
    for (let k = 0; k < 3; k++) {
      let least = Infinity;
      let most = -Infinity;
      for (let i = begin; i < end; i++) {
        const at = boxes[6 * order[i] + k] + boxes[6 * order[i] + 3 + k];
        if (at < least) least = at;
        if (at > most) most = at;
      }
      if (most - least > extent) [axis, extent, middle] = [k, most - least, (least + most) / 2];
    }
    let split = begin;
    for (let i = begin; i < end; i++) {
      const thing = order[i];
      if (!(boxes[6 * thing + axis] + boxes[6 * thing + 3 + axis] < middle)) continue;
      order[i] = order[split];
      order[split++] = thing;
    }
    return split > begin && split < end ? split : (begin + end) >> 1;
  }

  /**
   * Puts the boxes around the things where these are now. Which things share a box stays as it was.
   * @param {Float32Array} boxes
   */
  fit(boxes) {
    const { begin, count, next, order } = this;
    const own = this.boxes;
    // What lies below a node comes after it.
    for (let node = this.nodes - 1; node >= 0; node--) {
      const things = count[node];
      const at = 6 * node;
      if (!things) {
        join(own, at, own, at + 6, own, 6 * next[node + 1]);
        continue;
      }
      const first = 6 * order[begin[node]];
      join(own, at, boxes, first, boxes, 6 * order[begin[node] + things - 1]);
      for (let i = 1; i < things - 1; i++) join(own, at, own, at, boxes, 6 * order[begin[node] + i]);
    }
    this.slack = SLACK * own.subarray(0, 6).reduce((most, at) => Math.max(most, Math.abs(at)), 0);
  }

  /**
   * Looks at every thing that a line may meet, and at some others near it; gives where the line ends then.
   * @param {ArrayLike<number>} from
   * @param {ArrayLike<number>} way
   * @param {number} until the line ends at `from` + `until` × `way`
   * @param {(thing: number, until: number) => number} look gives where the line ends from now on; a negative number ends the search
   * @param {number} [spread] how wide the line grows for each metre along a `way` of length 1
   */
  along(from, way, until, look, spread = 0) {
    const { boxes, begin, count, next, order } = this;
    for (let node = 0; node < this.nodes;) {
      if (!meetsBox(boxes, 6 * node, from, way, until, this.slack, spread)) {
        node = next[node];
        continue;
      }
      for (let i = begin[node]; i < begin[node] + count[node]; i++) {
        until = look(order[i], until);
        if (until < 0) return until;
      }
      node++;
    }
    return until;
  }
}

/** Trees of the things on each link, in the frame of that link: they stay as they are when links move. */
export class LinkTrees {
  /**
   * @param {Float32Array} boxes of the things, each in the frame of its link
   * @param {ArrayLike<number>} links of the things
   */
  constructor(boxes, links) {
    /** @type {Map<number, number[]>} */
    const things = new Map();
    for (let thing = 0; thing < links.length; thing++) {
      const link = links[thing];
      const known = things.get(link);
      if (known) known.push(thing);
      else things.set(link, [thing]);
    }
    /** By link. */
    this.trees = new Map([...things].map(([link, own]) => [link, new BoxTree(boxes, own)]));
  }

  /**
   * As `BoxTree.along`, of a line in the world.
   * @param {Float32Array} rows of the links
   * @param {Vec3} from
   * @param {Vec3} way
   * @param {number} until
   * @param {(thing: number, until: number, from: Vec3, way: Vec3) => number} look gets the line in the frame of the thing's link, too
   * @param {number} [spread]
   */
  along(rows, from, way, until, look, spread = 0) {
    for (const [link, tree] of this.trees) {
      const [near, there] = [toLink(rows, link, from, 1), toLink(rows, link, way, 0)];
      const lookThere = (/** @type {number} */ thing, /** @type {number} */ end) =>
        look(thing, end, near, there);
      until = tree.along(near, there, until, lookThere, spread);
      if (until < 0) return;
    }
  }
}

/**
 * Writes the box around two boxes.
 * @param {Float32Array} out
 * @param {number} at where in it
 * @param {Float32Array} a
 * @param {number} atA where the first one is in these
 * @param {Float32Array} b
 * @param {number} atB
 */
function join(out, at, a, atA, b, atB) {
  for (let k = 0; k < 3; k++) {
    out[at + k] = Math.min(a[atA + k], b[atB + k]);
    out[at + 3 + k] = Math.max(a[atA + 3 + k], b[atB + 3 + k]);
  }
}

/**
 * Whether a line may meet a box that is wider by `slack`.
 * @param {Float32Array} boxes
 * @param {number} at where the box is in these
 * @param {ArrayLike<number>} from
 * @param {ArrayLike<number>} way
 * @param {number} until
 * @param {number} slack
 * @param {number} spread
 */
function meetsBox(boxes, at, from, way, until, slack, spread) {
  if (spread > 0) {
    let deepest = 0;
    for (let k = 0; k < 3; k++)
      deepest += Math.max((boxes[at + k] - from[k]) * way[k], (boxes[at + 3 + k] - from[k]) * way[k]);
    if (deepest < -slack) return false;
    slack += spread * Math.max(0, deepest);
  }
  let [enters, leaves] = [0, until];
  for (let k = 0; k < 3; k++) {
    const [least, most] = [boxes[at + k] - slack - from[k], boxes[at + 3 + k] + slack - from[k]];
    if (way[k] === 0) {
      if (least > 0 || most < 0) return false;
      continue;
    }
    const [a, b] = [least / way[k], most / way[k]];
    enters = Math.max(enters, Math.min(a, b));
    leaves = Math.min(leaves, Math.max(a, b));
  }
  return enters <= leaves;
}
