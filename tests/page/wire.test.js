// The decoders of binary messages, against messages made by hand after the protocol.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  decodeFrame,
  decodeHistory,
  decodeMesh,
  decodePeaks,
  IN_WORLD_BIT,
  isPresent,
  kindOf,
  say,
} from "../../crates/page/src/web/wire.js";

/** Writes values one after the other, little-endian. */
function writer(bytes) {
  const view = new DataView(new ArrayBuffer(bytes));
  let at = 0;
  const put = (size, set) => (value) => {
    set.call(view, at, value, true);
    at += size;
  };
  return {
    u8: put(1, view.setUint8),
    u16: put(2, view.setUint16),
    u32: put(4, view.setUint32),
    u64: (value) => put(8, view.setBigUint64)(BigInt(value)),
    f32: put(4, view.setFloat32),
    f64: put(8, view.setFloat64),
    pad: () => (at = (at + 7) & ~7),
    buffer: view.buffer,
  };
}

function head(w, { sections, fields = 0, touches = 0, samples = 0, columns = 0, answers = 0 }) {
  w.u8(2);
  w.u8(5);
  w.u16(sections);
  w.u32(7);
  w.u64(123456789012);
  w.f64(2.5);
  w.u32(3);
  w.f32(1.5);
  w.f32(NaN);
  for (const value of [fields, touches, samples, 42, answers]) w.u32(value);
  w.f32(21.5);
  w.u32(0);
  w.u64(columns);
}

/** A touch with one place in its trail, by the table of the protocol: 152 bytes, and what it lists. */
function putTouch(w, { id, frame, force, taxels, links, fields }) {
  for (const x of [id, 0, frame, 5, 9, taxels.length, links.length, fields.length, 1]) w.u32(x);
  for (const x of [0.5, 10, force, 7, 0.25]) w.f32(x);
  for (const x of [1, 2, 3, 0, 0, 1, 0, 1, 0, 0.5, 0.25, 4, 5, 6, 1.5, 2, 3, 0.125, NaN]) w.f32(x);
  for (const taxel of taxels) w.u32(taxel);
  for (const [index, share] of [...links, ...fields]) {
    w.u32(index);
    w.f32(share);
  }
  w.f32(0.25);
  w.u32(frame);
  for (const x of [7, 8, 9]) w.f32(x);
}

const scene = { taxels: 3, links: 1, components: [1, 2, 3] };

test("a frame with nothing but its head", () => {
  const w = writer(72);
  head(w, { sections: 0 });
  const frame = decodeFrame(w.buffer, scene);
  assert.equal(frame.seq, 7);
  assert.equal(frame.frame, 123456789012);
  assert.equal(frame.t, 2.5);
  assert.equal(frame.skipped, 3);
  assert.equal(frame.p50, 1.5);
  assert.ok(Number.isNaN(frame.p99));
  assert.equal(frame.newestEvent, 42);
  assert.equal(frame.engineMicroseconds, 21.5);
  for (const part of ["pressure", "health", "pose", "percepts", "touches", "samples"])
    assert.equal(frame[part], null);
});

