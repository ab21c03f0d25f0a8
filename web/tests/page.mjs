// What the tests of the page share: a server of the built folder, a browser, and the command to compare with.

import { execFileSync } from "node:child_process";
import { createServer } from "node:http";
import { existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { extname, join, resolve } from "node:path";
import { after, before } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

export const web = fileURLToPath(new URL("..", import.meta.url));
export const root = resolve(web, "..");
const dist = join(web, "dist");

/** Longest wait for anything, ms: on a machine with much else to do, conditions take their time. */
export const PATIENCE_MS = 600_000;

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm" };

/** The headers with which a server isolates the page. */
export const ISOLATING = {
  "cross-origin-opener-policy": "same-origin",
  "cross-origin-embedder-policy": "require-corp",
};

/**
 * Serves the folder of the page, with further headers and with changes of a file; returns its address and how to end it.
 */
export async function served(headers = {}, changed = (_, contents) => contents) {
  const server = createServer((request, answer) => {
    const path = new URL(request.url, "http://localhost").pathname;
    const file = join(dist, path.endsWith("/") ? `${path}index.html` : path);
    if (!file.startsWith(dist) || !existsSync(file) || !statSync(file).isFile()) {
      answer.writeHead(404).end();
      return;
    }
    answer
      .writeHead(200, { "content-type": TYPES[extname(file)] ?? "application/octet-stream", ...headers })
      .end(changed(path, readFileSync(file)));
  });
  await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
  return { address: `http://127.0.0.1:${server.address().port}/`, end: () => server.close() };
}

/** The page as one file on the disk. */
export const single = pathToFileURL(join(dist, "abbe.html")).href;

export const browser = () =>
  chromium.launch({
    timeout: PATIENCE_MS,
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: [
      "--headless",
      "--no-sandbox",
      "--disable-gpu",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
      "--enable-unsafe-swiftshader",
    ],
  });

/** What the tests of a file share: one browser and one server, from before the first test until after the last. */
export function shared() {
  const own = {};
  before(async () => {
    own.chromium = await browser();
    own.server = await served();
  });
  after(async () => {
    await own.chromium.close();
    own.server.end();
  });
  return own;
}

/** The files of a folder, by name. */
export const filesOf = (folder) =>
  Object.fromEntries(readdirSync(folder).map((name) => [name, readFileSync(join(folder, name))]));

/** The folder of the session of four tests that most tests use. */
export const hermle = join(root, "sessions/hermle-c600u/measured");

/** Waits until Explore shows a plan with its analysis. */
export const analysed = (page) => page.getByText(/Rank \d+ of/).waitFor();

/** The fragment of the address that holds a plan after a change. It is written some time after each change. */
export async function fragmentAfter(page, change) {
  await page.waitForFunction(() => location.hash.startsWith("#plan="));
  const before = await page.evaluate(() => location.hash);
  await change();
  await page.waitForFunction((before) => location.hash !== before, before);
  return page.evaluate(() => location.hash);
}

/**
 * A page that collects what it should not do: requests to elsewhere, errors, violated policies. `asked` are the
 * questions before it is left, which are answered with yes.
 */
export async function opened(browser, address, options = {}) {
  return opening(await browser.newPage(options), address);
}

/** The same with a page that exists, such as a second tab. */
export async function opening(page, address) {
  page.setDefaultTimeout(PATIENCE_MS);
  const [wrong, asked] = [[], []];
  page.on("request", (request) => {
    const url = request.url();
    if (!url.startsWith(address.replace(/[^/]*$/, "")) && !/^(data|blob|about):/.test(url))
      wrong.push(`request: ${url}`);
  });
  page.on("pageerror", (error) => wrong.push(`error: ${error.message}`));
  page.on("console", (message) => {
    if (message.type() === "error" || /Content.Security.Policy/i.test(message.text()))
      wrong.push(`console: ${message.text()}`);
  });
  page.on("dialog", (dialog) => {
    if (dialog.type() === "beforeunload") {
      asked.push(dialog.type());
      void dialog.accept();
      return;
    }
    wrong.push(`dialog: ${dialog.message()}`);
    void dialog.dismiss();
  });
  await page.goto(address);
  await page.getByRole("heading", { name: "Abbe" }).waitFor();
  return { page, wrong, asked };
}

/** Writes a number into a field and confirms it. */
export async function enter(page, label, value) {
  const field = page.getByLabel(label, { exact: true });
  await field.fill(String(value));
  await field.press("Enter");
}

/** Drops files of the disk on an element, as a hand does: the browser makes the entries. */
export async function drop(page, target, paths) {
  const box = await target.boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const devtools = await page.context().newCDPSession(page);
  const data = { items: [], files: paths, dragOperationsMask: 1 };
  for (const type of ["dragEnter", "dragOver", "drop"]) {
    await devtools.send("Input.dispatchDragEvent", { type, x, y, data });
  }
  await devtools.detach();
}

/** Gives files to the page as if the user chose them: names with contents. */
export async function give(page, files, where = page.getByLabel("Analyse", { exact: true })) {
  const payload = Object.entries(files).map(([name, contents]) => ({
    name,
    mimeType: "application/octet-stream",
    buffer: Buffer.from(contents),
  }));
  await where.locator('input[type="file"]').first().setInputFiles(payload);
}

/** The text that a button saves. */
export async function saved(page, button) {
  const download = page.waitForEvent("download");
  await page.getByRole("button", { name: button, exact: true }).click();
  return readFileSync(await (await download).path(), "utf8");
}

/** The command to compare with. */
export const abbe = resolve(process.env.ABBE_COMMAND ?? join(root, "target/checked/abbe"));

/** The JSON of the command in a folder. */
export function command(folder, ...words) {
  const scratch = mkdtempSync(join(tmpdir(), "abbe-web-"));
  try {
    const out = join(scratch, "result.json");
    execFileSync(abbe, [...words, "--json", out, "--quiet"], { cwd: folder, stdio: ["ignore", "ignore", "inherit"] });
    return JSON.parse(readFileSync(out, "utf8"));
  } finally {
    rmSync(scratch, { recursive: true });
  }
}

/**
 * The differences of two JSON documents. A number may differ by 1e-9 of its size. A value with a standard uncertainty,
 * and a covariance, may differ by 1e-9 of that uncertainty: estimates near zero are sums of large terms.
 */
export function differences(ours, theirs, path = "", scale = 0) {
  if (typeof ours === "number" && typeof theirs === "number") {
    const close = Math.abs(ours - theirs) <= 1e-9 * Math.max(Math.abs(ours), Math.abs(theirs), scale);
    return close ? [] : [`${path}: ${ours} is not ${theirs}`];
  }
  if (typeof ours !== "object" || typeof theirs !== "object" || ours === null || theirs === null) {
    return ours === theirs ? [] : [`${path}: ${JSON.stringify(ours)} is not ${JSON.stringify(theirs)}`];
  }
  if (path.endsWith("/covariance/matrix")) {
    const u = theirs.map((row, k) => Math.sqrt(row[k]));
    return theirs.flatMap((row, i) =>
      row.flatMap((one, j) => differences(ours[i]?.[j], one, `${path}/${i}/${j}`, u[i] * u[j])),
    );
  }
  const keys = new Set([...Object.keys(ours), ...Object.keys(theirs)]);
  // A difference of two χ² has the rounding of a χ², which is about the number of readings.
  const scales = { value: typeof theirs.u === "number" ? theirs.u : 0, delta_chi2: 1e3 };
  return [...keys].flatMap((key) => differences(ours[key], theirs[key], `${path}/${key}`, scales[key] ?? 0));
}
