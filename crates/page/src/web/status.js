/** The line of truth: backend, latency, frames skipped, rate; and what is wrong with the connection. */

import { byId, setText } from "./dom.js";
import { ABSENT, clock, shortPath } from "./format.js";

export class Status {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./view.js").View} view
   * @param {import("./hold.js").Hold} hold
   */
  constructor(model, view, hold) {
    this.model = model;
    this.hold = hold;
    this.view = view;
    this.banner = byId("banner", HTMLElement);
    this.last = { drawn: 0, frame: 0, at: performance.now() };
    model.on("scene", () => this.head());
    model.on("connection context ended", () => this.connection());
    // Whether it is at rest is known with its first frame.
    model.on("frame", () => model.isAtRest && this.connection());
    hold.on("hold", () => this.held());
    setInterval(() => this.update(), 500);
    if (!view.gl) byId("no-webgl", HTMLElement).hidden = false;
  }

  head() {
    const { welcome } = this.model;
    if (!welcome) return;
    const body = byId("body-name", HTMLElement);
    setText(body, shortPath(welcome.body));
    body.title = welcome.body;
    const source = byId("source-name", HTMLElement);
    setText(source, shortPath(welcome.source));
    source.title = welcome.source;
    setText(byId("mode", HTMLElement), welcome.mode === "live" ? "live" : "recording");
    document.documentElement.classList.toggle("live", welcome.mode === "live");
    document.title = `${shortPath(welcome.body)} · somatic`;
    const backend = byId("backend", HTMLElement);
    setText(backend, welcome.backend.name);
    backend.title = `${welcome.backend.device}\n${welcome.backend.why}\nsomatic ${welcome.somatic}`;
  }

  update() {
    const { model, view, last } = this;
    const now = performance.now();
    const span = (now - last.at) / 1000;
    const drawn = (view.framesDrawn - last.drawn) / span;
    this.last = { drawn: view.framesDrawn, frame: 0, at: now };
    if (this.hold.isOn) this.held();
    const { frame } = model;
    const ms = (/** @type {number} */ x) => (Number.isFinite(x) ? x.toFixed(x < 10 ? 1 : 0) : ABSENT);
    setText(byId("engine-time", HTMLElement), frame ? `${ms(frame.engineMicroseconds)} µs a frame` : ABSENT);
    setText(
      byId("latency", HTMLElement),
      frame && Number.isFinite(frame.p50) ? `${ms(frame.p50)} / ${ms(frame.p99)} ms` : `${ABSENT} ms`,
    );
    setText(byId("skipped", HTMLElement), frame ? String(frame.skipped) : ABSENT);
    setText(byId("rate", HTMLElement), view.gl ? drawn.toFixed(0) : ABSENT);
    const detail = byId("detail", HTMLElement);
    detail.hidden = view.part >= 1 || !view.gl;
    setText(detail, `drawn at ${Math.round(100 * view.part)} %`);
    byId("rate-chip", HTMLElement).title = `Drawings in the last second, by ${view.renderer.name}`;
  }

  /** Whether a live view is paused. */
  held() {
    const { isOn, since, frames } = this.hold;
    const button = byId("hold", HTMLButtonElement);
    document.documentElement.classList.toggle("held", isOn);
    setText(button, isOn ? "▶ Go on" : "❚❚ Pause");
    const text = since ? `paused since ${clock(since)}, ${frames} newer` : "live";
    if (this.model.welcome?.mode === "live") setText(byId("mode", HTMLElement), text);
  }

  connection() {
    const { model, view } = this;
    const { state, since, reason } = model.connection;
    const grey = state === "lost" || state === "silent";
    document.documentElement.classList.toggle("lost", grey);
    let text = "";
    if (state === "lost")
      text = model.welcome
        ? `Connection lost since ${clock(since)}. Trying again …`
        : "No connection to somatic yet.";
    else if (state === "silent") text = `No frames since ${clock(since)}.`;
    else if (state === "connecting") text = "Connecting …";
    else if (view.lost) text = "The graphics were lost. Waiting for them to come back.";
    else if (model.ended !== null && !model.isAtRest) text = model.ended;
    if (reason) text = model.connection.asksToken && !model.welcome ? reason : `${text} ${reason}`;
    byId("token-form", HTMLFormElement).hidden = !model.connection.asksToken;
    setText(this.banner, text);
    this.banner.hidden = text === "";
    this.banner.classList.toggle("calm", !grey && !view.lost);
  }
}
