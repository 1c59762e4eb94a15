/** A page that is one of two, each in a frame: turning the one body turns the other, if it is the same. */

/** @typedef {{yaw: number, pitch: number, distance: number, target: number[]}} Seen */

/** The second page is below this path. */
const BESIDE = "/beside/";

export class Paired {
  /**
   * @param {import("./camera.js").Camera} camera
   * @param {() => string} body names the body that is shown
   * @param {() => void} onCamera called when the other page has moved the camera
   */
  constructor(camera, body, onCamera) {
    this.camera = camera;
    this.body = body;
    this.isOn = window.parent !== window;
    if (!this.isOn) return;
    const { classList } = document.documentElement;
    classList.add("paired");
    classList.toggle("second", location.pathname.startsWith(BESIDE));
    window.addEventListener("message", ({ origin, data }) => {
      if (origin !== location.origin || !data?.seen || data.body !== this.body()) return;
      const { yaw, pitch, distance, target } = /** @type {Seen} */ (data.seen);
      Object.assign(camera, { yaw, pitch, distance, target });
      camera.update();
      onCamera();
    });
  }

  /** The other page shows the same side of the body. */
  share() {
    if (!this.isOn) return;
    const { yaw, pitch, distance, target } = this.camera;
    const message = { body: this.body(), seen: { yaw, pitch, distance, target } };
    for (let i = 0; i < window.parent.length; i++) {
      const frame = window.parent[i];
      if (frame !== window) frame.postMessage(message, location.origin);
    }
  }
}
