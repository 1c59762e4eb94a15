// The page in a real Chromium: what it shows of taxels, fields, plots, poses, recorded percepts and many taxels.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import {
  bare,
  browser,
  coloursAt,
  folder,
  open,
  pause,
  picture,
  seek,
  serve,
  settled,
  SOMATIC,
  taxelIds,
  view,
  writeRecording,
} from "./program.js";

/** How many pixels of a canvas are nearly of a colour, in a part of it given in parts of its width and height. */
const countOf = (page, selector, [x0, y0, x1, y1], colour) =>
  page.evaluate(
    ([selector, x0, y0, x1, y1, colour]) => {
      const canvas = document.querySelector(selector);
      const [w, h] = [canvas.width, canvas.height];
      const at = [x0 * w, y0 * h, Math.max(1, (x1 - x0) * w), Math.max(1, (y1 - y0) * h)].map(Math.round);
      const { data } = canvas.getContext("2d").getImageData(...at);
      let count = 0;
      for (let i = 0; i < data.length; i += 4)
        if (data[i + 3] > 128 && colour.every((part, k) => Math.abs(part - data[i + k]) < 40)) count++;
      return count;
    },
    [selector, x0, y0, x1, y1, colour],
  );

const hand = (values) => {
  const ids = taxelIds("hand");
  return [ids, (n) => ids.map((id) => values(id, n))];
};

