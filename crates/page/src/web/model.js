/** What the page knows: the scene, the newest frame, events. It changes only by messages from the server. */

import { PALETTE } from "./dom.js";
import { smallestFields } from "./field_tree.js";
import { withUnit } from "./format.js";
import { poseToRows } from "./math.js";
import { Reported } from "./reported.js";
import { Senses } from "./senses.js";
import { HEALTH } from "./wire.js";

/** @typedef {import("./wire.js").Welcome} Welcome */
/** @typedef {import("./wire.js").Frame} Frame */

const NOT_SENT = HEALTH.indexOf("not sent");
/** Events that the page keeps. */
const EVENTS_MAX = 1000;

export class Model extends Reported {
  constructor() {
    super();
    /** @type {import("./wire.js").Mesh | null} */
    this.mesh = null;
    /** Matrices of the links, 3×4. */
    this.rows = new Float32Array(0);
    /** Counts changes of poses. */
    this.poseVersion = 0;
    /** Pressures; in other senses what taxels are coloured by, on their scale. @type {Float32Array} */
    this.pressure = new Float32Array(0);
    /** @type {Uint8Array} */
    this.health = new Uint8Array(0);
    /** Where there are taxels that read something else. @type {Senses | null} */
    this.senses = null;
    /** Colours of pressures. @type {number[][]} */
    this.pressureColours = [];
    /** Touches of the whole body, the oldest first. @type {import("./wire.js").Touch[]} */
    this.touches = [];
    /** Colours of touches, by their ids: one keeps its own from onset to release. @type {Map<number, number>} */
    this.touchColours = new Map();
    /** Colours of fields, given as they are first shown: each keeps its own everywhere. @type {Map<number, number>} */
    this.fieldColours = new Map();
    /** Whether no taxel of these is sent. @type {Uint8Array | null} */
    this.restOf = null;
    this.rest = false;
    /** By taxel, the smallest field that holds it, or -1. @type {Int32Array | null} */
    this.smallestFields = null;
    /** Touches of two links at one place. @type {import("./wire.js").SelfContacts} */
    this.selfContacts = noSelfContacts();
    /** The newest frame's head. @type {Frame | null} */
    this.frame = null;
    /** @type {import("./wire.js").Scale} */
    this.scale = { max: 1, from: "" };
    /** Largest pressure since autoscale began; null while the scale is fixed. @type {number | null} */
    this.autoscale = null;
    /** Highest pressures of a part of the recording, in place of those of the frame. @type {import("./wire.js").PeakMap | null} */
    this.peaks = null;
    /** The newest answer to who asked for them. @type {import("./wire.js").PeakMap | null} */
    this.answeredPeaks = null;
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
    /** @type {{state: "connecting" | "open" | "silent" | "lost", since: Date, reason: string, asksToken: boolean}} */
    this.connection = { state: "connecting", since: new Date(), reason: "", asksToken: false };
  }

  /** Pressure at the upper end of the colours. */
  get scaleMax() {
    // Shares of a scale of their own.
    if (this.sense === "temperature" || this.sense === "proximity") return 1;
    return this.autoscale ?? this.shearEnds?.most ?? this.scale.max;
  }

  /** Where the scale comes from. */
  get scaleFrom() {
    return this.shearEnds?.from ?? this.scale.from;
  }

  /** While tangential forces are shown, their scale where it is not the one of pressures; else null. */
  get shearEnds() {
    return this.sense === "shear" ? (this.senses?.shearEnds(this.scale) ?? null) : null;
  }

  /** Whether a body without a source is shown. */
  get isAtRest() {
    const health = this.senses?.health ?? this.health;
    if (this.restOf !== health) {
      this.restOf = health;
      this.rest = health.length > 0 && health.every((state) => state === NOT_SENT);
    }
    return this.frame !== null && this.rest;
  }

  /**
   * The colour of a taxel of a body without a source: that of the smallest field that holds it. Null where it is in none, or
   * where there is a source.
   * @param {number} taxel
   */
  colourAtRest(taxel) {
    if (!this.isAtRest) return null;
    if (!this.smallestFields) {
      const { smallest, leaves } = smallestFields(
        this.welcome?.fields ?? [],
        this.health.length,
        this.letter,
      );
      // Colours in the tree's order, so that neighbours differ.
      for (const leaf of leaves) this.fieldColour(leaf);
      this.smallestFields = smallest;
    }
    const field = this.smallestFields[taxel];
    return field < 0 ? null : PALETTE[this.fieldColour(field) % PALETTE.length];
  }

