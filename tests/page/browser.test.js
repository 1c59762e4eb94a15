// The page in a real Chromium, before the real program: what it shows, its keys, lost connections and who is refused.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createServer } from "node:http";
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
  view,
} from "./program.js";

test("the first picture comes soon, and a taxel has the legend's colour of its pressure", async () => {
  const server = await view();
  const { page, problems } = await open(server.url);
  const first = await page.evaluate(() => window.somatic.firstPictureMs);
  console.log(`first picture after ${Math.round(first)} ms`);
  assert.ok(!(await page.url()).includes("token"), "the token stays in the address");
  await pause(page);
  let compared = 0;
  for (const [key, t] of [
    ["5", 2.9],
    ["6", 4.2],
  ]) {
    await seek(page, t);
    await page.keyboard.press(key);
    await bare(page);
    await settled(page);
    const expected = await page.evaluate(() => {
      const { model } = window.somatic;
      return Array.from(model.pressure, (pressure, taxel) => ({
        taxel,
        pressure,
        at: window.somatic.pixelOfTaxel(taxel),
        colour: model.welcome.colours[Math.round(Math.min(1, Math.max(0, pressure / model.scaleMax)) * 255)],
      })).filter((taxel) => taxel.at && taxel.pressure > 0);
    });
    assert.ok(expected.length > 3, `${expected.length} pressed taxels in sight`);
    const seen = await coloursAt(
      page,
      expected.map((taxel) => taxel.at),
    );
    expected.forEach((taxel, index) => {
      const off = Math.max(...taxel.colour.map((part, k) => Math.abs(part - seen[index][k])));
      compared += 1;
      assert.ok(off <= 2, `taxel ${taxel.taxel} at ${taxel.at}: ${seen[index]}, not ${taxel.colour}`);
    });
  }
  assert.ok(compared > 6);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("percepts at any time are those of an uninterrupted run, to the bit", async () => {
  const lines = execFileSync(SOMATIC, ["run", "--quiet", "--backend", "cpu", "--sink", "-"], {
    encoding: "utf8",
  });
  const frames = lines
    .trim()
    .split("\n")
    .map((line) => JSON.parse(line));
  const server = await view();
  const { page } = await open(server.url);
  await pause(page);
  for (const index of [149, 20, 208, 3, 150, 60]) {
    const frame = frames[index];
    await seek(page, frame.t);
    const shown = await page.evaluate(() => {
      const { model } = window.somatic;
      const columns = model.welcome.columns;
      return Array.from(model.percepts?.field ?? [], (field, k) => {
        const values = { field: model.welcome.fields[field].label };
        columns.forEach((column, c) => {
          const numbers = model.percepts.columns.get(c);
          if (numbers && (model.percepts.present[2 * k + (c >>> 5)] >>> (c & 31)) & 1)
            values[column.name] = Array.from(
              numbers.slice(k * column.components, (k + 1) * column.components),
            );
        });
        return values;
      });
    });
    assert.deepEqual(
      shown.map((percept) => percept.field),
      frame.fields.map((percept) => percept.field),
    );
    frame.fields.forEach((percept, k) => {
      for (const [name, value] of Object.entries(percept)) {
        const of = shown[k][name];
        if (name === "field" || !of || !(typeof value === "number" || Array.isArray(value))) continue;
        // NDJSON has as many digits as single precision; what the host computes in double is rounded to it.
        assert.deepEqual(of.map(Math.fround), [value].flat().map(Math.fround), `frame ${index}, ${name}`);
      }
      for (const name of ["total", "centroid"]) if (name in percept) assert.ok(shown[k][name], name);
    });
  }
  await page.close();
  await server.stop();
});

test("keys act without an error, and a percept is explained", async () => {
  const server = await view();
  const { page, problems } = await open(server.url);
  await pause(page);
  await seek(page, 2.9);
  await settled(page);
  await picture(page, "view.png");
  await page.keyboard.press("j");
  await page.keyboard.press("e");
  await page.waitForFunction(() => window.somatic.model.explanation?.columns?.length > 3, null, {
    timeout: 60000,
  });
  const explanation = await page.evaluate(() => window.somatic.model.explanation);
  assert.equal(explanation.backend, "cpu");
  const total = explanation.columns.find((column) => column.name === "total");
  assert.equal(total.verdict, "agrees");
  assert.ok(Math.abs(total.value[0] - total.reference[0]) <= total.bound && total.bound > 0);
  const members = explanation.members.filter((member) => member.pressure > 0);
  assert.ok(members.length > 1 && members.every((member) => member.raw > 0));
  await settled(page);
  await picture(page, "explain.png");
  const keys =
    "1 2 3 4 5 6 0 ArrowLeft ArrowRight ArrowUp ArrowDown Shift+ArrowLeft Shift+ArrowUp + - f j h x x b b d d t n m a , . Home End".split(
      " ",
    );
  for (const key of keys) {
    const before = await page.evaluate(() => window.somatic.framesDrawn);
    await page.keyboard.press(key);
    // A key that draws nothing fails by the time that is given.
    if (/^[1-6]$|Arrow|^[-+]$/.test(key))
      await page.waitForFunction((before) => window.somatic.framesDrawn > before, before, { timeout: 20000 });
    else await page.waitForTimeout(60);
  }
  const frame = () => page.evaluate(() => window.somatic.model.frame.frame);
  await seek(page, 2.0);
  const at = await frame();
  await page.keyboard.press(".");
  await page.waitForFunction((at) => window.somatic.model.frame.frame === at + 1, at);
  await page.keyboard.press(",");
  await page.waitForFunction((at) => window.somatic.model.frame.frame === at, at);
  await page.keyboard.press("?");
  await page.waitForTimeout(200);
  await picture(page, "keys.png");
  await page.keyboard.press("?");
  assert.deepEqual(problems, []);
  await page.emulateMedia({ colorScheme: "light" });
  await seek(page, 4.2);
  await page.keyboard.press("6");
  await page.waitForTimeout(600);
  await picture(page, "light.png");
  await page.close();
  await server.stop();
});

test("a lost WebGL context comes back", async () => {
  const server = await view();
  const { page } = await open(server.url);
  await page.evaluate(() => {
    const gl = document.getElementById("scene").getContext("webgl2");
    window.lose = gl.getExtension("WEBGL_lose_context");
    window.lose.loseContext();
  });
  await page.waitForTimeout(300);
  await page.evaluate(() => window.lose.restoreContext());
  const drawn = await page.evaluate(() => window.somatic.framesDrawn);
  await page.waitForFunction((drawn) => window.somatic.framesDrawn > drawn + 5, drawn, { timeout: 60000 });
  await page.close();
  await server.stop();
});

test("a server that goes is reported, and one that comes back is shown", async () => {
  const server = await view();
  const { page } = await open(server.url);
  const token = new URL(server.url).hash;
  await server.stop();
  await page.waitForFunction(() => window.somatic.model.connection.state === "lost", null, {
    timeout: 60000,
  });
  await page.waitForTimeout(300);
  await picture(page, "lost.png");
  assert.match(await page.locator("body").innerText(), /since \d/i);
  const again = await serve("view", "--listen", `127.0.0.1:${server.port}`, "--backend", "cpu");
  // Another run has another token: the page says so, and does not look live.
  await page.waitForFunction(() => /refused/.test(document.body.innerText), null, { timeout: 60000 });
  assert.equal(await page.evaluate(() => window.somatic.model.connection.state), "lost");
  assert.notEqual(new URL(again.url).hash, token);
  await page.goto(again.url);
  await page.reload();
  await page.waitForFunction(() => window.somatic?.firstPictureMs > 0, null, { timeout: 60000 });
  await page.close();
  await again.stop();
});

test("a page of another origin gets nothing", async () => {
  const server = await view();
  const evil = createServer((_, answer) =>
    answer.setHeader("content-type", "text/html").end("<title>evil</title>"),
  );
  await new Promise((ready) => evil.listen(0, "127.0.0.1", ready));
  const page = await browser.newPage();
  await page.goto(`http://127.0.0.1:${evil.address().port}/`);
  const token = new URLSearchParams(new URL(server.url).hash.slice(1)).get("token");
  const heard = await page.evaluate(
    ([port, token]) =>
      new Promise((done) => {
        const socket = new WebSocket(`ws://127.0.0.1:${port}/socket`);
        socket.onopen = () =>
          socket.send(JSON.stringify({ type: "hello", version: 4, token, after_event: null }));
        socket.onmessage = () => done("a message");
        socket.onclose = () => done("nothing");
      }),
    [server.port, token],
  );
  assert.equal(heard, "nothing");
  const read = await page.evaluate(
    (port) =>
      fetch(`http://127.0.0.1:${port}/main.js`).then(
        () => "read",
        () => "refused",
      ),
    server.port,
  );
  assert.equal(read, "refused");
  await page.close();
  evil.close();
  await server.stop();
});

test("names from files are text", async () => {
  const name = "<img src=x onerror=window.broken=1>";
  const frames = Array.from({ length: 50 }, (_, n) => [n / 10, n % 20].join(","));
  writeFileSync(join(folder, `${name.replaceAll("/", "")}.csv`), `t,0\n${frames.join("\n")}\n`);
  const server = await view(`${name.replaceAll("/", "")}.csv`, "--body", "hand");
  const { page } = await open(server.url);
  await settled(page);
  assert.ok((await page.locator("body").innerText()).includes("<img src=x"));
  assert.equal(await page.evaluate(() => window.broken), undefined);
  assert.equal(await page.locator("img").count(), 0);
  await page.close();
  await server.stop();
});
