// What the page can do beside showing, in a real Chromium: addresses of views, a part of the time, tables, distances, a pause.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
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
  taxelIds,
  view,
  writeRecording,
} from "./program.js";

test("an address shows the same view again, without the token", async () => {
  const server = await view();
  const { page, problems } = await open(server.url);
  await pause(page);
  await seek(page, 2.9);
  await page.keyboard.press("3");
  await page.keyboard.press("+");
  for (const key of ["x", "n", "c", "U", "z"]) await page.keyboard.press(key);
  await page.evaluate(() => window.somatic.span.setLoop(2, 3.5));
  await page.locator(".touch").click();
  await page.locator(".field-name", { hasText: "hand/palm/radial_distal" }).click();
  // The panel follows with the next drawing.
  await page.waitForFunction(
    () => document.querySelector("#percept-title").textContent === "hand/palm/radial_distal",
  );
  // It may be plotted already, as a field that was touched while the recording played: then the first click takes it away.
  const plot = page.locator(".plot-button").first();
  await plot.click();
  if ((await plot.getAttribute("aria-pressed")) !== "true") await plot.click();
  const state = (page) =>
    page.evaluate(() => {
      const { model, camera, span } = window.somatic;
      const { yaw, pitch, distance, target } = camera;
      return {
        t: model.frame.t,
        camera: [yaw, pitch, distance, ...target].map((x) => Math.round(1e3 * x)),
        span: [span.from, span.to].map((t) => Math.round(1e3 * t)),
        loop: span.loop,
        pressed: [...document.querySelectorAll("[aria-pressed=true]")].map(
          (button) => button.id || button.title,
        ),
        open: [...document.querySelectorAll("details[open]")].map((panel) => panel.id),
        title: document.querySelector("#percept-title").textContent,
        chosen: document.querySelectorAll(".touch.chosen").length,
        chips: [...document.querySelectorAll("#plots .chip")].map((chip) => chip.textContent),
      };
    });
  const before = await state(page);
  assert.equal(before.chosen, 1);
  // The address follows by itself.
  await page.waitForFunction(() => /plot=.*hand/.test(location.hash) && /&touch=/.test(location.hash));
  const address = await page.evaluate(() => location.href);
  assert.doesNotMatch(address, /token/);
  await page.keyboard.press("l");
  assert.equal(await page.evaluate(() => location.href), address);
  const { page: other } = await open(address);
  await other.waitForFunction(() => document.querySelector(".touch.chosen"), null, { timeout: 20000 });
  await other.waitForTimeout(500);
  assert.deepEqual(await state(other), before);
  assert.equal(await other.evaluate(() => location.href), address);
  assert.deepEqual(problems, []);
  await other.close();
  await page.close();
  await server.stop();
});

