// Measures what docs/guide/browser.md states: `node tests/measure.mjs` in web/, after the build. ABBE_COMMAND names a
// command of the profile release. `node tests/measure.mjs --large` measures only the trace of 100,016 readings.

import { execFileSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { brotliCompressSync, gzipSync } from "node:zlib";
import { abbe, browser, filesOf, give, hermle, ISOLATING, opened, root, served, single, web } from "./page.mjs";

const chromium = await browser();
const server = await served();
// Where the page is isolated it computes on all processors.
const isolating = await served(ISOLATING);
const median = (times) => times.toSorted((a, b) => a - b)[Math.floor(times.length / 2)];
const seconds = (milliseconds) => `${(milliseconds / 1000).toFixed(2)} s`;

const module = join(web, "pkg/abbe_bg.wasm");
const megabytes = (bytes) => `${(bytes / 1e6).toFixed(2)} MB`;
const compressed = [gzipSync(readFileSync(module), { level: 9 }), brotliCompressSync(readFileSync(module))];
const [gzip, brotli] = compressed.map(({ length }) => megabytes(length));
console.log(`module: ${megabytes(statSync(module).size)}; gzip ${gzip}, brotli ${brotli}`);

/** The trace of the command on one thread, ms. */
function native(folder) {
  const start = performance.now();
  execFileSync(abbe, ["trace", "session.toml", "--json", "/dev/null", "--report", "/dev/null", "--quiet"], {
    cwd: folder,
    env: { ...process.env, RAYON_NUM_THREADS: "1" },
    stdio: "ignore",
  });
  return performance.now() - start;
}

/** The trace of the open session in the page: its time, ms, its processors, and the memory of the module, bytes. */
async function traced(page) {
  // The result of before stays until the next: it has another time.
  const shown = page.locator("[data-seconds]");
  const before = (await shown.count()) > 0 ? await shown.getAttribute("data-seconds") : "";
  await page.getByRole("button", { name: "Trace", exact: true }).click();
  await page.waitForFunction(
    (before) => (document.querySelector("[data-seconds]")?.dataset.seconds ?? before) !== before,
    before,
  );
  const { seconds, bytes, processors } = await shown.evaluate(({ dataset }) => ({ ...dataset }));
  return { time: 1000 * Number(seconds), bytes: Number(bytes), processors };
}

/** A session of 100,016 readings with an effect: four tests of fine steps, simulated by the command. */
function largeSession() {
  const scratch = mkdtempSync(join(tmpdir(), "abbe-web-"));
  const own = join(root, "sessions/hermle-c600u");
  copyFileSync(join(own, "machine.toml"), join(scratch, "machine.toml"));
  const plan = readFileSync(join(own, "chapter5.toml"), "utf8")
    .replaceAll("step_deg = 0.25", "step_deg = 0.018")
    .replaceAll("step_deg = 0.5", "step_deg = 0.048");
  const effect = '\n[[effect]]\ncomponent = "EZC"\ndriver = "C"\nshape = "harmonic"\norder = 3\n';
  writeFileSync(join(scratch, "plan.toml"), plan + effect);
  const values = ["EZC~C:h3.amplitude=1.5um", "EZC~C:h3.phase=60deg"].flatMap((value) => ["--effect", value]);
  execFileSync(
    abbe,
    ["simulate", "plan.toml", "--out", "large", "--error", "EY0A=35.3um", ...values, "--hide-effects", "--quiet"],
    { cwd: scratch, stdio: "ignore" },
  );
  return { folder: join(scratch, "large"), remove: () => rmSync(scratch, { recursive: true }) };
}

const timed = (time, of) => `${seconds(time)}, ${(time / of).toFixed(1)} times as long`;

async function measureStart() {
  for (const [words, address] of [
    ["abbe.html from the disk", single],
    ["index.html from a server", server.address],
  ]) {
    const [pictures, sessions] = [[], []];
    for (let k = 0; k < 7; k++) {
      // A context of its own has an empty cache.
      const { page } = await opened(chromium, address);
      const paint = () => performance.getEntriesByName("first-contentful-paint")[0]?.startTime;
      await page.waitForFunction(paint);
      pictures.push(await page.evaluate(paint));
      await page.getByLabel("Or open a bundled session").selectOption("hermle-c600u/measured/session.toml");
      await page.waitForFunction(() => document.body.textContent.includes("2416 readings"));
      sessions.push(await page.evaluate(() => performance.now()));
      await page.close();
    }
    const [picture, session] = [pictures, sessions].map((times) => seconds(median(times)));
    console.log(`${words}: first picture ${picture}; a session is open after ${session}`);
  }
}

async function measureTrace({ address }) {
  const { page } = await opened(chromium, address);
  await give(page, filesOf(hermle));
  await page.getByText("2416 readings").waitFor();
  const [theirs, ours] = [[], []];
  let on = "";
  for (let k = 0; k < 6; k++) {
    theirs.push(native(hermle));
    const { time, processors } = await traced(page);
    ours.push(time);
    on = processors;
  }
  const [first, ...later] = ours;
  console.log(`trace of 2,416 readings, the command on one thread: ${seconds(median(theirs))}`);
  const words = `first ${timed(first, median(theirs))}; later ${timed(median(later), median(theirs))}`;
  console.log(`in the page, processors ${on}: ${words}`);
  await page.close();
}

async function measureLargeTrace({ address }) {
  const { folder, remove } = largeSession();
  const { page } = await opened(chromium, address);
  await give(page, filesOf(folder));
  await page.getByText("100016 readings").waitFor();
  // What the page tells meanwhile.
  await page.evaluate(() => {
    const status = document.querySelector('[role="status"]');
    globalThis.told = new Set();
    new MutationObserver(() => globalThis.told.add(status.textContent)).observe(status, {
      characterData: true,
      childList: true,
      subtree: true,
    });
  });
  // The command before and after the page: other work on the machine would favour one of them.
  const before = native(folder);
  const { time, bytes, processors } = await traced(page);
  const theirs = (before + native(folder)) / 2;
  const told = await page.evaluate(() => [...globalThis.told].filter((words) => words !== ""));
  console.log(`trace of 100,016 readings, the command on one thread: ${seconds(theirs)}`);
  console.log(`in the page, processors ${processors}: ${timed(time, theirs)}; memory of the module ${megabytes(bytes)}`);
  console.log(`told meanwhile: ${told.length} messages, such as ${told.slice(0, 3).join("; ")}`);
  await page.close();
  remove();
}

if (!process.argv.includes("--large")) {
  await measureStart();
  for (const one of [server, isolating]) await measureTrace(one);
}
for (const one of [server, isolating]) await measureLargeTrace(one);
await chromium.close();
server.end();
isolating.end();
