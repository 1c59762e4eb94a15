/**
 * The messages between the page and its server: types, decoders of the binary ones, builders of outgoing ones.
 * Nothing here touches the document, so it runs under node too.
 */

export const VERSION = 5;
/** Index of "no link": the world. */
export const NO_LINK = 0xffffffff;
/** Bit of a percept's `present`: its position is in the world, not in the frame of a link. */
export const IN_WORLD_BIT = 63;
/** States of a board: those of `BoardState` in Rust, in its order and words. */
export const BOARD_STATES = ["awaited", "speaking", "silent", "unplugged"];
/** The state of a board that sends frames. */
export const SPEAKING = BOARD_STATES[1];
/** Names of the states of a taxel, by number. */
export const HEALTH = [
  "good",
  "missing",
  "stale",
  "faulty",
  "saturated",
  "out of range",
  "left out",
  "not sent",
];

/**
 * @typedef {{kind: "plane" | "geodesic", origin: number[], u: number[], v: number[], normal: number[], uv: number[][]}} Chart
 * @typedef {{name: string, letter: string | null, sense: import("./senses.js").Sense, label: string, parent: number | null, link: number, members: number[],
 *   weights: number[] | null, chart: Chart | null, no_chart: string | null}} Field
 * @typedef {{name: string, unit: string, components: number, help: string, sense: import("./senses.js").Sense}} Column
 * @typedef {{max: number, from: string}} Scale
 * @typedef {{type: "welcome", version: number, somatic: string, run: string, mode: "recording" | "live", body: string,
 *   source: string, backend: {name: string, device: string, why: string}, quantity: string, scale: Scale,
 *   time: {start_s: number, end_s: number, frames: number} | null, origin: number[],
 *   links: {name: string, parent: number | null}[], channels: ([string | number, number] | null)[] | null, fields: Field[],
 *   columns: Column[], flags: (string | null)[], touches: boolean, touch_flags: (string | null)[], self_contacts: boolean,
 *   colours: number[][], senses: import("./senses.js").SensesOfWelcome | null}} Welcome
 * @typedef {{position: Float32Array, normal: Float32Array, link: Uint32Array, corners: Uint32Array, taxelId: Uint32Array,
 *   taxelLink: Uint32Array, taxelPosition: Float32Array, taxelNormal: Float32Array, taxelRadius: Float32Array,
 *   taxelArea: Float32Array, restPose: Float32Array}} Mesh
 * @typedef {{field: Uint32Array, flags: Uint32Array, present: Uint32Array, columns: Map<number, Float32Array>}} Percepts
 *   `present` has two words a percept, the lower bits first
 * @typedef {{index: number, share: number}} Share
 * @typedef {{ago: number, frame: number, position: number[]}} TrailPoint
 * @typedef {{id: number, link: number, frame: number, flags: number, active: number, age: number, total: number, force: number,
 *   peak: number, anisotropy: number, position: number[], normal: number[], axis: number[], spread: number[],
 *   velocity: number[], place: number[], placeSigma: number[], taxels: Uint32Array, links: Share[], fields: Share[], trail: TrailPoint[]}} Touch
 * @typedef {{link: number, touch: number, total: number}} SelfContactSide
 * @typedef {{identity: number, sides: [SelfContactSide, SelfContactSide], position: [number, number, number], distance: number,
 *   angle: number}} SelfContact
 * @typedef {{known: boolean, list: SelfContact[]}} SelfContacts
 * @typedef {{answers: number, t: Float64Array, values: Float32Array[]}} Samples
 * @typedef {{seq: number, frame: number, t: number, skipped: number, p50: number, p99: number, newestEvent: number,
 *   engineMicroseconds: number, pressure: Float32Array | null, health: Uint8Array | null, shear: Float32Array | null, pose: Float32Array | null,
 *   percepts: Percepts | null, touches: Touch[] | null, selfContacts: SelfContacts | null, samples: Samples | null}} Frame
 * @typedef {{id: number, from: number, to: number, bins: number, least: Float32Array[], most: Float32Array[]}} History
 * @typedef {{id: number, from: number, to: number, peaks: Float32Array}} PeakMap
 * @typedef {{field: number, column: string, component: number}} Series
 * @typedef {{seq: number, t_s: number, kind: string, field: number | null, touch: number | null, link: number | null,
 *   text: string}} Event
 * @typedef {{name: string, state: string, rate_hz: number | null, frames: number, lost: number, age_s: number | null}} Board
 * @typedef {{type: "explain", field: number, frame: number, t_s: number, backend: string, flags: string[],
 *   members: {taxel: number, raw: number | null, pressure: number | null}[],
 *   columns: {name: string, value: number[] | null, reference: number[] | null, bound: number | null, verdict: string,
 *     recorded: {value: number[] | null} | null}[],
 *   error?: string}} Explanation
 * @typedef {{type: "taxel", taxel: number, t_s: number, raw: number | null, pressure: number | null, health: string}} TaxelValue
 */

/** Takes typed arrays off a buffer one after the other. */
class Reader {
  /**
   * @param {ArrayBuffer} buffer
   * @param {number} offset
   */
  constructor(buffer, offset) {
    this.buffer = buffer;
    this.offset = offset;
  }