test("the timeline is zoomed and repeats a part, by keys, buttons, wheel and drags, and plots go with it", async () => {
  const ids = taxelIds("hand");
  const name = writeRecording("long.csv", ids, 2001, 0.01, (n) => ids.map((id) => (id === 4 ? n % 100 : 0)));
  const server = await view(name, "--body", "hand", "--speed", "4");
  const { page, problems } = await open(server.url);
  await pause(page);
  await page.waitForFunction(() => window.somatic.model.timeline.until >= 20, null, { timeout: 60000 });
  await seek(page, 10);
  const span = () =>
    page.evaluate(() => {
      const { from, to, loop, isWhole } = window.somatic.span;
      return { from, to, loop, isWhole };
    });
  const box = await page.locator("#timeline-canvas").boundingBox();
  const at = (part) => [box.x + part * box.width, box.y + box.height / 2];
  await page.mouse.move(...at(0.25));
  await page.mouse.wheel(0, -400);
  await page.waitForFunction(() => !window.somatic.span.isWhole);
  const near = await span();
  assert.ok(Math.abs(near.from + 0.25 * (near.to - near.from) - 5) < 0.02, JSON.stringify(near));
  assert.ok((await page.locator("#plots-range").innerText()).startsWith(near.from.toFixed(2)));
  await page.mouse.dblclick(...at(0.5));
  assert.ok((await span()).isWhole);
  await seek(page, 10.02);
  await page.click("#zoom-in");
  assert.ok(Math.abs((await span()).to - 16) < 0.1, JSON.stringify(await span()));
  await page.keyboard.press("Z");
  assert.ok((await span()).isWhole);
  // A drag with Shift repeats a part.
  await page.keyboard.down("Shift");
  await page.mouse.move(...at(0.5));
  await page.mouse.down();
  await page.mouse.move(...at(0.6), { steps: 4 });
  await page.mouse.up();
  await page.keyboard.up("Shift");
  const { loop } = await span();
  assert.ok(Math.abs(loop.from - 10) < 0.1 && Math.abs(loop.to - 12) < 0.1, JSON.stringify(loop));
  assert.equal(await page.getAttribute("#loop", "aria-pressed"), "true");
  await page.evaluate(() => {
    window.seen = [];
    window.somatic.model.on("frame", () => window.seen.push(window.somatic.model.frame.t));
  });
  await page.keyboard.press(" ");
  await page.waitForFunction(() => window.seen.filter((t, i) => t < window.seen[i - 1]).length >= 2, null, {
    timeout: 60000,
  });
  await pause(page);
  await picture(page, "repeat.png");
  const seen = await page.evaluate(() => window.seen);
  assert.ok(Math.min(...seen) > loop.from - 0.02, "it begins where the part begins");
  await page.click("#loop");
  assert.equal((await span()).loop, null);
  // Both ends by keys; the end of the recording is repeated, too.
  await seek(page, 18.5);
  await page.keyboard.press("[");
  assert.deepEqual((await span()).loop, { from: 18.5, to: 20 });
  await page.evaluate(() => (window.seen = []));
  await page.keyboard.press(" ");
  await page.waitForFunction(() => window.seen.some((t, i) => t < window.seen[i - 1]), null, {
    timeout: 60000,
  });
  await pause(page);
  await seek(page, 19);
  await page.keyboard.press("]");
  assert.deepEqual((await span()).loop, { from: 18.5, to: 19 });
  await page.keyboard.press("\\");
  assert.equal((await span()).loop, null);
  // What is shown follows the playhead.
  await page.evaluate(() => window.somatic.span.show(0, 2));
  await seek(page, 1.5);
  await page.keyboard.press(" ");
  await page.waitForFunction(() => window.somatic.span.from > 1.5, null, { timeout: 60000 });
  const { from, to } = await span();
  assert.ok(Math.abs(to - from - 2) < 1e-6);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

/** A table that a page saves. */
async function tableOf(page, act) {
  const waits = page.waitForEvent("download");
  await act();
  const download = await waits;
  const path = join(folder, "table.csv");
  await download.saveAs(path);
  const [head, ...rows] = readFileSync(path, "utf8").trim().split("\n");
  return { name: download.suggestedFilename(), head, rows: rows.map((row) => row.split(",")) };
}

test("plots are saved with each value and its time, and touches are plotted", async () => {
  const ids = taxelIds("hand");
  const value = (n) => 100 + ((7 * n) % 50);
  const name = writeRecording("wave.csv", ids, 101, 0.05, (n) => ids.map((id) => (id === 4 ? value(n) : 0)));
  const server = await view(name, "--body", "hand", "--speed", "4");
  const { page, problems } = await open(server.url);
  await page.waitForFunction(() => document.querySelectorAll("#plots .chip").length > 0);
  await page.waitForFunction(() => window.somatic.model.frame.t > 4.9, null, { timeout: 60000 });
  const { name: file, head, rows } = await tableOf(page, () => page.click("#plots-file"));
  assert.match(file, /^hand-[\d.]+s-plots\.csv$/);
  assert.match(head, /^time \(s\),hand\/\S+ total \(counts\)/);
  assert.equal(rows.length, 101);
  rows.forEach(([t, total], n) => {
    assert.ok(Math.abs(Number(t) - 0.05 * n) < 1e-6, `row ${n} is at ${t} s`);
    assert.equal(Number(total), value(n), `row ${n}`);
  });
  assert.match(await page.locator("#hint").innerText(), /101 times/);
  // Touches are plotted as far as they were seen: on a busy machine that is little of what was played.
  for (const t of [1, 1.5, 2, 2.5, 3]) await seek(page, t);
  await page.click("#touch-plot-button");
  assert.match(await page.locator("#touch-plot").innerText(), /^#\d+/);
  const inked = await page.evaluate(() => {
    const canvas = document.querySelector("#touch-plot canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    // Nearly the first colour of the palette, as edges are smooth.
    const first = [0x56, 0xb4, 0xe9];
    for (let i = 0; i < data.length; i += 4)
      if (data[i + 3] > 100 && first.every((part, k) => Math.abs(part - data[i + k]) < 40)) count++;
    return count;
  });
  assert.ok(inked > 40, `${inked} pixels of the touch's line`);
  await picture(page, "touch-plot.png");
  const both = await tableOf(page, () => page.keyboard.press("q"));
  assert.match(both.head, /,touch \d+ total \(counts\)$/);
  for (const row of both.rows) if (row.at(-1)) assert.equal(row.at(-1), row[1], "one taxel is all of it");
  assert.ok(both.rows.filter((row) => row.at(-1)).length > 3);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("the distance of two clicks is that of the taxels, and Escape ends it", async () => {
  const server = await view("hand");
  const { page, problems } = await open(server.url);
  await page.waitForFunction(() => window.somatic.model.isAtRest);
  await settled(page);
  await page.click("#measure");
  assert.match(await page.locator("#hint").innerText(), /click two places/);
  const ends = await page.evaluate(() => {
    const { model, pixelOfTaxel } = window.somatic;
    const seen = Array.from(model.mesh.taxelId, (_, taxel) => ({ taxel, at: pixelOfTaxel(taxel) })).filter(
      ({ at }) => at && at[1] > 120 && at[1] < 520,
    );
    return [seen[0], seen.at(-1)].map(({ taxel, at }) => ({
      at,
      id: model.mesh.taxelId[taxel],
      point: [0, 1, 2].map((row) => {
        const from = 12 * model.mesh.taxelLink[taxel] + 4 * row;
        const place = model.mesh.taxelPosition.slice(3 * taxel, 3 * taxel + 3);
        return model.rows[from + 3] + place.reduce((sum, x, k) => sum + model.rows[from + k] * x, 0);
      }),
    }));
  });
  for (const { at } of ends) await page.mouse.click(...at);
  const metres = Math.hypot(...ends[0].point.map((x, k) => x - ends[1].point[k]));
  const said = await page.locator("#hint").innerText();
  assert.ok(
    said.includes(`taxel ${ends[0].id} to taxel ${ends[1].id}: ${(1e3 * metres).toFixed(1)} mm`),
    said,
  );
  await page.mouse.move(5, 5);
  await settled(page);
  await picture(page, "distance.png");
  const chosen = await page.evaluate(() => document.querySelectorAll(".field.chosen").length);
  assert.equal(chosen, 0, "a click that measures chooses nothing");
  await page.keyboard.press("Escape");
  assert.equal(await page.locator("#hint").isVisible(), false);
  assert.equal(await page.getAttribute("#measure", "aria-pressed"), "false");
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("a live view pauses while frames go on arriving, and then shows the newest", async () => {
  const server = await serve(
    ...["run", "--source", "-", "--body", "hand", "--backend", "cpu", "--sink", "page:127.0.0.1:0"],
  );
  const ids = taxelIds("hand");
  let n = 0;
  const feeding = setInterval(() => {
    const values = Object.fromEntries(ids.map((id) => [id, id === 4 ? 100 + n : 0]));
    server.child.stdin.write(`${JSON.stringify({ t: n / 50, values })}\n`);
    n += 1;
  }, 20);
  const { page, problems } = await open(server.url);
  await page.waitForFunction(() => window.somatic.model.frame?.t > 0.5 && window.somatic.framesDrawn > 5);
  const shown = () =>
    page.evaluate(() => [window.somatic.model.frame.t, Math.max(...window.somatic.model.pressure)]);
  await page.keyboard.press(" ");
  const before = await shown();
  await page.waitForFunction(() => /[1-9]\d+ newer/.test(document.querySelector("#mode").textContent));
  await picture(page, "paused.png");
  assert.deepEqual(await shown(), before);
  await page.click("#hold");
  await page.waitForFunction((t) => window.somatic.model.frame.t > t + 0.2, before[0]);
  const [t, most] = await shown();
  assert.ok(Math.abs(most - (100 + Math.round(50 * t))) < 1e-6, `${most} at ${t} s`);
  assert.equal(await page.locator("#mode").innerText(), "live");
  // Space pauses wherever the focus is.
  await page.click("#looks [data-toggle=ids]");
  await page.keyboard.press(" ");
  await page.waitForFunction(() => /paused/.test(document.querySelector("#mode").textContent));
  assert.equal(await page.getAttribute("#looks [data-toggle=ids]", "aria-pressed"), "true");
  assert.deepEqual(problems, []);
  clearInterval(feeding);
  await page.close();
  await server.stop();
});

/** Pictures of a video at some times: its length and size, and of each picture the colour of a place. */
async function watch(bytes, times, [x, y]) {
  const page = await browser.newPage();
  const seen = await page.evaluate(
    async ([bytes, times, x, y]) => {
      const video = document.createElement("video");
      const data = Uint8Array.from(atob(bytes), (letter) => letter.charCodeAt(0));
      const event = (name) =>
        new Promise((then, failed) => {
          video.addEventListener(name, then, { once: true });
          video.addEventListener("error", () => failed(new Error(video.error.message)), { once: true });
        });
      const loaded = event("loadeddata");
      video.src = URL.createObjectURL(new Blob([data], { type: "video/webm" }));
      await loaded;
      const { videoWidth: width, videoHeight: height, duration } = video;
      const canvas = new OffscreenCanvas(width, height);
      const context = canvas.getContext("2d");
      const colours = [];
      for (const t of times) {
        const sought = event("seeked");
        video.currentTime = t;
        await sought;
        context.drawImage(video, 0, 0);
        colours.push([...context.getImageData(x, y, 1, 1).data].slice(0, 3));
      }
      return { width, height, duration, colours };
    },
    [bytes.toString("base64"), times, Math.round(x), Math.round(y)],
  );
  await page.close();
  return seen;
}

test("a part is saved as a video, and its highest pressures are shown", async () => {
  const ids = taxelIds("hand");
  const name = writeRecording("ramp.csv", ids, 101, 0.04, (n) => ids.map((id) => (id === 4 ? 10 * n : 0)));
  const server = await view(name, "--body", "hand");
  const { page, problems } = await open(server.url);
  await page.waitForFunction(() => document.querySelector(".touch"));
  await pause(page);
  await seek(page, 3);
  await bare(page);
  await page.evaluate(() => window.somatic.span.setLoop(1, 2));
  const saved = page.waitForEvent("download");
  await page.click("#video");
  const download = await saved;
  assert.equal(download.suggestedFilename(), "hand-1.00-2.00s.webm");
  const path = join(folder, "part.webm");
  await download.saveAs(path);
  assert.match(await page.locator("#hint").innerText(), /: 26 pictures$/);
  await page.waitForFunction(() => window.somatic.model.frame.t === 3);
  const { at, size, colours } = await page.evaluate(() => {
    const { model, pixelOfTaxel } = window.somatic;
    const stage = document.querySelector("#stage").getBoundingClientRect();
    const [x, y] = pixelOfTaxel(Array.from(model.mesh.taxelId).indexOf(4));
    const colour = (p) => model.welcome.colours[Math.round((255 * p) / model.scale.max)];
    return {
      at: [x - stage.left, y - stage.top],
      size: [stage.width, stage.height].map((side) => side & ~1),
      colours: [270, 500].map(colour),
    };
  });
  const seen = await watch(readFileSync(path), [0.1, 1.01], at);
  assert.deepEqual([seen.width, seen.height], size);
  assert.ok(Math.abs(seen.duration - 1.033) < 0.01, `${seen.duration} s`);
  seen.colours.forEach((colour, i) =>
    colour.forEach((part, k) =>
      assert.ok(Math.abs(part - colours[i][k]) < 25, `${colour}, not ${colours[i]}, in picture ${i}`),
    ),
  );
  // It can be stopped, and then nothing is saved.
  page.on("download", () => problems.push("something was saved"));
  await page.evaluate(() => window.somatic.span.setLoop(0, 0));
  await page.keyboard.press("S");
  await page.waitForFunction(() => window.somatic.model.frame.t > 0 && window.somatic.model.frame.t < 2);
  assert.equal(await page.getAttribute("#video", "aria-pressed"), "true");
  await page.keyboard.press("Escape");
  assert.match(await page.locator("#hint").innerText(), /^Stopped/);
  await page.waitForFunction(() => window.somatic.model.frame.t === 3);
  assert.equal(await page.getAttribute("#video", "aria-pressed"), "false");
  // Highest pressures are those of the time that is shown or repeated.
  const highest = (from, to, peak) =>
    page.waitForFunction(
      ([from, to, peak]) => {
        const { model } = window.somatic;
        const { peaks } = model;
        const of4 = (_, taxel) => model.mesh.taxelId[taxel] === 4;
        const rest = peaks?.peaks.filter((p, taxel) => !of4(p, taxel));
        return (
          peaks?.from === from &&
          peaks.to === to &&
          peaks.peaks.find(of4) === peak &&
          rest.every((p) => p === 0)
        );
      },
      [from, to, peak],
    );
  await page.click("#peaks");
  await highest(0, 4, 1000);
  await page.evaluate(() => window.somatic.span.setLoop(0.5, 1.5));
  await highest(0.5, 1.5, 370);
  assert.match(await page.locator("#legend").innerText(), /Highest raw value[^]*0\.50 s[^]*1\.50 s/);
  await page.waitForFunction(() => /look=[^&]*peaks/.test(location.hash));
  await picture(page, "highest.png");
  const shown = (
    await coloursAt(page, [await page.evaluate((at) => window.somatic.pixelOfTaxel(at), ids.indexOf(4))])
  )[0];
  const expected = await page.evaluate(() => {
    const { colours, scale } = { ...window.somatic.model.welcome, scale: window.somatic.model.scale };
    return colours[Math.round((255 * 370) / scale.max)];
  });
  assert.ok(
    shown.every((part, k) => Math.abs(part - expected[k]) < 12),
    `${shown}, not ${expected}`,
  );
  await page.keyboard.press("M");
  assert.equal(await page.evaluate(() => window.somatic.model.peaks), null);
  assert.doesNotMatch(await page.locator("#legend").innerText(), /Highest/);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});
