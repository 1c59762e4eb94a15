// Touches of the whole body in a real Chromium: their values, marks, rims, trails, list and events.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { test } from "node:test";
import { bare, coloursAt, open, pause, picture, seek, settled, SOMATIC, view } from "./program.js";

/** The first colour of the palette: the only touch of a frame has it. */
const FIRST = [0x56, 0xb4, 0xe9];
/** Labels of the smallest of a touch's fields, by NDJSON's shares. */
const smallest = (fields) => {
  const names = Object.keys(fields);
  return names.filter((name) => !names.some((other) => other.startsWith(`${name}/`)));
};

const lines = () =>
  execFileSync(
    SOMATIC,
    [
      "run",
      "--quiet",
      "--backend",
      "cpu",
      "--outputs",
      "touches,touches.taxels,touches.place",
      "--sink",
      "-",
    ],
    { encoding: "utf8", maxBuffer: 1e9 },
  )
    .trim()
    .split("\n")
    .map((line) => JSON.parse(line));

const seen = (page) =>
  page.evaluate(() => {
    const { model } = window.somatic;
    return model.touches.map((touch) => ({
      id: touch.id,
      link: model.welcome.links[touch.link].name,
      frame: model.welcome.links[touch.frame]?.name,
      total: touch.total,
      position: touch.position,
      normal: touch.normal,
      axis: touch.axis,
      place: touch.place,
      placeSigma: touch.placeSigma,
      taxels: Array.from(touch.taxels, (taxel) => model.mesh.taxelId[taxel]),
      fields: touch.fields.map(({ index }) => model.welcome.fields[index].name),
      flags: model.touchFlags(touch),
      trail: touch.trail,
    }));
  });

