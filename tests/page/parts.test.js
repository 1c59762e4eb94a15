// Parts of the page that need no browser.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Choices, MARKS } from "../../crates/page/src/web/choices.js";
import { countOf } from "../../crates/page/src/web/boards.js";
import { Camera, PRESETS } from "../../crates/page/src/web/camera.js";
import { addRect, changedRects } from "../../crates/page/src/web/dirty.js";
import { PALETTE } from "../../crates/page/src/web/dom.js";
import {
  scaleFor,
  seconds,
  short,
  shortPath,
  tickText,
  ticks,
  vectorWithUnit,
  withUnit,
} from "../../crates/page/src/web/format.js";
import { endedTicks } from "../../crates/page/src/web/legend.js";
import { poseToRows, toWorld } from "../../crates/page/src/web/math.js";
import { Model } from "../../crates/page/src/web/model.js";
import { orientationLine, taxelInWorld, touchInWorld } from "../../crates/page/src/web/places.js";
import { byPixel, runsOf } from "../../crates/page/src/web/plot.js";
import { spacings } from "../../crates/page/src/web/rest.js";
import { Spots } from "../../crates/page/src/web/spots.js";
import { roundLength } from "../../crates/page/src/web/scale_bar.js";
import { sideLoadText } from "../../crates/page/src/web/self_contacts.js";
import { tokenIn } from "../../crates/page/src/web/tokens.js";
import { BOARD_STATES } from "../../crates/page/src/web/wire.js";
import { colourIndex, fillColours } from "../../crates/page/src/web/taxels.js";

const near = (a, b, bound = 1e-6) => assert.ok(Math.abs(a - b) <= bound, `${a} is not near ${b}`);

test("lengths are millimetres and angles degrees", () => {
  assert.equal(withUnit(0.0123, "m", "Pa"), "12.3 mm");
  assert.equal(withUnit(Math.fround(1e-4), "m", "Pa"), "0.100 mm");
  assert.equal(withUnit(9e-5, "m", "Pa"), "90 µm");
  assert.equal(withUnit(Math.PI / 2, "rad", "Pa"), "90.0°");
  assert.equal(withUnit(1500, "P", "Pa"), "1.50 kPa");
  assert.equal(withUnit(1500, "P", "count"), "1500 counts");
  assert.equal(withUnit(null, "P", "N"), "–");
  assert.equal(withUnit(NaN, "m", "N"), "–");
  assert.equal(vectorWithUnit([0.001, -0.0025], "m", "N"), "1.00, -2.50 mm");
  assert.equal(short(0), "0");
  assert.equal(scaleFor("m²", 1e-4, "N").unit, "mm²");
  assert.equal(seconds(3661.25), "1:01:01.2");
});

test("ticks are round and inside", () => {
  assert.deepEqual(ticks(0, 40, 4), [0, 10, 20, 30, 40]);
  assert.deepEqual(ticks(0, 1023, 4), [0, 500, 1000]);
  assert.equal(tickText(0.5, [0, 0.5, 1]), "0.5");
});

test("the colour of a pressure is round(clamp(p / max) * 255)", () => {
  assert.equal(colourIndex(0, 10), 0);
  assert.equal(colourIndex(10, 10), 255);
  assert.equal(colourIndex(99, 10), 255);
  assert.equal(colourIndex(-1, 10), 0);
  assert.equal(colourIndex(5, 10), 128);
  const colours = Array.from({ length: 256 }, (_, i) => [i, i, i]);
  const out = new Uint8Array(16);
  fillColours(new Float32Array([0, 5, NaN, 1e9]), new Uint8Array([0, 0, 0, 4]), 10, colours, [1, 2, 3], out);
  assert.deepEqual([...out.subarray(0, 4)], [1, 2, 3, 15]);
  assert.deepEqual([...out.subarray(4, 8)], [128, 128, 128, 0]);
  assert.equal(out[11], 1, "a taxel without a pressure looks missing");
  assert.deepEqual([...out.subarray(12)], [255, 255, 255, 4]);
  const unsent = new Uint8Array([7, 1, 0, 0]);
  fillColours(new Float32Array([NaN, NaN, 0, 0]), unsent, 10, colours, [1, 2, 3], out, () => [9, 8, 7]);
  assert.deepEqual([...out.subarray(0, 4)], [9, 8, 7, 7], "what no source sends has its field's colour");
  assert.equal(out[7], 1, "what a source should have sent is missing");
});

