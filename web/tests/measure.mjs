// Measures what docs/guide/browser.md states: `node tests/measure.mjs` in web/, after the build. ABBE_COMMAND names a
// command of the profile release.

import { execFileSync } from "node:child_process";
import { readFileSync, statSync } from "node:fs";
import { join } from "node:path";
import { brotliCompressSync, gzipSync } from "node:zlib";
import { abbe, browser, filesOf, give, hermle, opened, served, single, web } from "./page.mjs";

const chromium = await browser();
const server = await served();
const median = (times) => times.toSorted((a, b) => a - b)[Math.floor(times.length / 2)];
const seconds = (milliseconds) => `${(milliseconds / 1000).toFixed(2)} s`;

const module = join(web, "pkg/abbe_bg.wasm");
const megabytes = (bytes) => `${(bytes / 1e6).toFixed(2)} MB`;
const compressed = [gzipSync(readFileSync(module), { level: 9 }), brotliCompressSync(readFileSync(module))];
const [gzip, brotli] = compressed.map(({ length }) => megabytes(length));
console.log(`module: ${megabytes(statSync(module).size)}; gzip ${gzip}, brotli ${brotli}`);

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

const { page } = await opened(chromium, server.address);
const native = [];
const own = [];
await give(page, filesOf(hermle));
await page.getByText("2416 readings").waitFor();
for (let k = 0; k < 6; k++) {
  const start = performance.now();
  execFileSync(abbe, ["trace", "session.toml", "--json", "/dev/null", "--report", "/dev/null", "--quiet"], {
    cwd: hermle,
    env: { ...process.env, RAYON_NUM_THREADS: "1" },
    stdio: "ignore",
  });
  native.push(performance.now() - start);
  // The result of before stays until the next: it has another time.
  const before = k > 0 ? await page.locator("[data-seconds]").getAttribute("data-seconds") : "";
  await page.getByRole("button", { name: "Trace", exact: true }).click();
  await page.waitForFunction(
    (before) => (document.querySelector("[data-seconds]")?.dataset.seconds ?? before) !== before,
    before,
  );
  own.push(1000 * Number(await page.locator("[data-seconds]").getAttribute("data-seconds")));
}
const [first, ...later] = own;
const timed = (time) => `${seconds(time)}, ${(time / median(native)).toFixed(1)} times as long`;
console.log(`trace of 2,416 readings, the command on one thread: ${seconds(median(native))}`);
console.log(`in the page: first ${timed(first)}; later ${timed(median(later))}`);
await chromium.close();
server.end();
