/** Starts the page and joins its parts. */

import { Address } from "./address.js";
import { Boards } from "./boards.js";
import { Camera, chooseDirection } from "./camera.js";
import { ChartPanel } from "./chart.js";
import { Choices } from "./choices.js";
import { SelfContactsPanel } from "./self_contacts.js";
import { atMostEvery, byId, setText } from "./dom.js";
import { PerceptPanel } from "./explain.js";
import { Fields } from "./fields.js";
import { Inspector } from "./inspect.js";
import { Keys } from "./keys.js";
import { GESTURES, keyList } from "./keylist.js";
import { Legend } from "./legend.js";
import { Log } from "./log.js";
import { dot, toWorld } from "./math.js";
import { Measure } from "./measure.js";
import { Model } from "./model.js";
import { Marks } from "./percepts.js";
import { Paired } from "./paired.js";
import { Peaks } from "./peaks.js";
import { Photo } from "./photo.js";
import { Picker } from "./pick.js";
import { TaxelIds } from "./taxel_ids.js";
import { taxelInWorld } from "./places.js";
import { PlotFile } from "./plot_file.js";
import { Plots } from "./plots.js";
import { Connection, takeToken } from "./socket.js";
import { RestPanel } from "./rest.js";
import { ScaleBar } from "./scale_bar.js";
import { Span } from "./span.js";
import { Status } from "./status.js";
import { Timeline } from "./timeline.js";
import { joinToolbar } from "./toolbar.js";
import { tokenIn } from "./tokens.js";
import { TouchPanel } from "./touch_panel.js";
import { Video } from "./video.js";
import { View } from "./view.js";
import { say } from "./wire.js";

/** What was done is said for so long. */
const HINT_MS = 2600;

const model = new Model();
const choices = new Choices();
const camera = new Camera();
const connection = new Connection(model, takeToken(location.hash));
const stage = byId("stage", HTMLElement);
const view = new View(byId("scene", HTMLCanvasElement), model, camera, choices);
const picker = new Picker(model, camera);
const measure = new Measure(model, picker);
const marks = new Marks(
  byId("marks", HTMLCanvasElement),
  model,
  camera,
  choices,
  new TaxelIds(model, picker),
  measure,
);
const scaleBar = new ScaleBar(byId("scale-bar", HTMLCanvasElement), camera);
const photo = new Photo(view, model, [marks.canvas, scaleBar.canvas]);
const legend = new Legend(byId("legend", HTMLElement), model);
const span = new Span();
const plots = new Plots(model, connection, span);
const peaks = new Peaks(model, span, connection);
const timeline = new Timeline(model, connection, span);
const percept = new PerceptPanel(model, choices, connection, plots);
const fields = new Fields(model, choices, lookAt);
const chart = new ChartPanel(
  byId("chart", HTMLCanvasElement),
  byId("chart-note", HTMLElement),
  model,
  choices,
);
const touches = new TouchPanel(model, choices, (touch) => lookAtTaxels([...touch.taxels]));
const selfContacts = new SelfContactsPanel(model, choices);
new Boards(model);
new RestPanel(model);
new Log(
  model,
  (field) => choices.choose(field),
  (t) => timeline.seek(t),
);
new Status(model, view, connection.hold);
plots.onSeek = (t) => timeline.seek(t);

/** @param {number} field */
function lookAt(field) {
  lookAtTaxels(model.welcome?.fields[field]?.members ?? []);
}

/** @param {number[]} members taxels */
function lookAtTaxels(members) {
  if (!members.length) return;
  const normals = members.map((taxel) => taxelInWorld(model, taxel)?.normal ?? [0, 0, 0]);
  const mean = [0, 1, 2].map((k) => normals.reduce((sum, normal) => sum + normal[k], 0) / normals.length);
  // Taxels that look one way are seen from that side; those that go around the body from where we are.
  if (Math.hypot(...mean) > 0.6) {
    camera.yaw = Math.atan2(mean[1], mean[0]) + 0.25;
    camera.pitch = Math.max(-1.3, Math.min(1.3, Math.asin(mean[2] / Math.hypot(...mean)) + 0.2));
    camera.update();
  }
  camera.frame(
    members.map((taxel) => taxelInWorld(model, taxel)?.point ?? camera.target),
    0.24,
  );
  moved();
}