  /** @param {number} bytes */
  advance(bytes) {
    const from = this.offset;
    if (from + bytes > this.buffer.byteLength) throw new Error("The message ends too early.");
    this.offset += bytes;
    return from;
  }

  /** @param {number} count */
  f32(count) {
    return new Float32Array(this.buffer, this.advance(4 * count), count);
  }

  /** @param {number} count */
  f64(count) {
    return new Float64Array(this.buffer, this.advance(8 * count), count);
  }

  /** @param {number} count */
  u32(count) {
    return new Uint32Array(this.buffer, this.advance(4 * count), count);
  }

  /** @param {number} count */
  u8(count) {
    return new Uint8Array(this.buffer, this.advance(count), count);
  }

  /** Goes on to the next multiple of 8. */
  pad() {
    this.offset = Math.min((this.offset + 7) & ~7, this.buffer.byteLength);
  }
}

/**
 * The kind of a binary message.
 * @param {ArrayBuffer} buffer
 */
export function kindOf(buffer) {
  const view = new DataView(buffer);
  if (view.byteLength < 20) throw new Error("The message is too short.");
  const version = view.getUint8(1);
  if (version !== VERSION) throw new Error(`The message has version ${version}; this page reads ${VERSION}.`);
  return view.getUint8(0);
}

/**
 * @param {ArrayBuffer} buffer
 * @returns {Mesh}
 */
export function decodeMesh(buffer) {
  const view = new DataView(buffer);
  const [vertices, triangles, taxels, links] = [4, 8, 12, 16].map((at) => view.getUint32(at, true));
  const from = new Reader(buffer, 20);
  return {
    position: from.f32(3 * vertices),
    normal: from.f32(3 * vertices),
    link: from.u32(vertices),
    corners: from.u32(3 * triangles),
    taxelId: from.u32(taxels),
    taxelLink: from.u32(taxels),
    taxelPosition: from.f32(3 * taxels),
    taxelNormal: from.f32(3 * taxels),
    taxelRadius: from.f32(taxels),
    taxelArea: from.f32(taxels),
    restPose: from.f32(7 * links),
  };
}

const PRESSURE = 1;
const POSE = 2;
const PERCEPTS = 4;
const TOUCHES = 8;
const SERIES = 16;
const SELF_CONTACTS = 32;
const SHEARS = 64;
/** Bytes of a frame's head. */
const HEAD_BYTES = 72;
/** In place of the number of self-contacts that are not known. */
const UNKNOWN = 0xffffffff;

/**
 * @param {ArrayBuffer} buffer
 * @param {{taxels: number, pulled?: number, links: number, components: number[]}} scene numbers of taxels, of those with three axes,
 *   and of links; components by column
 * @returns {Frame}
 */
export function decodeFrame(buffer, scene) {
  const view = new DataView(buffer);
  if (view.byteLength < HEAD_BYTES) throw new Error("The frame is too short.");
  const sections = view.getUint16(2, true);
  const [fields, touches, samples] = [36, 40, 44].map((at) => view.getUint32(at, true));
  /** @type {Frame} */
  const frame = {
    seq: view.getUint32(4, true),
    frame: Number(view.getBigUint64(8, true)),
    t: view.getFloat64(16, true),
    skipped: view.getUint32(24, true),
    p50: view.getFloat32(28, true),
    p99: view.getFloat32(32, true),
    newestEvent: view.getUint32(48, true),
    engineMicroseconds: view.getFloat32(56, true),
    pressure: null,
    health: null,
    shear: null,
    pose: null,
    percepts: null,
    touches: null,
    selfContacts: null,
    samples: null,
  };
  const from = new Reader(buffer, HEAD_BYTES);
  if (sections & PRESSURE) {
    frame.pressure = from.f32(scene.taxels);
    frame.health = from.u8(scene.taxels);
    from.pad();
  }
  if (sections & SHEARS) frame.shear = from.f32(2 * (scene.pulled ?? 0));
  if (sections & POSE) {
    frame.pose = from.f32(7 * scene.links);
    from.pad();
  }
  if (sections & PERCEPTS) {
    frame.percepts = {
      field: from.u32(fields),
      flags: from.u32(fields),
      present: from.u32(2 * fields),
      columns: new Map(),
    };
    const carried = [64, 68].map((at) => view.getUint32(at, true));
    scene.components.forEach((components, column) => {
      if ((carried[column >>> 5] >>> (column & 31)) & 1)
        frame.percepts?.columns.set(column, from.f32(components * fields));
    });
    from.pad();
  }
  if (sections & TOUCHES) {
    frame.touches = [];
    for (let i = 0; i < touches; i++) frame.touches.push(touch(from));
    from.pad();
  }
  if (sections & SELF_CONTACTS) {
    const [number] = from.u32(1);
    const known = number !== UNKNOWN;
    frame.selfContacts = { known, list: [] };
    for (let i = 0; known && i < number; i++) frame.selfContacts.list.push(contact(from));
    from.pad();
  }
  if (sections & SERIES) {
    const t = from.f64(samples);
    const values = [];
    // The last section: as many series as fit, but padding of one f32 may look like one more sample.
    const count = samples ? Math.floor((buffer.byteLength - from.offset) / (4 * samples)) : 0;
    for (let i = 0; i < count; i++) values.push(from.f32(samples));
    frame.samples = { answers: view.getUint32(52, true), t, values };
  }
  return frame;
}

