/** What the page knows: the scene, the newest frame, events. It changes only by messages from the server. */

import { Observed } from "./dom.js";
import { withUnit } from "./format.js";
import { poseToRows } from "./math.js";
import { HEALTH, IN_WORLD_BIT } from "./wire.js";

/** @typedef {import("./wire.js").Welcome} Welcome */
/** @typedef {import("./wire.js").Frame} Frame */

/** Events that the page keeps. */
const EVENTS_MAX = 1000;

/** Flags that explain why a column is absent, the likeliest first; other columns look at all flags. */
const MOTION = ["no_chart", "no_previous", "bad_dt", "held", "jumped"];
/** @type {Record<string, string[]>} */
const REASONS = {
  centroid: ["no_chart"],
  orientation: ["no_chart", "one_taxel", "coincident"],
  principal_axis: ["no_chart", "one_taxel", "coincident", "isotropic"],
  anisotropy: ["no_chart", "one_taxel", "coincident"],
  displacement: MOTION,
  distance: MOTION,
  speed: MOTION,
  radial_distance: MOTION,
  radial_speed: MOTION,
  direction: [...MOTION, "still"],
};

export class Model extends Observed {
  constructor() {
    super();
    /** @type {Welcome | null} */
    this.welcome = null;
    /** @type {import("./wire.js").Mesh | null} */
    this.mesh = null;
    /** @type {Map<string, number>} */
    this.columnIndex = new Map();
    /** Matrices of the links, 3×4. */
    this.rows = new Float32Array(0);
    /** Counts changes of poses. */
    this.poseVersion = 0;
    /** @type {Float32Array} */
    this.pressure = new Float32Array(0);
    /** @type {Uint8Array} */
    this.health = new Uint8Array(0);
    /** @type {import("./wire.js").Percepts | null} */
    this.percepts = null;
    /** Where a field in contact stands in `percepts`. @type {Map<number, number>} */
    this.inContact = new Map();
    /** Touches of the whole body, the oldest first. @type {import("./wire.js").Touch[]} */
    this.touches = [];
    /** Colours of touches, by their ids: one keeps its own from onset to release. @type {Map<number, number>} */
    this.touchColours = new Map();
    /** Touches of two links at one place. @type {import("./wire.js").SelfContacts} */
    this.selfContacts = noSelfContacts();
    /** The newest frame's head. @type {Frame | null} */
    this.frame = null;
    /** @type {import("./wire.js").Scale} */
    this.scale = { max: 1, from: "" };
    /** Largest pressure since autoscale began; null while the scale is fixed. @type {number | null} */
    this.autoscale = null;
    /** @type {import("./wire.js").Event[]} */
    this.events = [];
    this.eventsLost = 0;
    /** @type {number | null} */
    this.newestEvent = null;
    /** @type {import("./wire.js").Board[]} */
    this.boards = [];
    this.status = { playing: false, speed: 1, at_end: false };
    this.timeline = noTimeline();
    /** Why the source has ended. @type {string | null} */
    this.ended = null;
    /** @type {import("./wire.js").TaxelValue | null} */
    this.taxelValue = null;
    /** @type {import("./wire.js").Explanation | null} */
    this.explanation = null;
    /** @type {import("./wire.js").History | null} */
    this.history = null;
    /** The newest samples of the series that are plotted. @type {import("./wire.js").Samples | null} */
    this.samples = null;
    /** @type {{state: "connecting" | "open" | "silent" | "lost", since: Date, reason: string}} */
    this.connection = { state: "connecting", since: new Date(), reason: "" };
  }

  /** Pressure at the upper end of the colours. */
  get scaleMax() {
    return this.autoscale ?? this.scale.max;
  }

  get quantity() {
    return this.welcome?.quantity ?? "count";
  }

  /** @param {Welcome} welcome */
  begin(welcome) {
    const sameRun = this.welcome?.run === welcome.run;
    this.welcome = welcome;
    this.columnIndex = new Map(welcome.columns.map((column, i) => [column.name, i]));
    this.scale = welcome.scale;
    this.percepts = null;
    this.inContact = new Map();
    this.setTouches([]);
    this.selfContacts = noSelfContacts();
    this.frame = null;
    this.boards = [];
    this.ended = null;
    this.timeline = noTimeline();
    if (!sameRun) this.forgetEvents();
  }

