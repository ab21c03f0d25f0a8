// All processors: where the browser isolates the page, the module has a thread for each.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import {
  analysed,
  browser,
  command,
  differences,
  filesOf,
  give,
  hermle,
  ISOLATING,
  opened,
  opening,
  saved,
  served,
} from "./page.mjs";

const own = {};
before(async () => {
  own.chromium = await browser();
});
after(() => own.chromium.close());

/** Presses Fit or Trace, and returns its JSON and the number of processors. */
async function computed(page, kind) {
  await page.getByRole("button", { name: kind, exact: true }).click();
  const row = page.locator(`[data-kind="${kind.toLowerCase()}"]`);
  await row.waitFor();
  return { json: JSON.parse(await saved(page, "JSON")), processors: Number(await row.getAttribute("data-processors")) };
}

const count = (page) => page.evaluate(() => Math.min(navigator.hardwareConcurrency, 8));

test("with the headers of a server all processors compute, with the numbers of the command", async () => {
  const server = await served(ISOLATING);
  const { page, wrong } = await opened(own.chromium, server.address);
  await give(page, filesOf(hermle));
  for (const kind of ["Fit", "Trace"]) {
    const { json, processors } = await computed(page, kind);
    assert.equal(processors, await count(page));
    assert.deepEqual(differences(json, command(hermle, kind.toLowerCase(), "session.toml", "--allow-implausible")), []);
  }
  // The report runs its script in a frame of the isolated page.
  await page.frameLocator("iframe").locator("#download").waitFor();
  // Stopped with all its workers; the next starts others.
  await page.getByRole("button", { name: "Trace", exact: true }).click();
  await page.getByRole("button", { name: "Stop", exact: true }).click();
  assert.equal((await computed(page, "Fit")).processors, await count(page));
  await page.getByRole("tab", { name: "Explore" }).click();
  await analysed(page);
  assert.deepEqual(wrong, []);
  await page.close();
  server.end();
});

const tooSmall = (text) => text.replace(/\[65536,32768,16384,8192\]/, "[1000]");
// The worker that computes waits for the others, and cannot say so.
const withoutOthers = (text) =>
  text.replace(/try\{\w+\(\)\}(catch\(\w+\)\{new BroadcastChannel)/, 'try{throw Error("unreachable")}$1');

for (const [what, headers, spoil] of [
  ["too little memory on one processor", {}, tooSmall],
  ["too little memory on all processors", ISOLATING, tooSmall],
  ["another worker that fails", ISOLATING, withoutOthers],
]) {
  test(`${what} is a fault, and the next computation works`, async () => {
    let isSpoiled = true;
    const server = await served(headers, (path, contents) => {
      if (!isSpoiled || !/worker-[^/]*\.js$/.test(path)) return contents;
      const text = contents.toString();
      assert.notEqual(spoil(text), text);
      return spoil(text);
    });
    const context = await own.chromium.newContext({ serviceWorkers: "block" });
    const { page } = await opening(await context.newPage(), server.address);
    await give(page, filesOf(hermle));
    if (spoil === tooSmall) {
      await page.getByText("2416 readings").waitFor();
      await page.getByRole("button", { name: "Trace", exact: true }).click();
    }
    await page.getByText("perhaps the memory of the browser did not suffice").first().waitFor();
    isSpoiled = false;
    // A session that could not be read is read again after a reload.
    if (spoil === withoutOthers) await page.reload();
    assert.equal((await computed(page, "Trace")).processors, headers === ISOLATING ? await count(page) : 1);
    await context.close();
    server.end();
  });
}

test("a worker that does not get its memory is left out", async () => {
  const server = await served(ISOLATING, (path, contents) => {
    if (!/worker-[^/]*\.js$/.test(path)) return contents;
    const text = contents.toString();
    const refused = text.replace(".then(()=>!0,()=>!1)", ".then(()=>!1)");
    assert.notEqual(refused, text);
    return refused;
  });
  const context = await own.chromium.newContext({ serviceWorkers: "block" });
  const { page, wrong } = await opening(await context.newPage(), server.address);
  await give(page, filesOf(hermle));
  assert.equal((await computed(page, "Fit")).processors, 1);
  assert.deepEqual(wrong, []);
  await context.close();
  server.end();
});

test("without headers the service worker of the first visit isolates the second", async () => {
  const server = await served();
  const context = await own.chromium.newContext();
  const { page, wrong } = await opening(await context.newPage(), server.address);
  assert.equal(await page.evaluate(() => crossOriginIsolated), false);
  await give(page, filesOf(hermle));
  assert.equal((await computed(page, "Fit")).processors, 1);
  await page.evaluate(() => navigator.serviceWorker.ready.then(() => undefined));
  await page.waitForFunction(() => navigator.serviceWorker.controller);
  await page.reload();
  assert.equal(await page.evaluate(() => crossOriginIsolated), true);
  await page.getByText("2416 readings").waitFor();
  const { json, processors } = await computed(page, "Trace");
  assert.equal(processors, await count(page));
  assert.deepEqual(differences(json, command(hermle, "trace", "session.toml", "--allow-implausible")), []);
  assert.deepEqual(wrong, []);
  await context.close();
  server.end();
});