test("a taxel under the pointer is described, and a field is looked at", async () => {
  const [ids, row] = hand((id, n) => (id === 4 ? n : 0));
  const server = await view(writeRecording("ramp.csv", ids, 101, 0.1, row), "--body", "hand");
  const { page, problems } = await open(server.url);
  await pause(page);
  await seek(page, 7.5);
  const taxel = await page.evaluate(() => Array.from(window.somatic.model.mesh.taxelId).indexOf(4));
  for (const key of ["1", "2", "3", "4", "5", "6"]) {
    await page.keyboard.press(key);
    await settled(page);
    if (await page.evaluate((taxel) => window.somatic.pixelOfTaxel(taxel), taxel)) break;
  }
  const at = await page.evaluate((taxel) => window.somatic.pixelOfTaxel(taxel), taxel);
  assert.ok(at, "the taxel is in sight from one of the six sides");
  await page.mouse.move(at[0] - 3, at[1]);
  await page.mouse.move(at[0], at[1]);
  await page.waitForFunction(() => /raw\s*75\b/.test(document.getElementById("tip").innerText), null, {
    timeout: 20000,
  });
  const tip = await page.locator("#tip").innerText();
  for (const part of [/Taxel 4\b/, /link\s*hand/, /pressure\s*75\b/, /state\s*good/]) assert.match(tip, part);
  await page.mouse.move(5, 5);
  await page.waitForFunction(() => document.getElementById("tip").hidden);
  // A click chooses the smallest field that holds it; `f` takes it in.
  await page.mouse.click(at[0], at[1]);
  const chosen = await page.locator("#percept-title").innerText();
  await page.keyboard.press("f");
  await settled(page);
  const { inside, members, middle } = await page.evaluate((label) => {
    const { model, pixelOfTaxel } = window.somatic;
    const field = model.welcome.fields.find((field) => field.label === label);
    const places = field.members.map(pixelOfTaxel).filter((place) => place);
    const box = document.getElementById("stage").getBoundingClientRect();
    const mean = [0, 1].map((k) => places.reduce((sum, place) => sum + place[k], 0) / places.length);
    return {
      members: field.members.length,
      inside: places.length,
      middle: [(mean[0] - box.left) / box.width, (mean[1] - box.top) / box.height],
    };
  }, chosen);
  assert.equal(inside, members, `all of ${chosen} is in sight`);
  assert.ok(
    middle.every((part) => Math.abs(part - 0.5) < 0.2),
    `${chosen} is at ${middle}`,
  );
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("no peak of a plot is lost", async () => {
  // One frame of 4,000 is pressed hard: a quarter of a pixel.
  const [ids, row] = hand((id, n) => (id === 4 ? (n === 3000 ? 1000 : 100 + (n % 7)) : 0));
  const server = await view(writeRecording("spike.csv", ids, 4001, 0.01, row), "--body", "hand");
  const { page, problems } = await open(server.url);
  await pause(page);
  await page.waitForFunction(() => window.somatic.model.timeline.until >= 40, null, { timeout: 60000 });
  // The line of the moment that is shown is at the left end.
  await seek(page, 0);
  await page.waitForFunction(() => document.querySelector("#plots canvas"), null, { timeout: 20000 });
  await page.locator("#plots canvas").first().scrollIntoViewIfNeeded();
  // The columns of the plot whose upper half has a line, as parts of its width.
  const peaks = () =>
    page.evaluate(() => {
      const canvas = document.querySelector("#plots canvas");
      const { width, height } = canvas;
      const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
      const columns = [];
      for (let x = Math.round(0.3 * width); x < width; x++) {
        let count = 0;
        for (let y = Math.round(0.1 * height); y < 0.5 * height; y++) {
          const at = 4 * (y * width + x);
          const [r, g, b] = data.subarray(at, at + 3);
          if (data[at + 3] > 100 && Math.max(r, g, b) - Math.min(r, g, b) > 60) count++;
        }
        if (count > 0.2 * height) columns.push(x / width);
      }
      return columns;
    });
  // A plot asks for its past again as more of it is computed; on a busy machine the whole of it takes a while.
  let bright = await peaks();
  for (let tries = 0; tries < 200 && bright.length === 0; tries++) {
    await page.waitForTimeout(100);
    bright = await peaks();
  }
  assert.ok(bright.length >= 1 && bright.length < 12, `columns with a peak: ${bright}`);
  assert.ok(Math.max(...bright) - Math.min(...bright) < 0.03, `one peak: ${bright}`);
  assert.ok(Math.abs(bright[0] - 0.75) < 0.12, `at three quarters: ${bright}`);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("link poses in frames move the body", async () => {
  const server = await serve(
    "run",
    "--quiet",
    "--source",
    "-",
    "--body",
    "hand",
    "--sink",
    "page:127.0.0.1:0",
  );
  const { page, problems } = await open(server.url);
  const send = (t, pose) =>
    server.child.stdin.write(`${JSON.stringify({ t, values: { 4: 50 }, pose: { hand: pose } })}\n`);
  const placeAfter = async (t, pose) => {
    send(t, pose);
    await page.waitForFunction((t) => window.somatic.model.frame?.t === t, t, { timeout: 20000 });
    await settled(page);
    return page.evaluate(() => {
      const { model, pixelOfTaxel } = window.somatic;
      return Array.from(model.mesh.taxelId, (_, taxel) => pixelOfTaxel(taxel));
    });
  };
  const rest = await placeAfter(0.1, [0, 0, 0, 0, 0, 0, 1]);
  const again = await placeAfter(0.2, [0, 0, 0, 0, 0, 0, 1]);
  assert.deepEqual(again, rest, "the same pose is the same picture");
  const moved = await placeAfter(0.3, [0, 0.05, 0, 0, 0, 0, 1]);
  const both = rest.map((place, i) => [place, moved[i]]).filter(([a, b]) => a && b);
  assert.ok(both.length > 3, `${both.length} taxels are in sight in both`);
  const [dx, dy] = [0, 1].map((k) => both.reduce((sum, [a, b]) => sum + b[k] - a[k], 0) / both.length);
  // Seen from any side, 50 mm up is up, or towards us.
  assert.ok(Math.hypot(dx, dy) > 20 && dy <= 0, `moved by ${dx}, ${dy} pixels`);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("other percepts in a recording are marked", async () => {
  const sink = `mcap:${join(folder, "touch.mcap")}`;
  execFileSync(SOMATIC, ["run", "--quiet", "--record", "frames,percepts", "--sink", sink]);
  writeFileSync(join(folder, "half.toml"), "[all]\ngain = 0.5\n");
  const mark = async (...calibration) => {
    const server = await view("touch.mcap", ...calibration);
    const { page, problems } = await open(server.url);
    await pause(page);
    await page.waitForFunction(
      () => window.somatic.model.timeline.until >= window.somatic.model.welcome.time.end_s,
      null,
      { timeout: 60000 },
    );
    await seek(page, 2.9);
    await page.keyboard.press("e");
    await page.waitForFunction(() => window.somatic.model.explanation, null, { timeout: 60000 });
    await settled(page);
    if (calibration.length) await picture(page, "recorded.png");
    const colour = await page.evaluate(() => {
      const probe = document.createElement("span");
      probe.style.color = "var(--warn)";
      document.body.append(probe);
      const colour = getComputedStyle(probe).color.match(/\d+/g).slice(0, 3).map(Number);
      probe.remove();
      return colour;
    });
    const seen = {
      pixels: await countOf(page, "#timeline-canvas", [0, 0, 1, 0.1], colour),
      count: (await page.locator("#differences").isVisible())
        ? await page.locator("#differences").innerText()
        : "",
      recorded: await page.locator("#explanation .recorded").count(),
    };
    assert.deepEqual(problems, []);
    await page.close();
    await server.stop();
    return seen;
  };
  assert.deepEqual(await mark(), { pixels: 0, count: "", recorded: 0 });
  const other = await mark("--calibration", join(folder, "half.toml"));
  assert.ok(
    other.pixels > 50 && /^\d+ frames differ$/.test(other.count) && other.recorded > 0,
    `${JSON.stringify(other)}`,
  );
});

test("a browser without WebGL 2 says what to do", async () => {
  const server = await view();
  const page = await browser.newPage();
  const problems = [];
  page.on("pageerror", (error) => problems.push(String(error)));
  await page.addInitScript(() => {
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      return kind === "webgl2" ? null : getContext.call(this, kind, ...rest);
    };
  });
  await page.goto(server.url);
  await page.locator("#no-webgl").waitFor({ state: "visible", timeout: 20000 });
  assert.match(await page.locator("#no-webgl").innerText(), /graphics acceleration/);
  // Percepts are still shown.
  await page.waitForFunction(() => window.somatic.model.frame?.t > 0, null, { timeout: 20000 });
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("ten thousand taxels are drawn, each in its colour", async () => {
  const sheet = join(folder, "sheet.glb");
  execFileSync(SOMATIC, ["author", "--grid", "100x100", "--pitch", "5mm", "-o", sheet]);
  const ids = taxelIds(sheet);
  assert.equal(ids.length, 10000);
  const row = (n) => ids.map((id) => Math.max(0, Math.round(400 * Math.sin(id / 333 + n / 60))));
  const server = await view(writeRecording("sheet.csv", ids, 500, 1 / 250, row), "--body", sheet);
  const { page, problems } = await open(server.url);
  const rate = await page.evaluate(async () => {
    const [drawn, since] = [window.somatic.framesDrawn, performance.now()];
    await new Promise((done) => setTimeout(done, 4000));
    return (1000 * (window.somatic.framesDrawn - drawn)) / (performance.now() - since);
  });
  console.log(`${ids.length} taxels at 250 Hz: ${rate.toFixed(1)} frames/s`);
  // Other tests run beside.
  assert.ok(rate > 0.3, `${rate} frames/s`);
  await pause(page);
  await seek(page, 1);
  await page.keyboard.press("5");
  await bare(page);
  await settled(page);
  await picture(page, "sheet.png");
  const expected = await page.evaluate(() => {
    const { model, pixelOfTaxel } = window.somatic;
    const taxels = Array.from({ length: 40 }, (_, i) => 1111 + 200 * i);
    return taxels.map((taxel) => ({
      at: pixelOfTaxel(taxel),
      colour:
        model.welcome.colours[
          Math.round(Math.min(1, Math.max(0, model.pressure[taxel] / model.scaleMax)) * 255)
        ],
      pressed: model.pressure[taxel] > 0,
    }));
  });
  const pressed = expected.filter((taxel) => taxel.at && taxel.pressed);
  assert.ok(pressed.length > 10, `${pressed.length} pressed taxels in sight`);
  const seen = await coloursAt(
    page,
    pressed.map((taxel) => taxel.at),
  );
  const off = pressed.map(({ colour }, i) =>
    Math.max(...colour.map((part, k) => Math.abs(part - seen[i][k]))),
  );
  assert.ok(Math.max(...off) <= 2, `off by ${off}`);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});