test("a frame with all sections, each padded to 8 bytes", () => {
  const w = writer(72 + 16 + 32 + 64 + 176 + 32);
  head(w, { sections: 31, fields: 2, touches: 1, samples: 2, columns: 0b101, answers: 4 });
  for (const p of [0, 1.5, NaN]) w.f32(p);
  for (const state of [0, 4, 1]) w.u8(state);
  w.pad();
  for (const x of [1, 2, 3, 0, 0, 0, 1]) w.f32(x);
  w.pad();
  for (const x of [5, 6, 1, 2, 0b101, 0, 0b1, 0x80000000]) w.u32(x);
  for (const x of [10, 20]) w.f32(x);
  for (const x of [1, 2, 3, 4, 5, 6]) w.f32(x);
  w.pad();
  putTouch(w, { id: 77, frame: 0, force: NaN, taxels: [0, 2], fields: [[5, 0.75]], links: [[0, 1]] });
  w.pad();
  for (const t of [2.25, 2.5]) w.f64(t);
  for (const x of [1, 2, 3, NaN]) w.f32(x);
  const frame = decodeFrame(w.buffer, scene);
  assert.deepEqual([...frame.pressure], [0, 1.5, NaN]);
  assert.deepEqual([...frame.health], [0, 4, 1]);
  assert.deepEqual([...frame.pose], [1, 2, 3, 0, 0, 0, 1]);
  assert.deepEqual([...frame.percepts.field], [5, 6]);
  assert.deepEqual([...frame.percepts.flags], [1, 2]);
  assert.deepEqual([...frame.percepts.present], [0b101, 0, 0b1, 0x80000000]);
  const present = [0, 1].map((k) =>
    [0, 1, 2, 31, 32, IN_WORLD_BIT].map((bit) => isPresent(frame.percepts, k, bit)),
  );
  assert.deepEqual(present, [
    [true, false, true, false, false, false],
    [true, false, false, false, false, true],
  ]);
  assert.deepEqual([...frame.percepts.columns.keys()], [0, 2]);
  assert.deepEqual([...frame.percepts.columns.get(0)], [10, 20]);
  assert.deepEqual([...frame.percepts.columns.get(2)], [1, 2, 3, 4, 5, 6]);
  assert.equal(frame.touches.length, 1);
  const [touch] = frame.touches;
  assert.deepEqual([touch.id, touch.link, touch.frame, touch.flags, touch.active], [77, 0, 0, 5, 9]);
  assert.deepEqual([touch.age, touch.total, touch.peak, touch.anisotropy], [0.5, 10, 7, 0.25]);
  assert.ok(Number.isNaN(touch.force));
  assert.deepEqual(
    [touch.position, touch.normal],
    [
      [1, 2, 3],
      [0, 0, 1],
    ],
  );
  assert.deepEqual(
    [touch.axis, touch.spread, touch.velocity],
    [
      [0, 1, 0],
      [0.5, 0.25],
      [4, 5, 6],
    ],
  );
  assert.deepEqual(
    [touch.place, touch.placeSigma],
    [
      [1.5, 2, 3],
      [0.125, NaN],
    ],
  );
  assert.deepEqual([...touch.taxels], [0, 2]);
  assert.deepEqual(touch.links, [{ index: 0, share: 1 }]);
  assert.deepEqual(touch.fields, [{ index: 5, share: 0.75 }]);
  assert.deepEqual(touch.trail, [{ ago: 0.25, frame: 0, position: [7, 8, 9] }]);
  assert.equal(frame.samples.answers, 4);
  assert.deepEqual([...frame.samples.t], [2.25, 2.5]);
  assert.deepEqual(
    frame.samples.values.map((v) => [...v]),
    [
      [1, 2],
      [3, NaN],
    ],
  );
});

test("tangential forces come with the pressures, and columns beyond the 32nd have bits of their own", () => {
  const w = writer(72 + 16 + 16 + 24);
  head(w, { sections: 1 + 64 + 4, fields: 1, columns: 2 ** 33 + 1 });
  for (const p of [1, 25.5, NaN]) w.f32(p);
  for (const state of [0, 0, 5]) w.u8(state);
  w.pad();
  for (const s of [0.25, -0.5, NaN, NaN]) w.f32(s);
  for (const x of [3, 0, 1, 2]) w.u32(x);
  for (const x of [7, 8]) w.f32(x);
  const wide = { taxels: 3, pulled: 2, links: 1, components: new Array(34).fill(1) };
  const frame = decodeFrame(w.buffer, wide);
  assert.deepEqual([...frame.shear], [0.25, -0.5, NaN, NaN]);
  assert.deepEqual([...frame.percepts.columns.keys()], [0, 33]);
  assert.equal(frame.percepts.columns.get(33)[0], 8);
  assert.ok(isPresent(frame.percepts, 0, 33) && !isPresent(frame.percepts, 0, 1));
});