test("changed taxels give few rectangles that hold them", () => {
  const [before, now] = [new Uint8Array(16), new Uint8Array(16)];
  now[0] = now[12] = 1;
  const spots = new Spots(new Model(), new Camera());
  spots.x = Float32Array.of(5, 105, 205, 305);
  [spots.y, spots.reach] = [new Float32Array(4).fill(5), new Float32Array(4).fill(5)];
  const limits = { width: 1000, height: 5, rects: 4 };
  assert.deepEqual(changedRects(before, now, spots, limits), [
    { x0: 0, y0: 0, x1: 10, y1: 5 },
    { x0: 300, y0: 0, x1: 310, y1: 5 },
  ]);
  spots.reach[3] = 0;
  assert.equal(changedRects(before, now, spots, limits).length, 1, "what is not drawn changes nothing");
  const rects = [];
  for (let i = 0; i < 5; i++) addRect(rects, { x0: 100 * i, y0: 0, x1: 100 * i + 10, y1: 10 }, 2);
  assert.equal(rects.length, 2);
  assert.equal(Math.max(...rects.map((r) => r.x1)), 410);
});

test("of very many changed taxels one rectangle holds all", () => {
  const count = 1000;
  const spots = new Spots(new Model(), new Camera());
  spots.x = Float32Array.from({ length: count }, (_, i) => 10 + (i % 2 ? 900 - 0.1 * i : 0.1 * i));
  [spots.y, spots.reach] = [new Float32Array(count).fill(20), new Float32Array(count).fill(5)];
  const now = new Uint8Array(4 * count).fill(1);
  const limits = { width: 2000, height: 100, rects: 4 };
  assert.deepEqual(changedRects(new Uint8Array(4 * count), now, spots, limits), [
    { x0: 5, y0: 15, x1: 915, y1: 25 },
  ]);
});

test("taxels are in the picture where the camera has them, but for those that look away", () => {
  const model = new Model();
  const s = Math.SQRT1_2;
  model.setMesh({
    taxelId: Uint32Array.of(0, 1, 2),
    taxelLink: Uint32Array.of(0, 0, 0),
    taxelPosition: Float32Array.of(0, 0, 0, 0.01, 0.02, 0, 0, 0, 0.03),
    taxelNormal: Float32Array.of(1, 0, 0, 1, 0, 0, -1, 0, 0),
    taxelRadius: Float32Array.of(0.001, 0.002, 0.003),
    taxelArea: new Float32Array(3),
    // Turned by a quarter about z, and moved.
    restPose: Float32Array.of(0.1, 0.2, 0.3, 0, 0, s, s),
  });
  const camera = new Camera();
  camera.resize(800, 600);
  [camera.target, camera.distance, camera.yaw, camera.pitch] = [[0.1, 0.2, 0.3], 0.3, Math.PI / 2, 0];
  camera.update();
  const spots = new Spots(model, camera);
  spots.update(0.5, false);
  near(spots.x[0], 200, 1e-3);
  near(spots.y[0], 150, 1e-3);
  for (const taxel of [0, 1]) {
    const { point, radius } = taxelInWorld(model, taxel);
    const at = camera.project(point);
    near(spots.x[taxel], at.x / 2, 1e-3);
    near(spots.y[taxel], at.y / 2, 1e-3);
    assert.ok(spots.reach[taxel] > (radius * camera.pixelsPerMetre(at.depth)) / 2);
  }
  assert.equal(spots.reach[2], 0, "it looks away");
  const { x0, x1 } = spots.rectOf(0);
  assert.ok(spots.isIn(0, { x0: x1 - 1, y0: 0, x1: 800, y1: 600 }));
  assert.ok(!spots.isIn(0, { x0: x1 + 1, y0: 0, x1: 800, y1: 600 }) && x0 < x1);
  assert.ok(!spots.isIn(2, { x0: 0, y0: 0, x1: 800, y1: 600 }));
  spots.update(0.5, true);
  assert.ok(spots.reach[2] > 0, "where both sides are drawn it is there");
  // Behind the eye.
  [camera.target, camera.distance] = [[0.1, -0.5, 0.3], 0.1];
  camera.update();
  spots.update(0.5, true);
  assert.deepEqual([...spots.reach], [0, 0, 0]);
});

