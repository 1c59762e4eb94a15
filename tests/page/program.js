// The real program and a real Chromium for the tests: SOMATIC is the program, CHROMIUM the browser, PICTURES a folder for
// screenshots. With WEB, a folder, the page's own files come from there: what is changed in them is tried without a build.
// Run by `tests/cli/browser.rs`.
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { chromium } from "playwright-core";

export const SOMATIC = process.env.SOMATIC ?? "somatic";
const { PICTURES, WEB } = process.env;
/** How the browser is started. One whose page comes from a folder takes the program for another network's. */
export const LAUNCH = {
  executablePath: process.env.CHROMIUM,
  headless: true,
  args: ["--no-sandbox", "--enable-unsafe-swiftshader", "--disable-background-networking"].concat(
    WEB ? ["--disable-features=LocalNetworkAccessChecks"] : [],
  ),
};
export const folder = mkdtempSync(join(tmpdir(), "somatic-browser-"));
const started = new Set();
/** @type {import("playwright-core").BrowserContext} */
export let browser;

/** Lets a browser take the page's files from the folder WEB, under the rules that the program sends with its own. */
export async function overlay(context) {
  if (!WEB) return;
  await context.route(/^http:.*\/([\w]+\.(js|css))?$/, async (route) => {
    const { origin, pathname } = new URL(route.request().url());
    const name = pathname.split("/").pop();
    const path = join(WEB, name || "index.html");
    if (!existsSync(path)) return route.continue();
    if (name) {
      // What another page asks for is the program's to refuse.
      const isOwn = route.request().frame().url().startsWith(origin);
      return isOwn ? route.fulfill({ path }) : route.continue();
    }
    const answer = await route.fetch();
    const rules = answer.headers()["content-security-policy"];
    return rules
      ? route.fulfill({ path, headers: { "content-security-policy": rules } })
      : route.fulfill({ response: answer });
  });
}

before(async () => {
  browser = await chromium.launchPersistentContext(join(folder, "profile"), {
    ...LAUNCH,
    viewport: { width: 1280, height: 720 },
    colorScheme: "dark",
  });
  await overlay(browser);
});
after(async () => {
  await browser?.close();
  for (const child of started) child.kill();
  rmSync(folder, { recursive: true, force: true });
});

/** Starts the program and gives its page's address. */
export async function serve(...parts) {
  const child = spawn(SOMATIC, parts, { stdio: ["pipe", "ignore", "pipe"], cwd: folder });
  started.add(child);
  let said = "";
  const url = await new Promise((found, failed) => {
    child.stderr.on("data", (text) => {
      said += text;
      const address = said.match(/http:\/\/\S+/);
      if (address) found(address[0]);
    });
    child.on("exit", () => failed(new Error(`somatic ended: ${said}`)));
  });
  const stop = async () => {
    const ended = new Promise((over) => child.once("exit", over));
    child.kill("SIGINT");
    await ended;
    started.delete(child);
  };
  return { url, child, stop, port: new URL(url).port };
}

export const view = (...parts) => serve("view", "--listen", "127.0.0.1:0", "--backend", "cpu", ...parts);

/** Opens an address and waits for the first picture, and of a recording for whether it plays: what Space does depends on it. */
export async function open(url) {
  const page = await browser.newPage();
  const problems = [];
  page.on("pageerror", (error) => problems.push(String(error)));
  page.on("console", (line) => line.type() === "error" && problems.push(line.text()));
  await page.goto(url);
  await page.waitForFunction(() => window.somatic?.firstPictureMs > 0, null, { timeout: 60000 });
  await page.waitForFunction(
    () => !window.somatic.model.welcome.time || "type" in window.somatic.model.status,
    null,
    { timeout: 60000 },
  );
  return { page, problems };
}

/** Pauses what plays. */
export async function pause(page) {
  if (await page.evaluate(() => window.somatic.model.status.playing)) await page.keyboard.press(" ");
  await page.waitForFunction(() => !window.somatic.model.status.playing, null, { timeout: 60000 });
}

/** Pauses and goes to a time; waits until it is shown. */
export async function seek(page, t) {
  await page.evaluate((t) => (location.hash = `#t=${t}`), t);
  await page.waitForFunction((t) => Math.abs(window.somatic.model.frame?.t - t) < 1e-9, t, {
    timeout: 60000,
  });
  await settled(page);
}

/** Waits until nothing is drawn any more: a camera has come to rest, and what was asked for is shown. For pages that do not play. */
export async function settled(page) {
  await page.evaluate(async () => {
    const next = () => new Promise((done) => requestAnimationFrame(done));
    let [drawn, still] = [-1, 0];
    for (let all = 0; still < 30 && all < 1200; all++) {
      await next();
      still = window.somatic.framesDrawn === drawn ? still + 1 : 0;
      drawn = window.somatic.framesDrawn;
    }
  });
}

/** Takes off what lies on top of the discs: labels and marks. */
export async function bare(page) {
  await page.keyboard.press("n");
  while ((await page.locator("#marks-choice").inputValue()) !== "none") await page.keyboard.press("m");
}

export async function picture(page, name) {
  if (!PICTURES) return;
  mkdirSync(PICTURES, { recursive: true });
  await page.screenshot({ path: join(PICTURES, name) });
}

/** The ids of the taxels of a body. */
export function taxelIds(body) {
  const said = execFileSync(SOMATIC, ["inspect", body, "--json"], { encoding: "utf8", maxBuffer: 1e9 });
  return JSON.parse(said).taxels.map((taxel) => taxel.id);
}

/** Writes a recording of `count` frames, of each its time and values; gives its name. */
export function writeRecording(name, ids, count, step, values) {
  const rows = Array.from({ length: count }, (_, n) => [n * step, ...values(n)].join(","));
  writeFileSync(join(folder, name), `t,${ids.join(",")}\n${rows.join("\n")}\n`);
  return name;
}

/** The colours of the picture of a page at some places. */
export async function coloursAt(page, places) {
  const shot = (await page.screenshot()).toString("base64");
  return page.evaluate(
    async ([shot, places]) => {
      const bytes = Uint8Array.from(atob(shot), (letter) => letter.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const canvas = new OffscreenCanvas(image.width, image.height);
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      return places.map(([x, y]) =>
        Array.from(context.getImageData(Math.round(x), Math.round(y), 1, 1).data).slice(0, 3),
      );
    },
    [shot, places],
  );
}