/** Takes in the whole body. */
function lookAtAll() {
  const { mesh, rows } = model;
  if (!mesh) return;
  const vertices = mesh.link.length;
  const step = Math.max(1, Math.floor(vertices / 3000));
  /** @type {import("./math.js").Vec3[]} */
  const points = [];
  for (let i = 0; i < vertices; i += step) points.push(toWorld(rows, mesh.link[i], mesh.position, 1, 3 * i));
  if (!points.length)
    for (let i = 0; i < mesh.taxelId.length; i++) points.push(taxelInWorld(model, i)?.point ?? [0, 0, 0]);
  const [low, high] = [0, 1, 2].reduce(
    ([lo, hi], k) => [
      [...lo, points.reduce((m, p) => Math.min(m, p[k]), Infinity)],
      [...hi, points.reduce((m, p) => Math.max(m, p[k]), -Infinity)],
    ],
    /** @type {[number[], number[]]} */ ([[], []]),
  );
  camera.radius = Math.max(1e-3, Math.hypot(...high.map((h, k) => h - low[k])) / 2);
  camera.frame(points, 0.08);
  moved();
}

function moved() {
  view.request();
  address.changed();
  if (turned) paired.share();
}

/** @type {import("./math.js").Vec3} */
const NO_NORMAL = [0, 0, 0];

/** Whether somebody has turned the body: from then on it stays as it is. */
let turned = false;
for (const event of ["pointerdown", "wheel"])
  stage.addEventListener(event, () => (turned = true), { passive: true });
// Before the key acts.
window.addEventListener(
  "keydown",
  (event) => {
    if (/^(Arrow\w+|[0-9f+=-])$/.test(event.key)) turned = true;
  },
  { capture: true },
);

/** The touch or field whose side was shown last. */
let shownSide = "";

/** The taxels of the oldest touch, or where touches are not looked for those of the field that is followed. */
function touchedTaxels() {
  if (model.welcome?.touches) {
    const [touch] = model.touches;
    return { name: `touch ${touch?.id}`, members: [...(touch?.taxels ?? [])] };
  }
  const { field } = choices;
  const members = field !== null && model.inContact.has(field) ? model.welcome?.fields[field]?.members : [];
  return { name: `field ${field}`, members: members ?? [] };
}

/** Turns the body so that the side that is touched is seen, until somebody turns it. */
function showTouchedSide() {
  if (turned) return;
  const { name, members } = touchedTaxels();
  if (!members.length || name === shownSide) return;
  shownSide = name;
  const normals = members.map((taxel) => taxelInWorld(model, taxel)?.normal ?? NO_NORMAL);
  const facing = normals.reduce((sum, normal) => sum + dot(normal, camera.back), 0) / normals.length;
  if (facing > 0.2) return;
  chooseDirection(
    camera,
    normals,
    members.map((taxel) => (model.mesh?.taxelRadius[taxel] ?? 0) ** 2),
  );
  lookAtAll();
}

