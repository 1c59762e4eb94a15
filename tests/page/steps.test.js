// Parts of the page that need no document: what is shown of a recording, addresses of views, tables, a pause, touches over time.
import assert from "node:assert/strict";
import { test } from "node:test";
import { columnsOfBand, csvOf, headOf, singleText, rowsOf } from "../../crates/page/src/web/csv.js";
import { fromFragment, toFragment, withoutToken } from "../../crates/page/src/web/fragment.js";
import { Hold, merged } from "../../crates/page/src/web/hold.js";
import { distanceText } from "../../crates/page/src/web/measure.js";
import { Model } from "../../crates/page/src/web/model.js";
import { Picker } from "../../crates/page/src/web/pick.js";
import { byPixel } from "../../crates/page/src/web/plot.js";
import { Span } from "../../crates/page/src/web/span.js";
import { TouchPast } from "../../crates/page/src/web/touch_plot.js";
import { webmOf } from "../../crates/page/src/web/webm.js";

const near = (a, b, bound = 1e-9) => assert.ok(Math.abs(a - b) <= bound, `${a} is not near ${b}`);

const spanOf = (start_s, end_s, frames) => {
  const span = new Span();
  span.begin({ start_s, end_s, frames });
  return span;
};

test("a recording is shown larger about a moment, within its ends, down to a few frames", () => {
  const span = spanOf(10, 20, 1001);
  assert.deepEqual([span.from, span.to, span.isWhole], [10, 20, true]);
  span.zoom(0.5, 12);
  assert.deepEqual([span.from, span.to, span.isWhole], [11, 16, false]);
  span.pan(-5);
  assert.deepEqual([span.from, span.to], [10, 15]);
  span.pan(100);
  assert.deepEqual([span.from, span.to], [15, 20]);
  span.zoom(1e-9, 17);
  near(span.length, 4 * (10 / 1001));
  span.zoom(Infinity, 17);
  assert.deepEqual([span.from, span.to, span.isWhole], [10, 20, true]);
  // The same recording again keeps what is shown, another one does not.
  span.zoom(0.5, 12);
  span.begin({ start_s: 10, end_s: 20, frames: 1001 });
  assert.equal(span.from, 11);
  span.begin({ start_s: 0, end_s: 20, frames: 1001 });
  assert.deepEqual([span.from, span.to], [0, 20]);
});

test("what is shown goes on with the playhead, but not after somebody looks elsewhere", () => {
  const span = spanOf(0, 100, 1000);
  span.follow(5);
  span.show(0, 10);
  span.follow(10.5);
  assert.deepEqual([span.from, span.to], [10, 20], "a page on");
  span.follow(9);
  assert.deepEqual([span.from, span.to], [0, 10], "and back");
  span.show(50, 60);
  span.follow(9.1);
  assert.deepEqual([span.from, span.to], [50, 60], "it stays where it was put");
  span.follow(55);
  span.follow(60.1);
  assert.ok(span.holds(60.1), "it is followed again");
});

test("what is repeated has two ends in their order", () => {
  const span = spanOf(0, 10, 100);
  span.setLoop(7, 3);
  assert.deepEqual(span.loop, { from: 3, to: 7 });
  span.setLoopEnd("from", 8);
  assert.deepEqual(span.loop, { from: 8, to: 10 });
  span.setLoopEnd("to", 2);
  assert.deepEqual(span.loop, { from: 0, to: 2 });
  span.setLoop(-5, 50);
  assert.deepEqual(span.loop, { from: 0, to: 10 });
  span.toggleLoop();
  assert.equal(span.loop, null);
  span.show(2, 4);
  span.toggleLoop();
  assert.deepEqual(span.loop, { from: 2, to: 4 });
  span.setLoop(5, 5);
  assert.equal(span.loop, null, "no time is not repeated");
});