  /** @param {Welcome} welcome */
  begin(welcome) {
    const sameRun = this.welcome?.run === welcome.run;
    if (namesOf(this.welcome) !== namesOf(welcome)) this.fieldColours = new Map();
    this.smallestFields = null;
    this.describe(welcome);
    this.scale = welcome.scale;
    this.pressureColours = welcome.colours;
    this.senses = null;
    this.letter = null;
    this.sense = "pressure";
    this.setTouches([]);
    this.selfContacts = noSelfContacts();
    this.frame = null;
    this.boards = [];
    this.peaks = null;
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
    this.hasAreas = mesh.taxelArea.some((area) => area > 0);
    const taxels = mesh.taxelId.length;
    this.pressure = new Float32Array(taxels).fill(NaN);
    this.health = new Uint8Array(taxels).fill(HEALTH.indexOf("missing"));
    if (this.welcome?.senses) this.senses = new Senses(this.welcome.senses, taxels);
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
      this.senses?.take(frame);
      this.showSense();
      if (this.autoscale !== null) this.autoscale = Math.max(this.autoscale, this.largestPressure());
    }
    if (frame.pose) this.pose(frame.pose);
    if (frame.percepts) {
      this.report(frame.percepts);
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

  /**
   * Shows fields in a letter, and taxels in what that reads.
   * @param {string | null} letter
   */
  setLetter(letter) {
    const { welcome } = this;
    if (!welcome) return;
    const sense = welcome.fields.find((field) => field.letter === letter)?.sense ?? "pressure";
    if (letter !== this.letter) this.smallestFields = null;
    this.letter = letter;
    if (sense === this.sense) return;
    this.sense = sense;
    const isAuto = this.autoscale !== null && (sense === "pressure" || sense === "shear");
    const { senses } = welcome;
    if (senses)
      welcome.colours =
        sense === "temperature"
          ? senses.temperature_colours
          : sense === "proximity"
            ? senses.distance_colours
            : this.pressureColours;
    this.showSense();
    // From now on, and of what is shown now.
    this.setAutoscale(isAuto);
  }

  /** Colours taxels by what is shown of them. */
  showSense() {
    if (!this.senses) return;
    const { values, health } = this.senses.shown(this.sense);
    [this.pressure, this.health] = [values, health];
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

  /**
   * The number of a field's colour in the palette: the least that no other field has.
   * @param {number} field
   */
  fieldColour(field) {
    let colour = this.fieldColours.get(field);
    if (colour === undefined) {
      colour = this.fieldColours.size;
      this.fieldColours.set(field, colour);
    }
    return colour;
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
        if (this.senses && message.senses) this.senses.scales = message.senses;
        this.showSense();
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
        if (this.events.length) this.newestEvent = this.events[this.events.length - 1].seq;
        this.events.splice(0, Math.max(0, this.events.length - EVENTS_MAX));
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

  /** @param {import("./wire.js").PeakMap | null} peaks that are shown, or the frame's pressures again */
  showPeaks(peaks) {
    this.peaks = peaks;
    this.tell("scale");
  }

  /** @param {import("./wire.js").History} history */
  setHistory(history) {
    this.history = history;
    this.tell("history");
  }

  /**
   * @param {"connecting" | "open" | "silent" | "lost"} state
   * @param {string} [reason]
   * @param {boolean} [asksToken] whether the server has not taken the page's token
   * @param {Date} [since]
   */
  setConnection(state, reason = "", asksToken = false, since = new Date()) {
    if (state === this.connection.state && reason === this.connection.reason) return;
    const goesOn = state !== "open" && this.connection.state === "lost";
    this.connection = { state, reason, asksToken, since: goesOn ? this.connection.since : since };
    this.tell("connection");
  }
}

/**
 * The fields of a run, to tell runs of other fields apart.
 * @param {Welcome | null} welcome
 */
const namesOf = (welcome) =>
  (welcome?.fields ?? []).map((field) => `${field.letter} ${field.name}`).join("\n");

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