/**
 * Whether a bit of a percept's `present` is set: that of a column, or `IN_WORLD_BIT`.
 * @param {Percepts} percepts
 * @param {number} k which of them
 * @param {number} bit
 */
export function isPresent({ present }, k, bit) {
  return ((present[2 * k + (bit >>> 5)] >>> (bit & 31)) & 1) === 1;
}

/**
 * @param {Reader} from
 * @returns {Touch}
 */
function touch(from) {
  const [id, link, frame, flags, active, taxels, links, fields, points] = from.u32(9);
  const values = from.f32(24);
  const [age, total, force, peak, anisotropy] = values;
  const part = (/** @type {number} */ at, /** @type {number} */ count) => [
    ...values.subarray(at, at + count),
  ];
  const share = () => ({ index: from.u32(1)[0], share: from.f32(1)[0] });
  const point = () => ({ ago: from.f32(1)[0], frame: from.u32(1)[0], position: [...from.f32(3)] });
  return {
    id,
    link,
    frame,
    flags,
    active,
    age,
    total,
    force,
    peak,
    anisotropy,
    position: part(5, 3),
    normal: part(8, 3),
    axis: part(11, 3),
    spread: part(14, 2),
    velocity: part(16, 3),
    place: part(19, 3),
    placeSigma: part(22, 2),
    taxels: from.u32(taxels),
    links: Array.from({ length: links }, share),
    fields: Array.from({ length: fields }, share),
    trail: Array.from({ length: points }, point),
  };
}

/**
 * @param {Reader} from
 * @returns {SelfContact}
 */
function contact(from) {
  const [identity] = from.u32(1);
  const side = () => {
    const [link, touch] = from.u32(2);
    const [total] = from.f32(1);
    return { link, touch, total };
  };
  /** @type {[SelfContactSide, SelfContactSide]} */
  const sides = [side(), side()];
  const [x, y, z, distance, angle] = from.f32(5);
  return { identity, sides, position: [x, y, z], distance, angle };
}

/**
 * @param {ArrayBuffer} buffer
 * @returns {History}
 */
export function decodeHistory(buffer) {
  const view = new DataView(buffer);
  const [id, bins, series] = [4, 8, 12].map((at) => view.getUint32(at, true));
  const from = new Reader(buffer, 32);
  /** @type {History} */
  const history = {
    id,
    bins,
    from: view.getFloat64(16, true),
    to: view.getFloat64(24, true),
    least: [],
    most: [],
  };
  for (let i = 0; i < series; i++) {
    history.least.push(from.f32(bins));
    history.most.push(from.f32(bins));
  }
  return history;
}

/**
 * @param {ArrayBuffer} buffer
 * @returns {PeakMap}
 */
export function decodePeaks(buffer) {
  const view = new DataView(buffer);
  const [id, from, to] = [view.getUint32(4, true), view.getFloat64(8, true), view.getFloat64(16, true)];
  return { id, from, to, peaks: new Float32Array(buffer, 24) };
}

/** Outgoing messages. */
export const say = {
  /**
   * @param {string} token
   * @param {number | null} after newest event that the page holds
   */
  hello: (token, after) => JSON.stringify({ type: "hello", version: VERSION, token, after_event: after }),
  /** @param {number} seq */
  drawn: (seq) => JSON.stringify({ type: "drawn", seq }),
  /** @param {string[]} columns */
  columns: (columns) => JSON.stringify({ type: "columns", columns }),
  /** @param {Series[]} series */
  series: (series) => JSON.stringify({ type: "series", series }),
  play: () => JSON.stringify({ type: "play" }),
  pause: () => JSON.stringify({ type: "pause" }),
  /** @param {number} t_s */
  seek: (t_s) => JSON.stringify({ type: "seek", t_s }),
  /** @param {number} frames */
  step: (frames) => JSON.stringify({ type: "step", frames }),
  /** @param {number} frame */
  show: (frame) => JSON.stringify({ type: "show", frame }),
  /** @param {number} speed */
  speed: (speed) => JSON.stringify({ type: "speed", speed }),
  /** @param {number | null} taxel */
  taxel: (taxel) => JSON.stringify({ type: "taxel", taxel }),
  /** @param {number} field */
  explain: (field) => JSON.stringify({ type: "explain", field }),
  /**
   * @param {number} id
   * @param {number} from_s
   * @param {number} to_s
   * @param {number} bins
   * @param {Series[]} series
   */
  history: (id, from_s, to_s, bins, series) =>
    JSON.stringify({ type: "history", id, from_s, to_s, bins, series }),
  /**
   * @param {number} id
   * @param {number} from_s
   * @param {number} to_s
   */
  peaks: (id, from_s, to_s) => JSON.stringify({ type: "peaks", id, from_s, to_s }),
};