test("touches stand one after the other, whatever each lists", () => {
  const w = writer(72 + 3 * 152 + 12 + 8 + 16);
  head(w, { sections: 8, touches: 3 });
  putTouch(w, { id: 1, frame: 0xffffffff, force: 2, taxels: [], links: [], fields: [] });
  putTouch(w, {
    id: 2,
    frame: 0,
    force: 2,
    taxels: [2, 1, 0],
    links: [[0, 0.5]],
    fields: [
      [1, 1],
      [2, 1],
    ],
  });
  putTouch(w, { id: 9, frame: 0, force: 2, taxels: [], links: [], fields: [] });
  const { touches } = decodeFrame(w.buffer, scene);
  assert.deepEqual(
    touches.map((touch) => [touch.id, touch.frame, touch.force, [...touch.taxels], touch.fields.length]),
    [
      [1, 0xffffffff, 2, [], 0],
      [2, 0, 2, [2, 1, 0], 2],
      [9, 0, 2, [], 0],
    ],
  );
  assert.deepEqual(touches[2].trail[0].position, [7, 8, 9]);
});

test("a frame that ends too early is an error", () => {
  const w = writer(72 + 8);
  head(w, { sections: 1 });
  assert.throws(() => decodeFrame(w.buffer, scene), /ends too early/);
  assert.throws(() => decodeFrame(new ArrayBuffer(20), scene), /too short/);
});

test("another version is an error", () => {
  const w = writer(24);
  w.u8(1);
  w.u8(9);
  assert.throws(() => kindOf(w.buffer), /version 9/);
  assert.throws(() => kindOf(new ArrayBuffer(4)), /too short/);
});

test("a mesh", () => {
  const w = writer(20 + 3 * 28 + 12 + 40 + 28);
  w.u8(1);
  w.u8(5);
  w.u16(0);
  for (const count of [3, 1, 1, 1]) w.u32(count);
  for (let i = 0; i < 18; i++) w.f32(i);
  for (const link of [0, 0, 0xffffffff]) w.u32(link);
  for (const corner of [0, 1, 2]) w.u32(corner);
  w.u32(99);
  w.u32(0);
  for (const x of [1, 2, 3, 0, 1, 0, 0.5, 0.25]) w.f32(x);
  for (const x of [0, 0, 1, 0, 0, 0, 1]) w.f32(x);
  assert.equal(kindOf(w.buffer), 1);
  const mesh = decodeMesh(w.buffer);
  assert.deepEqual([...mesh.normal], [9, 10, 11, 12, 13, 14, 15, 16, 17]);
  assert.deepEqual([...mesh.link], [0, 0, 0xffffffff]);
  assert.deepEqual([...mesh.corners], [0, 1, 2]);
  assert.deepEqual([...mesh.taxelId], [99]);
  assert.deepEqual([...mesh.taxelNormal], [0, 1, 0]);
  assert.deepEqual([mesh.taxelRadius[0], mesh.taxelArea[0]], [0.5, 0.25]);
  assert.deepEqual([...mesh.restPose], [0, 0, 1, 0, 0, 0, 1]);
});

test("a history", () => {
  const w = writer(32 + 16);
  w.u8(3);
  w.u8(5);
  w.u16(0);
  for (const value of [5, 2, 1]) w.u32(value);
  w.f64(1);
  w.f64(2);
  for (const x of [0, NaN, 1, NaN]) w.f32(x);
  const history = decodeHistory(w.buffer);
  assert.deepEqual([history.id, history.bins, history.from, history.to], [5, 2, 1, 2]);
  assert.deepEqual(
    [[...history.least[0]], [...history.most[0]]],
    [[[0, NaN]], [[1, NaN]]].map((x) => x[0]),
  );
});

test("highest pressures", () => {
  const w = writer(24 + 8);
  w.u8(4);
  w.u8(5);
  w.u16(0);
  w.u32(6);
  w.f64(1);
  w.f64(2);
  for (const x of [2.5, NaN]) w.f32(x);
  assert.equal(kindOf(w.buffer), 4);
  const { id, from, to, peaks } = decodePeaks(w.buffer);
  assert.deepEqual([id, from, to, [...peaks]], [6, 1, 2, [2.5, NaN]]);
});

test("outgoing messages", () => {
  assert.deepEqual(JSON.parse(say.hello("ab", null)), {
    type: "hello",
    version: 5,
    token: "ab",
    after_event: null,
  });
  assert.deepEqual(JSON.parse(say.history(1, 0, 2, 300, [{ field: 1, column: "total", component: 0 }])), {
    type: "history",
    id: 1,
    from_s: 0,
    to_s: 2,
    bins: 300,
    series: [{ field: 1, column: "total", component: 0 }],
  });
});
