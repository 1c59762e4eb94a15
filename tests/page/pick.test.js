// What is under the pointer: the trees of boxes find what a loop over all triangles and taxels finds, and look at few of them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { BoxTree } from "../../crates/page/src/web/box_tree.js";
import { Camera } from "../../crates/page/src/web/camera.js";
import { cross, dot, subtract } from "../../crates/page/src/web/math.js";
import { Model } from "../../crates/page/src/web/model.js";
import { Picker } from "../../crates/page/src/web/pick.js";
import { taxelInWorld } from "../../crates/page/src/web/places.js";

/** Numbers in [0, 1) that are the same in each run. */
function randomFrom(seed) {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

/** Dented balls of `rows` × `2 rows` vertices, one for each link, joined to the next one by a strip. A taxel lies on each `every`th triangle. */
function bodyOf(links, rows, every) {
  const [position, link, corners] = [[], [], []];
  const columns = 2 * rows;
  for (let of = 0; of < links; of++) {
    const first = of * rows * columns;
    for (let row = 0; row < rows; row++)
      for (let column = 0; column < columns; column++) {
        const [up, around] = [(Math.PI * (row + 0.5)) / rows, (2 * Math.PI * column) / columns];
        const radius = 0.05 * (1 + 0.15 * Math.sin(3 * around + of) * Math.sin(2 * up));
        position.push(
          radius * Math.sin(up) * Math.cos(around),
          radius * Math.sin(up) * Math.sin(around),
          radius * Math.cos(up),
        );
        link.push(of);
        const [a, b] = [column, (column + 1) % columns].map((at) => first + row * columns + at);
        if (row + 1 < rows) corners.push(a, a + columns, b, b, a + columns, b + columns);
        else if (of + 1 < links) corners.push(a, a + columns, b);
      }
  }
  const [taxelLink, taxelPosition, taxelNormal] = [[], [], []];
  const at = (vertex) => position.slice(3 * vertex, 3 * vertex + 3);
  for (let t = 0; t < corners.length; t += 3 * every) {
    const [a, b, c] = [0, 1, 2].map((k) => at(corners[t + k]));
    const normal = cross(subtract(b, a), subtract(c, a));
    const size = Math.hypot(...normal);
    if (link[corners[t]] !== link[corners[t + 1]] || !(size > 1e-12)) continue;
    taxelLink.push(link[corners[t]]);
    taxelPosition.push(...[0, 1, 2].map((k) => (a[k] + b[k] + c[k]) / 3));
    taxelNormal.push(...normal.map((x) => x / size));
  }
  return {
    position: Float32Array.from(position),
    link: Uint32Array.from(link),
    corners: Uint32Array.from(corners),
    taxelId: Uint32Array.from(taxelLink, (_, i) => i),
    taxelLink: Uint32Array.from(taxelLink),
    taxelPosition: Float32Array.from(taxelPosition),
    taxelNormal: Float32Array.from(taxelNormal),
    taxelRadius: new Float32Array(taxelLink.length).fill((0.08 / rows) * Math.sqrt(every)),
    taxelArea: new Float32Array(taxelLink.length),
    restPose: new Float32Array(7 * links),
  };
}

/** Links on a spiral, turned at random. */
function posesOf(links, random) {
  const poses = [];
  for (let of = 0; of < links; of++) {
    const turn = [0, 1, 2, 3].map(() => random() - 0.5);
    const size = Math.hypot(...turn);
    const [c, s] = [Math.cos(of), Math.sin(of)];
    poses.push(0.08 * c, 0.08 * s, 0.06 * of + 0.02 * random(), ...turn.map((q) => q / size));
  }
  return Float32Array.from(poses);
}

function pickerOf(mesh, random) {
  const model = new Model();
  mesh.restPose.set(posesOf(mesh.restPose.length / 7, random));
  model.setMesh(mesh);
  const camera = new Camera();
  camera.resize(1280, 720);
  camera.radius = 0.4;
  return { model, camera, picker: new Picker(model, camera) };
}

/** Looks at the body from anywhere. */
function turn(camera, links, random) {
  [camera.yaw, camera.pitch] = [2 * Math.PI * random(), Math.PI * (random() - 0.5)];
  camera.target = [0, 0, 0.06 * links * random()];
  camera.distance = 0.15 + 0.6 * random();
  camera.update();
}

/** The same answers by loops over everything. */
class Loop {
  constructor(picker) {
    Object.assign(this, picker);
    this.picker = picker;
  }

  /** Ways along a line to each triangle that it meets, by another formula than the page's. */
  *hits(from, way) {
    const { corners } = this.model.mesh;
    const at = (corner) => this.picker.pointAt([corner], [1]);
    for (let t = 0; t < corners.length; t += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => at(corners[t + k]));
      const normal = cross(subtract(b, a), subtract(c, a));
      const s = dot(normal, subtract(a, from)) / dot(normal, way);
      const point = way.map((w, k) => from[k] + s * w);
      const isInside = [
        [a, b],
        [b, c],
        [c, a],
      ].every(([p, q]) => dot(normal, cross(subtract(q, p), subtract(point, p))) >= 0);
      if (isInside && s > 0) yield { t, s };
    }
  }

  surfaceAt(x, y) {
    const hits = [...this.hits(this.camera.eye, this.camera.ray(x, y))];
    return hits.sort((a, b) => a.s - b.s)[0] ?? null;
  }

  taxelAt(x, y, through) {
    const { model, camera } = this;
    const ray = camera.ray(x, y);
    const found = [];
    for (let taxel = 0; taxel < model.mesh.taxelId.length; taxel++) {
      const { point, normal, radius } = taxelInWorld(model, taxel);
      const way = subtract(point, camera.eye);
      const depth = dot(way, ray);
      const off = Math.hypot(...way.map((w, k) => w - depth * ray[k]));
      if (!through && dot(normal, way) >= 0) continue;
      if (depth > 0 && off < Math.max(radius, 4 / camera.pixelsPerMetre(depth)))
        found.push({ taxel, depth, radius });
    }
    found.sort((a, b) => a.depth - b.depth);
    const isSeen = ({ taxel, radius }) => !this.hides(taxelInWorld(model, taxel).point, 0.7 * radius);
    return found.find((place) => through || isSeen(place))?.taxel ?? null;
  }

  hides(point, slack) {
    const { eye } = this.camera;
    const way = subtract(point, eye);
    for (const { s } of this.hits(eye, way)) if (s < 1 - slack / Math.hypot(...way)) return true;
    return false;
  }
}