  forgetEvents() {
    this.events = [];
    this.eventsLost = 0;
    this.newestEvent = null;
    this.tell("events");
  }

  /** @param {import("./wire.js").Mesh} mesh */
  setMesh(mesh) {
    this.mesh = mesh;
    const taxels = mesh.taxelId.length;
    this.pressure = new Float32Array(taxels).fill(NaN);
    this.health = new Uint8Array(taxels).fill(HEALTH.indexOf("missing"));
    this.rows = new Float32Array((mesh.restPose.length / 7) * 12);
    this.pose(mesh.restPose);
    this.tell("scene");
  }

  /** @param {Float32Array} poses */
  pose(poses) {
    for (let link = 0; link < poses.length / 7; link++) poseToRows(poses, link, this.rows);
    this.poseVersion++;
  }

  /** @param {Frame} frame */
  apply(frame) {
    this.frame = frame;
    if (frame.pressure && frame.health) {
      this.pressure = frame.pressure;
      this.health = frame.health;
      if (this.autoscale !== null) this.autoscale = Math.max(this.autoscale, this.largestPressure());
    }
    if (frame.pose) this.pose(frame.pose);
    if (frame.percepts) {
      this.percepts = frame.percepts;
      this.inContact = new Map(Array.from(frame.percepts.field, (field, k) => [field, k]));
    }
    if (frame.touches) this.setTouches(frame.touches);
    if (frame.selfContacts) {
      this.selfContacts = frame.selfContacts;
      this.tell("selfContacts");
    }
    if (frame.samples) {
      this.samples = frame.samples;
      this.tell("samples");
    }
    this.tell("frame");
  }

  /** @param {import("./wire.js").Touch[]} touches */
  setTouches(touches) {
    this.touches = touches;
    const present = new Set(touches.map((touch) => touch.id));
    for (const id of this.touchColours.keys()) if (!present.has(id)) this.touchColours.delete(id);
    for (const id of present) {
      if (this.touchColours.has(id)) continue;
      const used = new Set(this.touchColours.values());
      let free = 0;
      while (used.has(free)) free++;
      this.touchColours.set(id, free);
    }
  }

  /**
   * The number of a touch's colour in the palette.
   * @param {number} id
   */
  touchColour(id) {
    return this.touchColours.get(id) ?? 0;
  }

  /** @param {number | null} id */
  touch(id) {
    return this.touches.find((touch) => touch.id === id) ?? null;
  }

  /**
   * The touch that a taxel is part of.
   * @param {number} taxel
   */
  touchOf(taxel) {
    return this.touches.find((touch) => touch.taxels.includes(taxel)) ?? null;
  }

  /**
   * How hard it presses as text: its force where that is known, else the sum of its pressures.
   * @param {import("./wire.js").Touch} touch
   */
  touchLoadText(touch) {
    if (Number.isFinite(touch.force)) return withUnit(touch.force, "N", this.quantity);
    return withUnit(touch.total, "P", this.quantity);
  }

  /**
   * Names of a touch's flags.
   * @param {import("./wire.js").Touch} touch
   */
  touchFlags(touch) {
    const names = this.welcome?.touch_flags ?? [];
    return names.filter((name, bit) => name !== null && (touch.flags >>> bit) & 1).map(String);
  }

  largestPressure() {
    let most = 0;
    for (const p of this.pressure) if (p > most) most = p;
    return most;
  }

  /** @param {boolean} on */
  setAutoscale(on) {
    this.autoscale = on ? Math.max(this.largestPressure(), this.scale.max * 1e-3) : null;
    this.tell("scale");
  }