test("a pose turns and moves a point", () => {
  const s = Math.SQRT1_2;
  const rows = new Float32Array(12);
  poseToRows([1, 2, 3, 0, 0, s, s], 0, rows);
  const [x, y, z] = toWorld(rows, 0, [1, 0, 0], 1);
  near(x, 1);
  near(y, 3);
  near(z, 3);
  assert.deepEqual(toWorld(rows, 0xffffffff, [4, 5, 6], 1), [4, 5, 6]);
});

test("the camera frames all points and projects them inside", () => {
  const camera = new Camera();
  camera.resize(900, 600);
  const points = [];
  for (let i = 0; i < 8; i++) points.push([i & 1 ? 0.2 : -0.2, i & 2 ? 0.3 : -0.1, i & 4 ? 0.8 : 0]);
  camera.frame(points, 0.08);
  const seen = points.map((p) => camera.project(p));
  for (const { x, y } of seen) assert.ok(x >= 0 && x <= 900 && y >= 0 && y <= 600);
  assert.ok(
    Math.max(...seen.map((p) => p.y)) - Math.min(...seen.map((p) => p.y)) > 450,
    "it fills the picture",
  );
  const ray = camera.ray(seen[3].x, seen[3].y);
  const way = points[3].map((v, k) => v - camera.eye[k]);
  const size = Math.hypot(...way);
  ray.forEach((v, k) => near(v, way[k] / size, 1e-5));
});

test("what is up, forward and left in the world is so in the picture", () => {
  const camera = new Camera();
  camera.resize(900, 600);
  const from = (/** @type {import("../../crates/page/src/web/camera.js").Preset} */ side) => {
    [camera.yaw, camera.pitch] = PRESETS[side];
    camera.update();
    const [forward, left, up] = [
      [0.1, 0, 0],
      [0, 0.1, 0],
      [0, 0, 0.1],
    ].map((p) => camera.project(p));
    return { forward, left, up };
  };
  const front = from("front");
  assert.ok(camera.eye[0] > 0 && front.up.y < 300 && front.left.x > 450);
  const side = from("left");
  assert.ok(camera.eye[1] > 0 && side.up.y < 300 && side.forward.x < 450);
  const top = from("top");
  assert.ok(camera.eye[2] > 0 && top.forward.y > 300 && top.left.x > 450);
});

test("no peak is lost where many samples share a pixel", () => {
  const t = new Float64Array(1024);
  const v = new Float32Array(1024);
  for (let i = 0; i < 1000; i++) [t[i], v[i]] = [i / 100, i === 555 ? 9 : i === 700 ? NaN : 1];
  const how = { from: 0, to: 10, live: true, bandRange: { from: 0, to: 1 } };
  const { least, most } = byPixel({ colour: "", ring: { t, v, begin: 0, size: 1000 } }, how, 50);
  assert.equal(Math.max(...most), 9);
  assert.equal(Math.min(...least), 1);
});

/** A touch as a frame has it, with what a test needs. */
const touch = (id, more = {}) => ({
  id,
  link: 0,
  frame: 0,
  flags: 0,
  active: 1,
  age: 1,
  total: 3,
  force: NaN,
  peak: 2,
  anisotropy: NaN,
  position: [0, 0, 0],
  normal: [0, 0, 1],
  axis: [NaN, NaN, NaN],
  spread: [NaN, NaN],
  velocity: [NaN, NaN, NaN],
  place: [NaN, NaN, NaN],
  placeSigma: [NaN, NaN],
  taxels: new Uint32Array(0),
  links: [],
  fields: [],
  trail: [],
  ...more,
});