let framed = "";
const paired = new Paired(
  camera,
  () => framed,
  () => {
    turned = true;
    view.request();
    address.changed();
  },
);
connection.onScene = () => {
  const { welcome, mesh } = model;
  if (!welcome || !mesh) return;
  const body = `${welcome.body} ${welcome.fields.length} ${mesh.taxelId.length}`;
  if (framed !== body) choices.forget(welcome.touches);
  view.build();
  connection.send(say.columns(welcome.columns.map((column) => column.name)));
  plots.begin();
  if (framed !== body) {
    framed = body;
    const normals = Array.from(mesh.taxelId, (_, i) => taxelInWorld(model, i)?.normal ?? [0, 0, 1]);
    chooseDirection(
      camera,
      /** @type {import("./math.js").Vec3[]} */ (normals),
      Array.from(mesh.taxelRadius, (r) => r * r),
    );
    lookAtAll();
    address.show(location.hash);
  } else if (welcome.time && resume) {
    connection.send(resume.playing ? say.play() : say.pause());
    connection.send(say.seek(resume.t));
    if (resume.speed !== 1) connection.send(say.speed(resume.speed));
  }
};

/** Where a recording stood when the connection was lost. @type {{t: number, playing: boolean, speed: number} | null} */
let resume = null;
model.on("connection", () => {
  if (model.connection.state === "lost" && model.frame)
    resume = { t: model.frame.t, playing: model.status.playing, speed: model.status.speed };
});

// Panels follow the frames at a pace that people can read, so that time is left for drawing.
const updatePanels = atMostEvery(100, () => {
  touches.update();
  fields.update();
  percept.update();
  selfContacts.update();
  legend.updateStates();
  if (byId("chart-panel", HTMLDetailsElement).open) chart.draw();
});
const updatePlots = atMostEvery(80, () => {
  if (byId("plots-panel", HTMLDetailsElement).open) {
    plots.draw();
    setText(byId("plots-range", HTMLElement), plots.caption());
  }
  timeline.draw();
});
span.on("span", updatePlots);

model.on("frame", () => {
  if (model.frame?.pressure) view.taxelsChanged = true;
  if (model.frame?.touches) view.ringsChanged = true;
  if (choices.touch !== null && !model.touch(choices.touch)) choices.chooseTouch(null);
  choices.follow(model);
  plots.follow(choices.smallestTouched(model));
  showTouchedSide();
  view.request();
  updatePanels();
  updatePlots();
});
model.on("scale", () => {
  view.taxelsChanged = true;
  view.request();
  updatePanels();
});
choices.on("look field hover touch", () => {
  view.ringsChanged = true;
  view.request();
  updatePanels();
});
model.on("connection", () => view.request());
for (const panel of document.querySelectorAll("details"))
  panel.addEventListener("toggle", () => {
    updatePanels();
    updatePlots();
  });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  updatePanels();
  plots.draw();
  timeline.draw();
});

view.onDraw = () => {
  const acknowledge = connection.takeToDraw();
  marks.draw();
  scaleBar.draw();
  return () => {
    acknowledge();
    // Before the pointer first needs it, and after the first picture.
    if (view.framesDrawn && picker.mesh !== model.mesh) setTimeout(() => picker.update());
  };
};

new ResizeObserver(() => {
  camera.resize(stage.clientWidth, stage.clientHeight);
  marks.drawn = true;
  view.request();
  plots.draw();
  timeline.draw();
}).observe(stage);
camera.resize(stage.clientWidth, stage.clientHeight);

const address = new Address({
  model,
  camera,
  choices,
  connection,
  fields,
  peaks,
  plots,
  span,
  timeline,
  isTurned: () => turned,
  onCamera: () => {
    turned = true;
    view.request();
  },
});

new Inspector(byId("marks", HTMLCanvasElement), {
  model,
  camera,
  choices,
  connection,
  picker,
  marks,
  measure,
  onMove: moved,
  onPercept: (field) => percept.ask(field),
  lookAt,
});

/** @param {import("./camera.js").Preset} name */
function look(name) {
  camera.preset(name);
  lookAtAll();
}
joinToolbar(choices, (name) => {
  if (name === "all") lookAtAll();
  else look(/** @type {import("./camera.js").Preset} */ (name));
});

