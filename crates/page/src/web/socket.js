/** The connection: says hello, hands messages to the model, comes back after a loss. */

import { withoutToken } from "./fragment.js";
import { Hold } from "./hold.js";
import { Tokens } from "./tokens.js";
import { decodeFrame, decodeHistory, decodeMesh, decodePeaks, kindOf, say } from "./wire.js";

const TOKEN = "somatic token";
const RETRY_MIN_MS = 250;
const RETRY_MAX_MS = 4000;
/** After so long without a message while frames are due, the page no longer looks live. */
const SILENT_MS = 2500;

/**
 * Moves the token from the end of an address to the session's storage, so that it is not seen, kept or shared with a link.
 * @param {string} fragment
 */
export function takeToken(fragment) {
  const token = new URLSearchParams(fragment.slice(1)).get("token");
  if (token) {
    sessionStorage.setItem(TOKEN, token);
    const rest = withoutToken(fragment);
    history.replaceState(null, "", location.pathname + location.search + (rest && `#${rest}`));
  }
  return sessionStorage.getItem(TOKEN) ?? "";
}

export class Connection {
  /**
   * @param {import("./model.js").Model} model
   * @param {string} token
   */
  constructor(model, token) {
    this.model = model;
    this.token = token;
    this.hold = new Hold(model);
    /** @type {WebSocket | null} */
    this.socket = null;
    this.wait = RETRY_MIN_MS;
    /** Frames that came since the last drawing. @type {number[]} */
    this.toDraw = [];
    /** Called after `welcome` and the mesh. */
    this.onScene = () => {};
    this.scene = { taxels: 0, pulled: 0, links: 0, components: /** @type {number[]} */ ([]) };
    this.heard = performance.now();
    this.saidAfter = /** @type {number | null} */ (null);
    this.timer = 0;
    this.tokens = new Tokens(
      () => (model.connection.state === "open" ? this.token : ""),
      (token) => model.connection.asksToken && this.take(token),
    );
    setInterval(() => this.watch(), 500);
    document.addEventListener("visibilitychange", () => (this.heard = performance.now()));
  }

  /**
   * Tries another token at once.
   * @param {string} token
   */
  take(token) {
    sessionStorage.setItem(TOKEN, token);
    this.token = token;
    this.wait = RETRY_MIN_MS;
    if (this.socket) return;
    clearTimeout(this.timer);
    this.open();
  }

  open() {
    // Beside the page: of two pages each has its own.
    const url = new URL("socket", location.href);
    url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    url.hash = "";
    const socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.toDraw = [];
    socket.onopen = () => {
      this.saidAfter = this.model.newestEvent;
      socket.send(say.hello(this.token, this.saidAfter));
    };
    socket.onmessage = (message) => {
      if (this.socket !== socket) return;
      this.heard = performance.now();
      try {
        if (typeof message.data === "string") this.text(JSON.parse(message.data));
        else this.binary(message.data);
      } catch (error) {
        // A message that cannot be read: better no picture than a wrong one.
        console.error(error);
        socket.close(4000, "unreadable message");
      }
    };
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      this.socket = null;
      this.toDraw = [];
      const isWrong = event.code === 1008 && event.reason.startsWith("wrong token");
      this.model.setConnection(
        "lost",
        event.code === 1008 ? this.refusal(event.reason) : event.reason,
        isWrong,
      );
      if (isWrong) this.tokens.ask();
      this.timer = window.setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(RETRY_MAX_MS, this.wait * 1.6);
    };
  }

  /** @param {string} reason */
  refusal(reason) {
    if (!this.token) return "A link to a moment has no token.";
    const advice = "Open the address that somatic printed when it started.";
    return reason ? `The server refused the page: ${reason}. ${advice}` : advice;
  }

  /** Greys the page where frames are due and none comes. */
  watch() {
    const { model } = this;
    // The shorter of two recordings waits at its end.
    const plays = model.status.playing && !model.status.at_end;
    const due = model.ended === null && (model.welcome?.mode === "live" || plays);
    const quiet = performance.now() - this.heard;
    if (model.connection.state === "open" && due && !document.hidden && quiet > SILENT_MS)
      model.setConnection("silent", "", false, new Date(Date.now() - quiet));
    else if (model.connection.state === "silent" && quiet < SILENT_MS) model.setConnection("open");
  }

  /** @param {any} message */
  text(message) {
    const { model } = this;
    if (message.type !== "welcome") {
      // What a taxel says now is not what is shown.
      if (message.type !== "taxel" || !this.hold.isOn) model.receive(message);
      return;
    }
    if (model.welcome && model.welcome.run !== message.run && this.saidAfter !== null) {
      // The server has started anew and counts its events from 1 again.
      model.forgetEvents();
      const old = this.socket;
      this.socket = null;
      old?.close();
      this.open();
      return;
    }
    model.begin(message);
    this.wait = RETRY_MIN_MS;
  }

  /** @param {ArrayBuffer} buffer */
  binary(buffer) {
    const { model } = this;
    switch (kindOf(buffer)) {
      case 1: {
        const mesh = decodeMesh(buffer);
        this.scene = {
          taxels: mesh.taxelId.length,
          pulled: model.welcome?.senses?.shear.length ?? 0,
          links: mesh.restPose.length / 7,
          components: model.welcome?.columns.map((column) => column.components) ?? [],
        };
        model.setMesh(mesh);
        model.setConnection("open");
        this.hold.forget();
        this.onScene();
        break;
      }
      case 2: {
        const frame = decodeFrame(buffer, this.scene);
        this.toDraw.push(frame.seq);
        if (model.connection.state === "silent") model.setConnection("open");
        this.hold.take(frame);
        // Nothing is drawn meanwhile that could say that it was.
        if (this.hold.isOn) requestAnimationFrame(this.takeToDraw());
        break;
      }
      case 3:
        model.setHistory(decodeHistory(buffer));
        break;
      case 4:
        model.answeredPeaks = decodePeaks(buffer);
        model.tell("peaks");
        break;
    }
  }

  /** The frames that the next drawing shows: what is given back is to be called when they are on the screen. */
  takeToDraw() {
    const { socket } = this;
    const seqs = this.toDraw.splice(0);
    return () => {
      if (socket === this.socket) for (const seq of seqs) this.send(say.drawn(seq));
    };
  }

  /** @param {string} message */
  send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(message);
  }
}
