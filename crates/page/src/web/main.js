/** Starts the page and joins its parts. */

import { Address } from "./address.js";
import { Aim } from "./aim.js";
import { Boards } from "./boards.js";
import { Camera } from "./camera.js";
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
import { Measure } from "./measure.js";
import { Model } from "./model.js";
import { Marks } from "./percepts.js";
import { Paired } from "./paired.js";
import { Peaks } from "./peaks.js";
import { Photo } from "./photo.js";
import { Picker } from "./pick.js";
import { TaxelIds } from "./taxel_ids.js";
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
const legend = new Legend(byId("legend", HTMLElement), model, choices);
const span = new Span();
const plots = new Plots(model, connection, span);
const peaks = new Peaks(model, span, connection);
const timeline = new Timeline(model, connection, span);
const percept = new PerceptPanel(model, choices, connection, plots);
const fields = new Fields(model, choices, (field) => aim.atField(field));
const chart = new ChartPanel(
  byId("chart", HTMLCanvasElement),
  byId("chart-note", HTMLElement),
  model,
  choices,
);
const touches = new TouchPanel(model, choices, (touch) => aim.atTaxels([...touch.taxels]));
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

const aim = new Aim(stage, model, camera, choices, moved);

function moved() {
  view.request();
  address.changed();
  if (aim.turned) paired.share();
}

let framed = "";
const paired = new Paired(
  camera,
  () => framed,
  () => {
    aim.turned = true;
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
    aim.begin();
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
  aim.showTouchedSide();
  view.request();
  updatePanels();
  updatePlots();
});
model.on("scale", () => {
  view.taxelsChanged = true;
  view.request();
  updatePanels();
});
choices.on("letter", () => {
  peaks.show(false);
  choices.follow(model);
  plots.follow(choices.smallestTouched(model));
  marks.drawn = true;
  updatePlots();
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
  peaks,
  plots,
  span,
  timeline,
  isTurned: () => aim.turned,
  onCamera: () => {
    aim.turned = true;
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
  lookAt: (field) => aim.atField(field),
});

joinToolbar(choices, (name) => {
  if (name === "all") aim.atAll();
  else aim.from(/** @type {import("./camera.js").Preset} */ (name));
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
    look: (name) => aim.from(name),
    lookAt: (field) => aim.atField(field),
    lookAtAll: () => aim.atAll(),
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