const hint = byId("hint", HTMLElement);
let hintTimer = 0;
/** Says something for a while, then again what the measure says. @param {string} text */
function tell(text) {
  clearTimeout(hintTimer);
  setText(hint, text || measure.text);
  hint.hidden = hint.textContent === "";
  if (text) hintTimer = window.setTimeout(() => tell(""), HINT_MS);
}
const video = new Video(photo, span, connection, tell);
const plotFile = new PlotFile(model, connection, plots, tell);
measure.on("measure", () => {
  tell("");
  measureButton.setAttribute("aria-pressed", String(measure.isOn));
  document.documentElement.classList.toggle("measuring", measure.isOn);
  marks.drawn = true;
  view.request();
});
const { hold } = connection;
const keys = new Keys(
  keyList({
    camera,
    choices,
    fields,
    legend,
    timeline,
    measure,
    peaks,
    plots,
    video,
    look,
    lookAt,
    lookAtAll,
    release: () => {
      if (video.isOn) return video.toggle();
      if (measure.isOn) return measure.end();
      choices.chooseTouch(null);
      choices.choose(null);
    },
    moved,
    explain: () => percept.ask(),
    photo: () => photo.take(),
    link: () => void address.copy(tell),
    table: () => plotFile.save(),
    pause: () => (model.welcome?.time ? timeline.togglePlay() : hold.toggle()),
    help: () => keys.toggleHelp(),
  }),
  GESTURES,
);
const measureButton = byId("measure", HTMLButtonElement);
measureButton.addEventListener("click", () => measure.toggle());
const [peaksButton, videoButton] = ["peaks", "video"].map((id) => byId(id, HTMLButtonElement));
peaksButton.addEventListener("click", () => peaks.toggle());
peaks.on("peaks", () => peaksButton.setAttribute("aria-pressed", String(peaks.isOn)));
videoButton.addEventListener("click", () => video.toggle());
video.on("video", () => videoButton.setAttribute("aria-pressed", String(video.isOn)));
byId("hold", HTMLButtonElement).addEventListener("click", () => hold.toggle());
byId("plots-file", HTMLButtonElement).addEventListener("click", () => plotFile.save());
byId("touch-plot-button", HTMLButtonElement).addEventListener("click", () => plots.toggleTouches());
byId("link", HTMLButtonElement).addEventListener("click", () => void address.copy(tell));
byId("photo", HTMLButtonElement).addEventListener("click", () => photo.take());
byId("help-button", HTMLButtonElement).addEventListener("click", () => keys.toggleHelp());
byId("help-close", HTMLButtonElement).addEventListener("click", () => keys.toggleHelp());

const tokenBox = byId("token-box", HTMLInputElement);
byId("token-form", HTMLFormElement).addEventListener("submit", (event) => {
  event.preventDefault();
  const token = tokenIn(tokenBox.value);
  tokenBox.setCustomValidity(token ? "" : "There is no token=… in it.");
  if (token) connection.take(token);
  else tokenBox.reportValidity();
});
tokenBox.addEventListener("input", () => tokenBox.setCustomValidity(""));

window.addEventListener("hashchange", (event) => {
  // The address itself may be another one by now: it follows what is shown.
  const { hash } = new URL(event.newURL);
  if (hash.includes("token=")) connection.take(takeToken(hash));
  address.show(hash);
});
connection.open();

// For tests, to read and not to change.
Object.defineProperty(window, "somatic", {
  value: Object.freeze({
    model,
    camera,
    span,
    /** @param {number} taxel */
    pixelOfTaxel(taxel) {
      const at = picker.pixelOf(taxel);
      const box = stage.getBoundingClientRect();
      return at ? [box.left + at.x, box.top + at.y] : null;
    },
    get framesDrawn() {
      return view.framesDrawn;
    },
    get firstPictureMs() {
      return view.firstPictureMs;
    },
    /** Smoothed time of a drawing, ms. */
    get drawMs() {
      return view.drawMs;
    },
    get renderer() {
      return view.renderer.name;
    },
  }),
});