  /**
   * A text message, `welcome` excepted.
   * @param {any} message
   */
  receive(message) {
    switch (message.type) {
      case "scale":
        this.scale = { max: message.max, from: message.from };
        break;
      case "status":
        this.status = message;
        break;
      case "timeline": {
        const peak = this.timeline.peak;
        while (peak.length < message.bins) peak.push(null);
        message.peak.forEach((/** @type {number | null} */ p, /** @type {number} */ i) => {
          peak[message.first_bin + i] = p;
        });
        const { differing } = this.timeline;
        message.differing?.forEach((/** @type {number} */ count, /** @type {number} */ i) => {
          differing[message.first_bin + i] = count;
        });
        this.timeline.until = message.computed_until_s;
        break;
      }
      case "events":
        this.eventsLost += message.lost;
        this.events.push(...message.events);
        this.events.splice(0, Math.max(0, this.events.length - EVENTS_MAX));
        if (this.events.length) this.newestEvent = this.events[this.events.length - 1].seq;
        break;
      case "boards":
        this.boards = message.boards;
        break;
      case "taxel":
        this.taxelValue = message;
        break;
      case "explain":
        this.explanation = message;
        break;
      case "ended":
        this.ended = message.reason;
        break;
      default:
        return;
    }
    this.tell(message.type);
  }

  /** @param {import("./wire.js").History} history */
  setHistory(history) {
    this.history = history;
    this.tell("history");
  }

  /**
   * @param {"connecting" | "open" | "silent" | "lost"} state
   * @param {string} [reason]
   * @param {Date} [since]
   */
  setConnection(state, reason = "", since = new Date()) {
    if (state === this.connection.state && reason === this.connection.reason) return;
    const goesOn = state !== "open" && this.connection.state === "lost";
    this.connection = { state, reason, since: goesOn ? this.connection.since : since };
    this.tell("connection");
  }

  /**
   * What a field reports in a column; null where it is absent.
   * @param {number} field
   * @param {string} column
   */
  value(field, column) {
    const k = this.inContact.get(field);
    const index = this.columnIndex.get(column);
    if (k === undefined || index === undefined || !this.percepts || !this.welcome) return null;
    const values = this.percepts.columns.get(index);
    if (!values || !((this.percepts.present[k] >>> index) & 1)) return null;
    const components = this.welcome.columns[index].components;
    return values.subarray(k * components, (k + 1) * components);
  }

  /**
   * The same as people are told it: places in the world from the world's own origin, not from the picture's.
   * @param {number} field
   * @param {string} column
   */
  told(field, column) {
    const value = this.value(field, column);
    const present = this.percepts?.present[this.inContact.get(field) ?? 0] ?? 0;
    if (!value || column !== "position" || !((present >>> IN_WORLD_BIT) & 1)) return value;
    return value.map((x, i) => x + (this.welcome?.origin[i] ?? 0));
  }

  /** The column that says how hard a field is pressed: its force where that is computed, else the sum of its pressures. */
  get loadColumn() {
    return this.columnIndex.has("force") ? "force" : "total";
  }

  /** Its unit. */
  get loadUnit() {
    return this.loadColumn === "force" ? "N" : "P";
  }

  /**
   * How hard a field is pressed; 0 where that is absent.
   * @param {number} field
   */
  load(field) {
    return this.value(field, this.loadColumn)?.[0] ?? 0;
  }

  /**
   * It as text; a dash where it is absent.
   * @param {number} field
   */
  loadText(field) {
    const value = this.value(field, this.loadColumn);
    return value ? withUnit(value[0], this.loadUnit, this.quantity) : "–";
  }

  /**
   * Names of a field's flags.
   * @param {number} field
   */
  flagsOf(field) {
    const k = this.inContact.get(field);
    if (k === undefined || !this.percepts || !this.welcome) return ["no_contact"];
    const flags = this.percepts.flags[k];
    return this.welcome.flags.filter((name, bit) => name !== null && (flags >>> bit) & 1).map(String);
  }

  /**
   * The flag that says why a column is absent.
   * @param {number} field
   * @param {string} column
   */
  reason(field, column) {
    const flags = this.flagsOf(field);
    const likely = REASONS[column]?.find((name) => flags.includes(name));
    return likely ?? flags.join(", ");
  }
}

/** Before a frame has told of any.
 * @returns {import("./wire.js").SelfContacts} */
const noSelfContacts = () => ({ known: false, list: [] });

/** What is known of a recording before its first message. */
function noTimeline() {
  return {
    until: -Infinity,
    peak: /** @type {(number | null)[]} */ ([]),
    /** By bin, how many frames have other percepts in the recording; empty where it holds none. */
    differing: /** @type {number[]} */ ([]),
  };
}
