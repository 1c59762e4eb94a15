/** A part of a recording as a video: what is repeated, or else what the timeline shows, each frame drawn and encoded in its turn. */

import { Observed, saveFile } from "./dom.js";
import { fileName } from "./photo.js";
import { webmOf } from "./webm.js";
import { say } from "./wire.js";

/** @typedef {import("./wire.js").Frame} Frame */

/** Pictures in a second at most. */
const RATE = 30;
/** A picture that needs no other comes after so many. */
const KEY_EVERY = 60;
/** Bits for a pixel of a picture. */
const BITS = 0.2;
/** Pictures that wait for the encoder at most. */
const QUEUE = 4;
/** What is tried in turn: names of codecs in browsers and in WebM. */
const CODECS = [
  ["vp8", "V_VP8"],
  ["vp09.00.31.08", "V_VP9"],
];

/** What is being made. */
class Take {
  /**
   * @param {{from: number, to: number}} part s
   * @param {number} speed times the recorded one
   * @param {{start_s: number, end_s: number, frames: number}} time of the recording
   */
  constructor({ from, to }, speed, time) {
    this.from = from;
    this.to = to;
    this.speed = speed;
    const rate = (time.frames - 1) / (time.end_s - time.start_s);
    /** Frames from a picture to the next. */
    this.step = Math.max(1, Math.round((rate * speed) / RATE));
    this.last = time.frames - 1;
    /** The frame that is drawn next; none until the first one is known. @type {number | null} */
    this.number = null;
    /** Perhaps the first one. @type {number | null} */
    this.first = null;
    this.isDrawing = false;
    /** Poses of the last picture. */
    this.poses = -1;
    /** @type {import("./webm.js").Picture[]} */
    this.pictures = [];
    /** @type {VideoEncoder | null} */
    this.encoder = null;
    /** The codec's name in WebM. */
    this.codec = "";
    /** How colours are coded. @type {VideoColorSpaceInit | undefined} */
    this.space = undefined;
    /** @type {HTMLCanvasElement | null} */
    this.canvas = null;
    this.drawn = 0;
  }

  /** When a frame is shown in the video, ms. @param {number} t */
  at(t) {
    return Math.max(0, (1e3 * (t - this.from)) / this.speed);
  }

  /**
   * Begins to encode pictures of a size.
   * @param {HTMLCanvasElement} picture
   */
  async begin(picture) {
    const canvas = (this.canvas = document.createElement("canvas"));
    // Colours are at half the detail: both sides are even.
    [canvas.width, canvas.height] = [picture.width & ~1, picture.height & ~1];
    const { width, height } = canvas;
    const bitrate = BITS * width * height * RATE;
    for (const [name, codec] of CODECS) {
      const config = { codec: name, width, height, bitrate, framerate: RATE };
      const { supported } = await VideoEncoder.isConfigSupported(config);
      if (!supported) continue;
      this.codec = codec;
      return config;
    }
    return null;
  }
}

export class Video extends Observed {
  /**
   * @param {import("./photo.js").Photo} photo
   * @param {import("./span.js").Span} span
   * @param {import("./socket.js").Connection} connection
   * @param {(text: string) => void} hint
   */
  constructor(photo, span, connection, hint) {
    super();
    this.photo = photo;
    this.model = photo.model;
    this.span = span;
    this.connection = connection;
    this.hint = hint;
    /** @type {Take | null} */
    this.take = null;
    /** Where the recording was before. */
    this.before = { t: 0, playing: false };
    this.model.on("frame", () => this.atFrame());
    this.model.on("scene", () => this.stop("The page has begun anew: no video."));
  }

  get isOn() {
    return this.take !== null;
  }

  toggle() {
    if (this.isOn) this.stop("Stopped: no video.");
    else this.start();
  }

  start() {
    const { model, span } = this;
    const time = model.welcome?.time;
    if (!time || !(time.end_s > time.start_s) || !model.frame) return this.hint("A video is of a recording.");
    if (typeof VideoEncoder === "undefined")
      return this.hint(
        "No video: this browser makes them only of pages of this computer (http://127.0.0.1).",
      );
    this.before = { t: model.frame.t, playing: model.status.playing };
    const { from, to } = span.loop ?? span;
    this.take = new Take({ from, to }, model.status.speed, time);
    this.connection.send(say.pause());
    this.connection.send(say.seek(from));
    this.progress(from);
    this.tell("video");
  }