test("a touch is marked where its link is, and its trail where that was", () => {
  const model = new Model();
  model.rows = new Float32Array(24);
  const s = Math.SQRT1_2;
  // The first link is turned by 90° about z and moved; the second is only moved.
  poseToRows([1, 0, 0, 0, 0, s, s, 0, 5, 0, 0, 0, 0, 1], 0, model.rows);
  poseToRows([1, 0, 0, 0, 0, s, s, 0, 5, 0, 0, 0, 0, 1], 1, model.rows);
  const marked = touchInWorld(
    model,
    touch(3, {
      position: [0.5, 0, 0],
      axis: [1, 0, 0],
      spread: [0.02, 0.01],
      velocity: [0.1, 0, 0],
      trail: [
        { ago: 0.5, frame: 1, position: [0, 0, 0.25] },
        { ago: 0.25, frame: 0xffffffff, position: [7, 8, 9] },
      ],
    }),
  );
  const same = (a, b) => a.forEach((x, i) => near(x, b[i]));
  same(marked.point, [1, 0.5, 0]);
  same(marked.normal, [0, 0, 1]);
  // Two standard deviations along and across.
  same(marked.halfAxes[0], [0, 0.04, 0]);
  same(marked.halfAxes[1].map(Math.abs), [0.02, 0, 0]);
  same(marked.motion, [0, 0.02, 0]);
  same(marked.trail[0].point, [0, 5, 0.25]);
  assert.deepEqual(marked.trail[1], { ago: 0.25, point: [7, 8, 9] });
  const plain = touchInWorld(model, touch(4));
  assert.deepEqual([plain.halfAxes, plain.motion, plain.trail.length], [null, null, 1]);
  // Its mark stands where it is known best, and its trail ends at its position.
  const placed = touchInWorld(model, touch(5, { frame: 1, position: [0, 1, 0], place: [0, 2, 0] }));
  same(placed.point, toWorld(model.rows, 1, [0, 2, 0], 1));
  same(placed.trail[0].point, toWorld(model.rows, 1, [0, 1, 0], 1));
});

test("a touch keeps its colour until it ends, and names its load and flags", () => {
  const model = new Model();
  model.begin({
    run: "a",
    quantity: "Pa",
    fields: [],
    columns: [],
    flags: [],
    touches: true,
    touch_flags: ["one_taxel", null, "young"],
    scale: { max: 1, from: "" },
  });
  const colours = (...ids) => {
    model.apply({ touches: ids.map((id) => touch(id)) });
    return ids.map((id) => model.touchColour(id));
  };
  assert.deepEqual(colours(4, 7), [0, 1]);
  assert.deepEqual(colours(7, 8, 9), [1, 0, 2]);
  assert.deepEqual(colours(), []);
  model.apply({ touches: [touch(5, { taxels: new Uint32Array([3, 8]), flags: 0b111, total: 1500 })] });
  assert.equal(model.touchOf(8)?.id, 5);
  assert.equal(model.touchOf(4), null);
  assert.deepEqual(model.touchFlags(model.touch(5)), ["one_taxel", "young"]);
  assert.equal(model.touchLoadText(model.touch(5)), "1.50 kPa");
  assert.equal(model.touchLoadText(touch(6, { force: 2.5 })), "2.50 N");
  // A side of a self-contact says the same as its touch.
  const sides = [
    { link: 0, touch: 5, total: 9 },
    { link: 1, touch: 77, total: 1e4 },
  ];
  assert.deepEqual(
    sides.map((side) => sideLoadText(model, side)),
    ["1.50 kPa", "10 kPa"],
  );
  model.touch(5).force = 2.5;
  assert.equal(sideLoadText(model, sides[0]), "2.50 N");
  // A frame without the section has the touches of the one before.
  model.apply({ touches: null });
  assert.equal(model.touches.length, 1);
});