test("touches are those of an uninterrupted run, with the way that they came", async () => {
  const frames = lines();
  const server = await view("--outputs", "total,touches,touches.place");
  const { page, problems } = await open(server.url);
  await pause(page);
  const same = (a, b, what) => assert.deepEqual(a.map(Math.fround), b.map(Math.fround), what);
  for (const index of [149, 20, 208, 3, 150, 60]) {
    const frame = frames[index];
    await seek(page, frame.t);
    const touches = await seen(page);
    assert.equal(touches.length, frame.touches.length, `frame ${index}`);
    touches.forEach((touch, k) => {
      const right = frame.touches[k];
      assert.deepEqual(
        [touch.id, touch.link, touch.frame, touch.taxels, touch.flags],
        [right.id, right.link, right.in, right.taxels, right.flags],
      );
      assert.deepEqual(touch.fields.toSorted(), Object.keys(right.fields).toSorted());
      same([touch.total], [right.total], "total");
      same(touch.position, right.position, "position");
      same(touch.normal, right.normal, "normal");
      if (right.principal_axis) same(touch.axis, right.principal_axis, "axis");
      same(touch.place, right.place ?? [NaN, NaN, NaN], "place");
      same(touch.placeSigma, right.place_sigma ?? [NaN, NaN], "sigma of the place");
      // Every place of the trail is one where the touch was, from a second ago at most.
      const before = frames.slice(0, index + 1).flatMap((of) => {
        const then = of.touches.find(({ id }) => id === right.id);
        return then && frame.t - of.t <= 1 + 1e-9 ? [{ ago: frame.t - of.t, position: then.position }] : [];
      });
      for (const point of touch.trail) {
        const then = before.find(({ ago }) => Math.abs(ago - point.ago) < 1e-5);
        assert.ok(then, `frame ${index}: nothing was ${point.ago} s before`);
        same(point.position, then.position, "a place of the trail");
      }
      assert.ok(touch.trail.length >= Math.min(before.length, 20) / 2, `${touch.trail.length} places`);
    });
  }
  // The panel tells of it, and the mark stands there.
  await seek(page, frames[145].t);
  await page.click(".touch");
  await page.waitForFunction(() => /place[^]*position/.test(document.querySelector(".touch").innerText));
  const marked = await page.evaluate(() => {
    const { model, camera } = window.somatic;
    const { place, frame } = model.touches[0];
    const rows = model.rows.slice(12 * frame, 12 * frame + 12);
    const world = [0, 1, 2].map(
      (r) => rows[4 * r + 3] + place.reduce((s, x, k) => s + rows[4 * r + k] * x, 0),
    );
    const { x, y } = camera.project(world);
    return [x, y];
  });
  await picture(page, "place.png");
  const ring = await page.evaluate(([x, y]) => {
    const canvas = document.querySelector("#marks");
    const ratio = canvas.width / canvas.clientWidth;
    const { data } = canvas.getContext("2d").getImageData(ratio * (x - 7), ratio * y, 1, 1);
    return [...data];
  }, marked);
  assert.ok(ring[3] > 200, `nothing is drawn there: ${ring}`);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("a touch is marked, listed and chosen, its taxels have rims, and it is gone when it ends", async () => {
  const frames = lines();
  const during = frames.find((frame) => frame.t >= 2.9);
  const [touch] = during.touches;
  const before = frames.findLast((frame) => frame.t < during.t && !frame.touches.length);
  const server = await view("--outputs", "total,position,centroid,touches");
  const { page, problems } = await open(server.url);
  await pause(page);
  await seek(page, during.t);
  await settled(page);
  await picture(page, "touches.png");
  // Pixels of its colour beside the taxel, outside the disc.
  const rim = async () => {
    const at = await page.evaluate((ids) => {
      const { model, pixelOfTaxel } = window.somatic;
      const taxels = ids.map((id) => Array.from(model.mesh.taxelId).indexOf(id));
      return taxels.map(pixelOfTaxel).filter((place) => place);
    }, touch.taxels);
    assert.ok(at.length > 3, `${at.length} of its taxels in sight`);
    const around = at.flatMap(([x, y]) => Array.from({ length: 40 }, (_, i) => [x - 3 - i, y]));
    const colours = await coloursAt(page, around);
    return colours.filter((colour) => colour.every((part, k) => Math.abs(part - FIRST[k]) < 30)).length;
  };
  assert.ok((await rim()) > 6, "its taxels have rims of its colour");
  const row = page.locator(".touch");
  assert.equal(await row.count(), 1);
  const said = await row.innerText();
  assert.ok(said.includes(`#${touch.id}`) && said.includes(touch.link), said);
  for (const name of smallest(touch.fields)) assert.ok(said.includes(name), said);
  assert.doesNotMatch(said, /position/);
  await row.click();
  await page.waitForFunction(() =>
    /position[^]*velocity[^]*taxels/.test(document.querySelector(".touch").innerText),
  );
  await page.keyboard.press("Escape");
  await page.waitForFunction(() => !document.querySelector(".touch.chosen"));
  // A click on its mark chooses it too.
  const mark = await page.evaluate(() => {
    const { model, camera } = window.somatic;
    const { position, frame } = model.touches[0];
    const rows = model.rows.slice(12 * frame, 12 * frame + 12);
    const world = [0, 1, 2].map(
      (r) => rows[4 * r + 3] + position.reduce((s, x, k) => s + rows[4 * r + k] * x, 0),
    );
    const box = document.querySelector("#stage").getBoundingClientRect();
    const { x, y } = camera.project(world);
    return [box.left + x, box.top + y];
  });
  await page.mouse.click(mark[0], mark[1]);
  await page.waitForFunction(() => document.querySelector(".touch.chosen"));
  // A field among its shares is chosen by a click.
  await page.click(".touch-field");
  const label = await page.locator(".touch-field").first().innerText();
  await page.waitForFunction((label) => {
    const title = document.querySelector("#percept-title").textContent;
    return title && label.startsWith(`${title} `);
  }, label);
  await page.keyboard.press("Escape");
  await bare(page);
  await settled(page);
  assert.equal(await rim(), 0, "without marks there are no rims");
  // Before its onset there is neither touch nor row.
  await seek(page, before.t);
  await page.waitForFunction(() => /Nothing touches/.test(document.querySelector("#touches").innerText));
  assert.equal(await row.count(), 0);
  // Played over its onset, it is an event.
  await page.keyboard.press(".");
  await page.waitForFunction((t) => window.somatic.model.frame.t > t, before.t);
  await page.keyboard.press(" ");
  await page.waitForFunction(() => window.somatic.model.events.some((event) => event.touch !== null), null, {
    timeout: 60000,
  });
  const event = await page.evaluate(() => window.somatic.model.events.find((of) => of.touch !== null));
  assert.match(event.text, /^touch \d+ (begins|ends) on /);
  assert.deepEqual([event.field, ["onset", "release"].includes(event.kind)], [null, true]);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("without touches the page shows fields", async () => {
  const server = await view("--outputs", "total,position,centroid,principal_axis,anisotropy,area");
  const { page, problems } = await open(server.url);
  await pause(page);
  await seek(page, 2.9);
  assert.equal(await page.locator("#touches-panel").isVisible(), false);
  assert.equal(await page.locator("#marks-choice").inputValue(), "whole fields");
  const inked = () =>
    page.evaluate(() => {
      const canvas = document.querySelector("#marks");
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      return data.some((part, i) => i % 4 === 3 && part > 0);
    });
  assert.equal(await inked(), true);
  await bare(page);
  await settled(page);
  assert.equal(await inked(), false);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});