  /** @param {string} why */
  stop(why) {
    const { take, before } = this;
    if (!take) return;
    if (take.encoder && take.encoder.state !== "closed") take.encoder.close();
    this.take = null;
    this.connection.send(say.seek(before.t));
    if (before.playing) this.connection.send(say.play());
    this.hint(why);
    this.tell("video");
  }

  /** @param {number} t how far it is, s */
  progress(t) {
    const { take } = this;
    if (!take) return;
    const part = Math.max(0, Math.min(1, (t - take.from) / (take.to - take.from)));
    this.hint(`Video: ${Math.floor(100 * part)} %. Escape stops it.`);
  }

  atFrame() {
    const { take } = this;
    const { frame } = this.model;
    if (!take || !frame || take.isDrawing) return;
    if (take.number === null) this.findFirst(take, frame);
    else if (frame.frame === take.number) this.draw(take, frame);
    // What was asked for by somebody else may have come in place of it.
    else this.connection.send(say.show(take.number));
  }

  /**
   * The first frame is that of the seek to where the part begins. One may still come from before that: it is asked for until the
   * same one comes twice.
   * @param {Take} take
   * @param {Frame} frame
   */
  findFirst(take, frame) {
    if (frame.t <= take.from && take.first === frame.frame) this.draw(take, frame);
    else {
      take.first = frame.frame;
      this.connection.send(say.seek(take.from));
    }
  }

  /**
   * @param {Take} take
   * @param {Frame} frame
   */
  draw(take, frame) {
    const { model, photo } = this;
    take.number = frame.frame;
    take.isDrawing = true;
    const isAnew = take.poses !== model.poseVersion;
    take.poses = model.poseVersion;
    photo.view.keep((canvas) => {
      if (take !== this.take) return;
      if (model.frame?.frame === frame.frame) void this.encode(take, frame, photo.compose(canvas, 1));
      else {
        take.isDrawing = false;
        this.connection.send(say.show(frame.frame));
      }
    }, isAnew);
  }

  /**
   * @param {Take} take
   * @param {Frame} frame
   * @param {HTMLCanvasElement} picture
   */
  async encode(take, frame, picture) {
    const encoder = take.encoder ?? (await this.encoder(take, picture));
    const { canvas } = take;
    if (take !== this.take || !encoder || !canvas) return;
    canvas.getContext("2d")?.drawImage(picture, 0, 0, canvas.width, canvas.height);
    const shown = new VideoFrame(canvas, { timestamp: Math.round(1e3 * take.at(frame.t)) });
    encoder.encode(shown, { keyFrame: take.drawn++ % KEY_EVERY === 0 });
    shown.close();
    while (take === this.take && encoder.encodeQueueSize > QUEUE)
      await new Promise((then) => encoder.addEventListener("dequeue", then, { once: true }));
    if (take !== this.take) return;
    take.isDrawing = false;
    const next = Math.min(take.last, frame.frame + take.step);
    if (frame.t >= take.to || next === frame.frame) await this.finish(take, frame.t);
    else {
      take.number = next;
      this.progress(frame.t);
      this.connection.send(say.show(next));
    }
  }

  /**
   * @param {Take} take
   * @param {HTMLCanvasElement} picture
   */
  async encoder(take, picture) {
    const config = await take.begin(picture);
    if (take !== this.take) return null;
    if (!config) {
      this.stop("No video: this browser encodes none.");
      return null;
    }
    take.encoder = new VideoEncoder({
      output: (chunk, about) => {
        take.space ??= about?.decoderConfig?.colorSpace;
        const data = new Uint8Array(chunk.byteLength);
        chunk.copyTo(data);
        take.pictures.push({ data, at: chunk.timestamp / 1e3, isKey: chunk.type === "key" });
      },
      error: (error) => take === this.take && this.stop(`No video: ${error.message}`),
    });
    take.encoder.configure(config);
    return take.encoder;
  }

  /**
   * @param {Take} take
   * @param {number} t of the last picture
   */
  async finish(take, t) {
    const { encoder, canvas } = take;
    take.isDrawing = true;
    await encoder?.flush();
    if (take !== this.take || !canvas) return;
    const { codec, space, pictures, from, to } = take;
    const about = {
      codec,
      width: canvas.width,
      height: canvas.height,
      space,
      length: take.at(t) + 1e3 / RATE,
    };
    const name = fileName(this.model, ".webm", `-${from.toFixed(2)}-${to.toFixed(2)}s`);
    saveFile(new Blob(webmOf(pictures, about), { type: "video/webm" }), name);
    this.stop(`${name}: ${pictures.length} pictures`);
  }
}