test("an address has all of a view and comes back", () => {
  const state = {
    t: 2.9,
    camera: { yaw: -1.25, pitch: 0.3, distance: 0.512, target: [1, -0.02, 0.125] },
    panels: ["touches", "plots"],
    look: ["xray", "no-labels"],
    marks: "smallest fields",
    letter: "n",
    field: 'hand/"palm", left & right=#1+',
    touch: 7,
    span: [1, 3.5],
    loop: [1.5, 2],
    plots: [
      { field: "hand/palm", column: "total" },
      { field: "a,b", column: "centroid" },
    ],
  };
  const text = toFragment(state);
  assert.match(text, /^t=2\.9&camera=-1\.25,0\.3,0\.512,1,-0\.02,0\.125&panels=touches,plots&/);
  assert.doesNotMatch(text, /[\s"#<>]/);
  assert.deepEqual(fromFragment(`#${text}`), state);
  assert.equal(toFragment({}), "");
  assert.deepEqual(fromFragment(""), {});
});

test("what an address says wrongly is left out", () => {
  for (const text of [
    "t=",
    "t=one",
    "t=1,2",
    "camera=1,2,3",
    "camera=0,0,-1,0,0,0",
    "camera=0,0,1,0,0,Infinity",
    "span=3,1",
    "loop=2,2",
    "plot=total",
    "touch=x",
    "%E0%A4%A",
    "t=1e999",
  ])
    assert.deepEqual(fromFragment(text), {}, text);
  const token = "0123456789abcdef0123456789abcdef";
  assert.equal(withoutToken(`#token=${token}&t=2.9&look=xray`), "t=2.9&look=xray");
  assert.equal(withoutToken(`#token=${token}`), "");
});

test("a table has a row for each time, empty cells, and no digits too many", () => {
  const { text, rows } = csvOf([
    { name: "hand/palm total (counts)", t: [0, 0.1, 0.2], v: new Float32Array([1, NaN, 0.1]) },
    { name: 'a, "b" (N)', t: [0.1, 0.3], v: new Float32Array([2.5, NaN]) },
  ]);
  assert.equal(text, 'time (s),hand/palm total (counts),"a, ""b"" (N)"\n0,1,\n0.1,,2.5\n0.2,0.1,\n');
  assert.equal(rows, 3);
  for (const x of [0.1, 1 / 3, 16777217, 1e-30, 12345.678, -7])
    assert.equal(Math.fround(Number(singleText(Math.fround(x)))), Math.fround(x));
  assert.equal(headOf("orientation", "rad"), "orientation (rad)");
  assert.equal(headOf("active", "1"), "active");
});

test("a recording's line is one column, or its least and most where parts of the time have several frames", () => {
  const one = { least: new Float32Array([1, NaN, 3]), most: new Float32Array([1, NaN, 3]) };
  const several = { least: new Float32Array([1, 2]), most: new Float32Array([1, 5]) };
  const names = (band) =>
    columnsOfBand(
      "total",
      "N",
      band,
      [0, 1, 2].map((bin) => ({ t: bin, bin })).slice(0, band.least.length),
    ).map(({ name }) => name);
  assert.deepEqual(names(one), ["total (N)"]);
  assert.deepEqual(names(several), ["total least (N)", "total most (N)"]);
  // Frames that are shown in several parts have the rows: each value is taken halfway to the next frame.
  const time = { start_s: 0, end_s: 1, frames: 11 };
  const rows = rowsOf({ from: 0, to: 1, bins: 100 }, time);
  assert.deepEqual(
    rows.map(({ bin }) => bin),
    [5, 15, 25, 35, 45, 55, 65, 75, 85, 95, 99],
  );
  near(rows[3].t, 0.3);
  const some = rowsOf({ from: 0.25, to: 0.5, bins: 100 }, time);
  assert.deepEqual(
    some.map(({ t, bin }) => [Number(t.toFixed(9)), bin]),
    [
      [0.3, 40],
      [0.4, 80],
      [0.5, 99],
    ],
  );
  assert.deepEqual(rowsOf({ from: 0, to: 1, bins: 2 }, time), [
    { t: 0.25, bin: 0 },
    { t: 0.75, bin: 1 },
  ]);
});

const frame = (seq, more = {}) => ({
  seq,
  t: seq / 10,
  pressure: null,
  health: null,
  pose: null,
  percepts: null,
  touches: null,
  selfContacts: null,
  samples: null,
  ...more,
});

test("a pause keeps what is shown, and the newest of each section comes when it ends", () => {
  const model = new Model();
  model.welcome = { mode: "live" };
  model.health = new Uint8Array([0]);
  const hold = new Hold(model);
  let shown = 0;
  model.on("frame", () => shown++);
  const seen = [];
  model.on("samples", () => seen.push(...model.samples.t));
  hold.take(frame(1, { touches: [] }));
  hold.toggle();
  assert.ok(hold.isOn);
  const [a, b] = [new Float32Array([1]), new Float32Array([2])];
  const health = new Uint8Array([0]);
  hold.take(frame(2, { pressure: a, health, samples: { t: [0.2], values: [] } }));
  hold.take(frame(3, { pressure: b, health, samples: { t: [0.3], values: [] } }));
  hold.take(frame(4, { samples: { t: [0.4], values: [] } }));
  assert.deepEqual([shown, model.frame.seq, hold.frames, seen.length], [1, 1, 3, 0]);
  hold.toggle();
  assert.deepEqual([shown, model.frame.seq, hold.isOn], [2, 4, false]);
  assert.equal(model.pressure, b, "a section that the newest leaves out is as it was");
  assert.deepEqual(seen, [0.2, 0.3, 0.4], "plots have no gap");
  hold.take(frame(5));
  assert.equal(model.frame.seq, 5);
  assert.equal(merged(null, frame(6)).pressure, null);
});

test("a pause is bounded, ends with the connection, and recordings have none", () => {
  const model = new Model();
  model.welcome = { mode: "live" };
  const hold = new Hold(model);
  hold.toggle();
  assert.equal(hold.isOn, false, "nothing has been shown yet");
  hold.take(frame(1));
  hold.toggle();
  for (let i = 0; i < 40; i++) hold.take(frame(i, { samples: { t: new Float64Array(4096), values: [] } }));
  assert.ok(hold.sampleCount <= 1 << 16 && hold.samples.length === 16);
  hold.forget();
  assert.deepEqual([hold.isOn, hold.newest, hold.samples.length], [false, null, 0]);
  model.welcome = { mode: "recording" };
  hold.toggle();
  assert.equal(hold.isOn, false);
});

test("touches over time are kept by id, in whatever order they are seen", () => {
  const past = new TouchPast();
  const touch = (id, total, force = NaN) => ({ id, total, force });
  const colour = (id) => id % 3;
  past.take(0.2, [touch(3, 5), touch(4, 1)], colour);
  past.take(0.4, [touch(3, 7)], colour);
  past.take(0.3, [touch(3, 6)], colour);
  past.take(0.3, [touch(3, 6.5)], colour);
  const [three, four] = past.within(0, 1);
  assert.deepEqual([three.id, three.t, three.v, three.colour], [3, [0.2, 0.3, 0.4], [5, 6.5, 7], 0]);
  assert.deepEqual([four.id, four.v], [4, [1]]);
  assert.deepEqual(
    past.within(0.25, 1).map(({ id }) => id),
    [3],
  );
  // Where forces are known these are shown.
  past.take(0.5, [touch(3, 8, 2.5)], colour);
  assert.deepEqual(past.within(0.5, 1)[0].v.slice(-1), [2.5]);
  for (let id = 10; id < 300; id++) past.take(1, [touch(id, 1)], colour);
  assert.equal(past.touches.size, 200);
  assert.ok(!past.touches.has(3) && past.touches.has(299));
});

test("points of a line are drawn where they are, with gaps where none were seen", () => {
  const points = { t: [0, 0.1, 0.2, 0.3, 5, 5.1], v: [1, 2, 3, 4, 5, 6] };
  const how = { from: 0, to: 10, live: false, bandRange: { from: 0, to: 1 } };
  const { least, most, reach } = byPixel({ colour: "", points }, how, 100);
  assert.deepEqual([least[0], most[1], least[50], Math.max(...most.filter((v) => v === v))], [1, 2, 5, 6]);
  assert.ok(reach < 40, `${reach} pixels`);
});

test("a distance is in millimetres, and a point of the surface is under the pointer and stays on its triangle", () => {
  assert.deepEqual([0.00512, 0.0234, 1.2].map(distanceText), ["5.12 mm", "23.4 mm", "1200.0 mm"]);
  const model = new Model();
  model.rows = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]);
  model.mesh = {
    position: new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, -1, 1, 0, -1, 0, 1, -1]),
    link: new Uint32Array(6),
    corners: new Uint32Array([3, 4, 5, 0, 1, 2]),
    taxelPosition: new Float32Array(0),
    taxelRadius: new Float32Array(0),
    taxelLink: new Uint32Array(0),
  };
  model.poseVersion = 1;
  const camera = { eye: [0.25, 0.25, 3], ray: () => [0, 0, -1] };
  const picker = new Picker(model, camera);
  const hit = picker.surfaceAt(0, 0);
  assert.deepEqual(hit.corners, [0, 1, 2], "the nearer of two");
  picker.pointAt(hit.corners, hit.weights).forEach((x, k) => near(x, [0.25, 0.25, 0][k], 1e-6));
  assert.equal(picker.hides([0.25, 0.25, -1], 0.01), true);
  assert.equal(picker.hides([0.25, 0.25, 0], 0.01), false);
  model.rows[3] = 2;
  model.poseVersion = 2;
  near(picker.pointAt(hit.corners, hit.weights)[0], 2.25, 1e-6);
  camera.eye = [5, 5, 3];
  assert.equal(picker.surfaceAt(0, 0), null);
});