test("trees find the taxel and the surface that a loop over all finds, also after links have moved", () => {
  const random = randomFrom(1);
  const links = 4;
  const { model, camera, picker } = pickerOf(bodyOf(links, 8, 2), random);
  const loop = new Loop(picker);
  const seen = { surface: 0, taxel: 0, through: 0, hidden: 0, free: 0 };
  for (let ray = 0; ray < 200; ray++) {
    if (ray % 40 === 39) model.pose(posesOf(links, random));
    if (ray % 4 === 0) turn(camera, links, random);
    // Mostly near the middle, where the body is.
    const [x, y] = [1280, 720].map((size) => size * (0.5 + 0.6 * (random() - 0.5)));
    const [surface, expected] = [picker.surfaceAt(x, y), loop.surfaceAt(x, y)];
    assert.equal(surface === null, expected === null, `ray ${ray}`);
    if (surface && expected) {
      const { corners } = model.mesh;
      assert.deepEqual(surface.corners, [...corners.subarray(expected.t, expected.t + 3)], `ray ${ray}`);
    }
    const [taxel, through] = [false, true].map((through) => picker.taxelAt(x, y, through));
    assert.equal(taxel, loop.taxelAt(x, y, false), `ray ${ray}`);
    assert.equal(through, loop.taxelAt(x, y, true), `ray ${ray} through the body`);
    seen.surface += surface !== null;
    seen.taxel += taxel !== null;
    seen.through += through !== null;
    const { point, radius } = taxelInWorld(model, Math.floor(model.mesh.taxelId.length * random()));
    const isHidden = picker.hides(point, 0.7 * radius);
    assert.equal(isHidden, loop.hides(point, 0.7 * radius), `ray ${ray} to a taxel`);
    seen[isHidden ? "hidden" : "free"]++;
  }
  for (const [what, count] of Object.entries(seen)) assert.ok(count > 20, `${what}: ${count}`);
});

