// The page in a tab that another one hides.
import assert from "node:assert/strict";
import { test } from "node:test";
import { chromium } from "playwright-core";
import { LAUNCH, view } from "./program.js";

test("a hidden tab takes two frames, and then the newest", async (t) => {
  const server = await view();
  const browser = await chromium.launch(LAUNCH);
  t.after(() => browser.close());
  const root = await browser.newBrowserCDPSession();
  const page = await tab(root, server.url);
  await page.until("window.somatic?.model.frame?.seq > 5");
  const drawn = () =>
    page.evaluate("({ seq: window.somatic.model.frame.seq, t: window.somatic.model.frame.t })");
  // Another tab in front of it.
  await tab(root, "about:blank");
  await page.until("document.hidden");
  await wait(500);
  const before = await drawn();
  await wait(2000);
  assert.equal((await drawn()).seq, before.seq, "nothing comes while nothing is drawn");
  assert.equal(await page.evaluate("window.somatic.model.connection.state"), "open");
  await root.send("Target.activateTarget", { targetId: page.targetId });
  await page.until(`!document.hidden && window.somatic.model.frame.seq > ${before.seq + 5}`);
  const after = await drawn();
  const missed = Math.round((after.t - before.t) / 0.02);
  assert.ok(missed < 0 || missed > after.seq - before.seq + 50, "what was missed is skipped, not shown late");
  await server.stop();
});

/** @param {number} ms */
const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/**
 * A tab of the browser's one window, in which only one is seen at a time. Playwright's own pages are kept visible.
 *
 * @param {import("playwright-core").CDPSession} root @param {string} url
 */
async function tab(root, url) {
  const { targetId } = await root.send("Target.createTarget", { url });
  const { sessionId } = await root.send("Target.attachToTarget", { targetId });
  let sent = 0;
  /** @param {string} expression @returns {Promise<any>} */
  const evaluate = (expression) =>
    new Promise((resolve) => {
      const id = ++sent;
      /** @param {{ sessionId: string, message: string }} event */
      const answer = (event) => {
        const message = JSON.parse(event.message);
        if (event.sessionId !== sessionId || message.id !== id) return;
        root.off("Target.receivedMessageFromTarget", answer);
        resolve(message.result?.result?.value);
      };
      root.on("Target.receivedMessageFromTarget", answer);
      const params = { expression, returnByValue: true };
      const message = JSON.stringify({ id, method: "Runtime.evaluate", params });
      root.send("Target.sendMessageToTarget", { sessionId, message });
    });
  /** @param {string} expression */
  const until = async (expression) => {
    for (let turn = 0; !(await evaluate(expression)); turn++) {
      assert.ok(turn < 600, `not within a minute: ${expression}`);
      await wait(100);
    }
  };
  return { targetId, evaluate, until };
}