test("taxels of a touch have rims of its colour, and the field that is chosen has its own", () => {
  globalThis.matchMedia ??= () => ({ matches: true, addEventListener() {} });
  const model = new Model();
  model.begin({
    run: "a",
    quantity: "Pa",
    fields: [{ members: [2, 4], letter: null, parent: null, chart: {} }],
    columns: [],
    flags: [],
    touches: true,
    touch_flags: [],
    scale: { max: 1, from: "" },
  });
  model.apply({
    touches: [touch(1, { taxels: new Uint32Array([1, 2]) }), touch(2, { taxels: new Uint32Array([3]) })],
  });
  const choices = new Choices();
  choices.forget(true);
  assert.deepEqual(choices.offered, [...MARKS]);
  const rims = choices.rings(model);
  assert.deepEqual([...rims.keys()], [1, 2, 3]);
  assert.deepEqual([rims.get(1), rims.get(3)], [PALETTE[0], PALETTE[1]]);
  assert.deepEqual(choices.marked(model), [], "fields have no marks then");
  choices.choose(0);
  assert.notDeepEqual(choices.rings(model).get(2), PALETTE[0]);
  choices.choose(null);
  choices.nextMarks();
  assert.equal(choices.marks, "whole fields");
  assert.equal(choices.rings(model).size, 0);
  // A run without touches offers none.
  choices.forget(false);
  assert.deepEqual([choices.marks, choices.offered.length], ["whole fields", MARKS.length - 1]);
});

test("an absent column says why", () => {
  const model = new Model();
  const column = (name, components) => ({ name, unit: "m", components, help: "" });
  model.begin({
    run: "a",
    fields: [{}],
    columns: [column("total", 1), column("principal_axis", 1)],
    flags: ["no_contact", "one_taxel", "tie"],
    scale: { max: 1, from: "" },
  });
  model.apply({
    percepts: {
      field: new Uint32Array([0]),
      flags: new Uint32Array([0b10]),
      present: new Uint32Array([0b01]),
      columns: new Map([[0, new Float32Array([3])]]),
    },
  });
  assert.deepEqual([...model.value(0, "total")], [3]);
  assert.equal(model.value(0, "principal_axis"), null);
  assert.equal(model.reason(0, "principal_axis"), "one_taxel");
  assert.equal(model.value(1, "total"), null);
});

test("boards that speak are counted as speaking", () => {
  const boards = BOARD_STATES.map((state) => ({ state }));
  assert.equal(countOf(boards), "1 of 4 speaking");
  assert.equal(countOf([boards[1], boards[1]]), "2 speaking");
});

test("an angle that goes past its end breaks its line, and nothing else does", () => {
  const line = (values) => ({ least: values, most: values, reach: 1 });
  const turning = line([2.9, 3.1, 0.1, 0.3, NaN, 0.5]);
  const spans = (runs) => runs.map((run) => run.map(({ x }) => x));
  assert.deepEqual(spans(runsOf(turning, Math.PI)), [[0, 1], [2, 3], [5]]);
  assert.deepEqual(spans(runsOf(turning, Infinity)), [[0, 1, 2, 3], [5]]);
  // Both ends in one pixel are two points, without a line between them.
  const both = runsOf({ least: [0.01, 0.02], most: [3.1, 0.03], reach: 1 }, Math.PI);
  assert.deepEqual(
    both.map((run) => run.map(({ low, high }) => [low, high])),
    [[[0.01, 0.01]], [[3.1, 3.1]], [[0.02, 0.03]]],
  );
});

test("a bar of colours ends with its number", () => {
  const texts = (most) => endedTicks(most).map(({ part, text }) => [Math.round(100 * part), text]);
  assert.deepEqual(texts(880), [
    [0, "0"],
    [57, "500"],
    [100, "880"],
  ]);
  assert.deepEqual(texts(40).at(-1), [100, "40"]);
  // One right before the end gives way.
  assert.deepEqual(texts(4.855).at(-1), [100, "4.86"]);
  assert.ok(texts(4.3).every(([part]) => part === 100 || part < 85));
});

test("a length is round and fits", () => {
  assert.deepEqual(
    [0.0234, 0.07, 12, 0.0051, 0.19].map((most) => roundLength(most).text),
    ["2 cm", "5 cm", "10 m", "5 mm", "10 cm"],
  );
  for (const most of [1e-4, 0.033, 7]) assert.ok(roundLength(most).metres <= most);
});