test("a tree over one place, over nothing and along an axis", () => {
  const boxes = new Float32Array(60).fill(0.5);
  const tree = new BoxTree(boxes, Array(10).keys());
  const along = (from, way, until = Infinity) => {
    const found = [];
    tree.along(from, way, until, (thing, until) => (found.push(thing), until));
    return found.sort((a, b) => a - b);
  };
  const all = Array.from({ length: 10 }, (_, i) => i);
  assert.deepEqual(along([0.5, 0.5, 0], [0, 0, 1]), all);
  assert.deepEqual(along([0.5, 0.6, 0], [0, 0, 1]), []);
  assert.deepEqual(along([0.5, 0.5, 1], [0, 0, 1]), [], "what lies behind");
  assert.deepEqual(along([0, 0, 0], [1, 1, 1], 0.4), [], "what lies past the end");
  const none = new BoxTree(new Float32Array(0), []);
  none.along([0, 0, 0], [0, 0, 1], Infinity, () => assert.fail("there is nothing"));
});

test("at 50,000 taxels a hover looks at few triangles and taxels, in 30 ms", (t) => {
  const random = randomFrom(2);
  const links = 25;
  const mesh = bodyOf(links, 32, 2);
  assert.ok(mesh.taxelId.length >= 48_000 && mesh.corners.length > 290_000, `${mesh.taxelId.length} taxels`);
  const { model, camera, picker } = pickerOf(mesh, random);
  camera.radius = 1;
  const begun = performance.now();
  picker.update();
  const built = performance.now();
  model.pose(posesOf(links, random));
  picker.update();
  t.diagnostic(
    `trees: ${(built - begun).toFixed(0)} ms, after a pose ${(performance.now() - built).toFixed(0)} ms`,
  );
  const looks = { triangles: 0, taxels: 0 };
  const counted = (name, look) =>
    function (...args) {
      looks[name]++;
      return look.apply(this, args);
    };
  picker.surface.meets = counted("triangles", picker.surface.meets);
  const along = picker.taxels.along.bind(picker.taxels);
  picker.taxels.along = (rows, from, way, until, look, spread) =>
    along(rows, from, way, until, counted("taxels", look), spread);
  const hovers = [];
  let found = 0;
  for (let i = 0; i < 300; i++) {
    if (i % 10 === 0) turn(camera, links, random);
    looks.triangles = looks.taxels = 0;
    const begun = performance.now();
    const taxel = picker.taxelAt(1280 * (0.4 + 0.2 * random()), 720 * (0.4 + 0.2 * random()), false);
    hovers.push({ ms: performance.now() - begun, ...looks });
    found += taxel !== null;
  }
  assert.ok(found > 50, `${found} taxels under the pointer`);
  const most = (name) => Math.max(...hovers.map((hover) => hover[name]));
  assert.ok(most("triangles") < 3000 && most("taxels") < 1500, `${most("triangles")} and ${most("taxels")}`);
  assert.ok(most("taxels") > 0 && most("triangles") > 0, "they are counted");
  const times = hovers.map(({ ms }) => ms).sort((a, b) => a - b);
  const [middle, worst] = [times[times.length >> 1], times.at(-1)];
  t.diagnostic(`a hover: ${middle.toFixed(2)} ms, at most ${worst.toFixed(1)} ms`);
  t.diagnostic(`at most ${most("triangles")} triangles and ${most("taxels")} taxels`);
  assert.ok(middle < 30, `${middle} ms`);
});