/** The elements of a WebM file, each with its id, where it begins and its content. */
function elementsOf(bytes, from = 0, to = bytes.length) {
  const found = [];
  for (let at = from; at < to;) {
    const begin = at;
    const length = Math.clz32(bytes[at]) - 23;
    const id = bytes.slice(at, at + length).reduce((sum, byte) => 256 * sum + byte, 0);
    at += length;
    assert.equal(bytes[at], 1, "a size in eight bytes");
    const size = bytes.slice(at + 1, at + 8).reduce((sum, byte) => 256 * sum + byte, 0);
    at += 8;
    found.push({ id, begin, from: at, content: bytes.slice(at, at + size) });
    at += size;
  }
  return found;
}

test("a video has its pictures at their times, and says where each part of it begins", async () => {
  const pictures = [0, 40, 80, 35000, 80000].map((at, i) => ({
    data: Uint8Array.from([i, 7]),
    at,
    isKey: i === 0 || i === 2,
  }));
  const about = { codec: "V_VP8", width: 640, height: 480, length: 80033 };
  const bytes = new Uint8Array(await new Blob(webmOf(pictures, about)).arrayBuffer());
  const [head, segment, ...more] = elementsOf(bytes);
  assert.deepEqual([head.id, segment.id, more.length], [0x1a45dfa3, 0x18538067, 0]);
  const parts = elementsOf(bytes, segment.from, bytes.length);
  const cluster = 0x1f43b675;
  assert.deepEqual(
    parts.map(({ id }) => id),
    [0x1549a966, 0x1654ae6b, cluster, cluster, cluster, cluster, 0x1c53bb6b],
  );
  const number = (content) => content.reduce((sum, byte) => 256 * sum + byte, 0);
  const clusters = parts.filter(({ id }) => id === cluster);
  const shown = clusters.flatMap(({ content }) => {
    const [time, ...blocks] = elementsOf(content);
    return blocks.map(({ content: block }) => [
      number(time.content) + ((block[1] << 8) | block[2]),
      block[3] === 0x80,
      block[4],
    ]);
  });
  assert.deepEqual(
    shown,
    pictures.map(({ at, isKey, data }) => [at, isKey, data[0]]),
  );
  const cues = elementsOf(parts.at(-1).content).map(({ content }) => {
    const [time, places] = elementsOf(content);
    return [number(time.content), number(elementsOf(places.content)[1].content)];
  });
  assert.deepEqual(
    cues,
    clusters.map(({ begin }, i) => [[0, 80, 35000, 80000][i], begin - segment.from]),
  );
});