test("a long path shows its end", () => {
  assert.equal(shortPath("walk.csv"), "walk.csv");
  const long = shortPath("/home/somebody/experiments/of/last/year/with/a/robot/walk.csv");
  assert.equal(long, "…/of/last/year/with/a/robot/walk.csv");
  assert.ok(shortPath("x".repeat(99)).length === 40);
});

test("a token is found in an address, and nowhere else", () => {
  const token = "0123456789abcdef0123456789abcdef";
  assert.equal(tokenIn(` http://127.0.0.1:7879/#token=${token} `), token);
  assert.equal(tokenIn(`#token=${token}&t=2.9`), token);
  assert.equal(tokenIn(token), token);
  for (const text of ["", "http://127.0.0.1:7879/#t=2.9", `${token}0`, "#token=short"])
    assert.equal(tokenIn(text), null);
});

test("spacing is the distance to the nearest taxel of the same link", () => {
  const mesh = {
    taxelPosition: new Float32Array([0, 0, 0, 0.01, 0, 0, 0.014, 0, 0, 0.0101, 0, 0]),
    taxelLink: new Uint32Array([0, 0, 0, 1]),
  };
  assert.deepEqual(
    spacings(mesh).map((m) => Math.round(1e6 * m)),
    [4000, 4000, 10000],
  );
});

test("a field keeps its colour, and fields with other names begin anew", () => {
  const model = new Model();
  const welcome = (names) => ({
    run: "1",
    columns: [{ name: "peak", unit: "P", components: 1 }],
    fields: names.map((name) => ({ name, letter: null, label: name, parent: null, link: 0, members: [] })),
    links: [],
  });
  model.begin(welcome(["a", "b", "c"]));
  assert.deepEqual([model.fieldColour(2), model.fieldColour(0), model.fieldColour(2)], [0, 1, 0]);
  model.begin(welcome(["a", "b", "c"]));
  assert.equal(model.fieldColour(0), 1);
  model.begin(welcome(["a", "b"]));
  assert.equal(model.fieldColour(1), 0);
  assert.deepEqual([model.loadColumn, model.loadUnit, model.plottedColumn], ["peak", "P", "peak"]);
});

test("how hard a field is pressed is its force where there is a unit, and areas if that is a pressure", () => {
  const model = new Model();
  const columns = ["total", "force"].map((name) => ({ name, unit: "", components: 1 }));
  const column = (quantity, areas) => {
    model.begin({ run: "1", columns, fields: [], links: [], quantity });
    const none = new Float32Array(0);
    const mesh = {
      taxelId: new Uint32Array(areas.length),
      restPose: none,
      taxelArea: Float32Array.from(areas),
    };
    model.setMesh(mesh);
    return [model.loadColumn, model.loadUnit];
  };
  assert.deepEqual(column("count", [1e-5]), ["total", "P"]);
  assert.deepEqual(column("Pa", [0, 0]), ["total", "P"]);
  assert.deepEqual(column("Pa", [0, 1e-5]), ["force", "N"]);
  assert.deepEqual(column("N", [0, 0]), ["force", "N"]);
});

test("an orientation line ends at the two farthest points of its field", () => {
  // Pressed by 4 at the right, by 2 at the upper left: their points are at the taxel and half of the way.
  const uv = [
    [0.02, 0],
    [-0.02, 0.02],
    [0, -0.001],
  ];
  const centroid = [0.004, 0.004];
  const points = [
    [0.02, 0],
    [0.004 - 0.012, 0.004 + 0.008],
  ];
  const angle = Math.atan2(points[0][1] - points[1][1], points[0][0] - points[1][0]) + Math.PI;
  const model = {
    welcome: { fields: [{ members: [0, 1, 2], weights: null, chart: { uv } }] },
    pressure: [4, 2, 1],
    value: (_, column) => (column === "orientation" ? [angle % Math.PI] : centroid),
  };
  const line = orientationLine(model, 0);
  line.flat().forEach((x, i) => near(x, points.flat()[i]));
});
