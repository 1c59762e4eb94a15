/** The view in the page's address: whoever opens it sees the same, and it has no token. */

import { byId } from "./dom.js";
import { fromFragment, toFragment } from "./fragment.js";
import { say } from "./wire.js";

/** The address follows what is shown so long after its last change: browsers refuse more than a few changes a second. */
const STILL_MS = 500;

/** What can be seen or not, with what it is at first. */
const LOOKS = /** @type {const} */ ({
  xray: false,
  body: true,
  taxels: true,
  tint: false,
  labels: true,
  ids: false,
});

export class Address {
  /**
   * @param {{model: import("./model.js").Model, camera: import("./camera.js").Camera,
   *   choices: import("./choices.js").Choices, connection: import("./socket.js").Connection,
   *   plots: import("./plots.js").Plots, peaks: import("./peaks.js").Peaks, span: import("./span.js").Span,
   *   timeline: import("./timeline.js").Timeline, isTurned: () => boolean, onCamera: () => void}} parts
   */
  constructor(parts) {
    this.parts = parts;
    this.timer = 0;
    /** Nothing is written before what the address says has been shown. */
    this.isShown = false;
    const { model, choices, span, plots, peaks } = parts;
    this.panels = [...document.querySelectorAll("#side > details")].filter(
      (panel) => panel instanceof HTMLDetailsElement,
    );
    /** Panels that are open at first. */
    this.openAtFirst = this.open();
    for (const panel of this.panels) panel.addEventListener("toggle", () => this.changed());
    choices.on("look field touch", () => this.changed());
    span.on("span loop", () => this.changed());
    model.on("status series frame", () => {
      // While it plays, the moment is no part of it.
      if (!model.status.playing) this.changed();
    });
    peaks.on("peaks", () => this.changed());
    plots.onTouchPlot = () => this.changed();
  }

  /** Names of the panels that are open. */
  open() {
    return this.panels.filter((panel) => panel.open).map((panel) => panel.id.replace("-panel", ""));
  }

  /** Something that is shown has changed. */
  changed() {
    if (!this.isShown) return;
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.write(this.state(false)), STILL_MS);
  }

  /** @param {import("./fragment.js").ViewState} state */
  write(state) {
    clearTimeout(this.timer);
    const fragment = toFragment(state);
    if (fragment === location.hash.slice(1)) return;
    history.replaceState(null, "", `${location.pathname}${location.search}${fragment && `#${fragment}`}`);
  }

  /** The address of what is shown now, which the page has from then on. */
  link() {
    this.write(this.state(true));
    return location.href;
  }

  /**
   * @param {boolean} whole also what changes by itself, the moment while it plays and the side that is seen
   * @returns {import("./fragment.js").ViewState}
   */
  state(whole) {
    const { model, camera, choices, plots, peaks, span, isTurned } = this.parts;
    const { welcome, frame } = model;
    const isStill = !!welcome?.time && !model.status.playing;
    /** @type {import("./fragment.js").ViewState} */
    const state = {};
    if (welcome?.time && frame && (whole || isStill)) state.t = frame.t;
    if (whole || isStill || isTurned()) {
      const { yaw, pitch, distance, target } = camera;
      const origin = welcome?.origin ?? [0, 0, 0];
      state.camera = { yaw, pitch, distance, target: target.map((x, k) => x + origin[k]) };
    }
    const open = this.open();
    if (open.join() !== this.openAtFirst.join()) state.panels = open.length ? open : ["none"];
    const looks = /** @type {(keyof typeof LOOKS)[]} */ (Object.keys(LOOKS));
    const look = looks.flatMap((name) =>
      choices[name] === LOOKS[name] ? [] : [choices[name] ? name : `no-${name}`],
    );
    if (plots.touches.isShown) look.push("touch-plot");
    if (peaks.isOn) look.push("peaks");
    if (look.length) state.look = look;
    if (choices.marks !== choices.offered[0]) state.marks = choices.marks;
    const letters = new Set(welcome?.fields.map((field) => field.letter));
    if (letters.size > 1 && choices.letter !== null) state.letter = choices.letter;
    if (choices.chosen !== null) state.field = welcome?.fields[choices.chosen]?.name;
    if (choices.touch !== null) state.touch = choices.touch;
    if (welcome?.time && !span.isWhole) state.span = [span.from, span.to];
    if (welcome?.time && span.loop) state.loop = [span.loop.from, span.loop.to];
    if (!plots.follows)
      state.plots = plots.chosen().map(({ field, column }) => ({
        field: welcome?.fields[field]?.name ?? "",
        column,
      }));
    return state;
  }

  /**
   * Shows what an address says.
   * @param {string} fragment its end
   */
  show(fragment) {
    const state = fromFragment(fragment);
    const { model, camera, choices, connection, peaks, plots, span, timeline, onCamera } = this.parts;
    const { welcome } = model;
    if (!welcome) return;
    if (state.camera) {
      const { yaw, pitch, distance, target } = state.camera;
      const from = welcome.origin;
      camera.yaw = yaw;
      camera.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, pitch));
      camera.distance = Math.max(camera.radius * 0.02, Math.min(camera.radius * 40, distance));
      camera.target = [target[0] - from[0], target[1] - from[1], target[2] - from[2]];
      camera.update();
      onCamera();
    }
    const { panels } = state;
    if (panels) for (const panel of this.panels) panel.open = panels.includes(panel.id.replace("-panel", ""));
    if (state.look) {
      for (const name of /** @type {(keyof typeof LOOKS)[]} */ (Object.keys(LOOKS)))
        choices[name] = state.look.includes(name) || (LOOKS[name] && !state.look.includes(`no-${name}`));
      peaks.show(state.look.includes("peaks"));
      plots.touches.show(state.look.includes("touch-plot"));
    }
    const marks = choices.offered.find((name) => name === state.marks);
    if (marks) choices.marks = marks;
    if (state.letter && welcome.fields.some((field) => field.letter === state.letter)) {
      choices.chooseLetter(state.letter);
    }
    const indexOf = (/** @type {string} */ name) =>
      welcome.fields.findIndex((field) => field.name === name && field.letter === choices.letter);
    if (state.field) {
      const field = indexOf(state.field);
      if (field >= 0) choices.choose(field);
    }
    if (state.span) span.show(...state.span);
    if (state.loop) span.setLoop(...state.loop);
    const plotted = (state.plots ?? [])
      .map(({ field, column }) => ({ field: indexOf(field), column }))
      .filter(({ field, column }) => field >= 0 && model.columnIndex.has(column));
    if (plotted.length) plots.plot(plotted);
    if (state.t !== undefined && welcome.time) {
      connection.send(say.pause());
      timeline.seek(state.t);
      // The touch is known once its frame is there.
      const { touch } = state;
      if (touch !== undefined) this.chooseTouch(touch);
    }
    choices.tell("look");
    this.isShown = true;
  }

  /** @param {number} id */
  chooseTouch(id) {
    const { model, choices } = this.parts;
    let frames = 0;
    model.on("frame", () => {
      if (frames < 0 || frames++ > 3) return;
      if (!model.touch(id)) return;
      frames = -1;
      choices.chooseTouch(id);
    });
  }

  /** Copies the address of what is shown. @param {(text: string) => void} tell */
  async copy(tell) {
    const link = this.link();
    try {
      await navigator.clipboard.writeText(link);
      tell("Link copied, without the token");
    } catch {
      tell("The link is in the address bar, without the token");
    }
    byId("marks", HTMLCanvasElement).focus();
  }
}
