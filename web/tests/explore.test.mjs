// Explore: what follows from the sliders, the set-up, the address.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { join } from "node:path";
import { unzipSync } from "fflate";
import { analysed, command, enter, fragmentAfter, opened, root, shared } from "./page.mjs";

const own = shared();

async function explorer(address) {
  const { page, wrong } = await opened(own.chromium, address);
  await page.getByRole("tab", { name: "Explore" }).click();
  await analysed(page);
  return { page, wrong };
}

const slide = (page, id, value) => page.getByLabel(id, { exact: true }).fill(String(value));

/** What a chart says of itself: its largest value. */
async function largest(page, test) {
  const words = await page.locator("figcaption", { hasText: `${test}: largest` }).textContent();
  return Number(words.match(/largest ([\d.e+-]+)/)[1]);
}

test("the change by EX0C is that of the equation, R / L of the error", async () => {
  const { page, wrong } = await explorer(own.server.address);
  await slide(page, "EX0C", 10);
  // Constants of the plan: R = 100 mm, the bar 149.9946 mm.
  await page.waitForFunction(() => document.body.textContent.includes("C150: largest 6.67"));
  assert.ok(Math.abs((await largest(page, "C150")) - (10 * 100) / 149.9946) < 5e-3);
  // Only the second order, e² / 2L.
  assert.ok((await largest(page, "A100")) < 1e-3);
  await page.locator("math").first().waitFor();
  assert.deepEqual(wrong, []);
  await page.close();
});

test("rank and uncertainties are those of the command, and follow a dragged ball", async () => {
  const { page } = await explorer(own.server.address);
  const theirs = command(join(root, "sessions/hermle-c600u"), "plan", "chapter5.toml", "--no-effects");
  const rows = await page.locator("table tr td:nth-child(2)").allTextContents();
  assert.deepEqual(
    rows,
    theirs.errors.map(({ u, unit }) => `${u.toPrecision(3)} ${{ um: "µm", arcsec: "″" }[unit]}`),
  );
  const canvas = page.locator('canvas[aria-label^="Set-up"]');
  const before = await page.getByLabel("table ball, mm x, mm").inputValue();
  // The drawing is loaded when it is first shown, or says that the browser has no WebGL.
  const isDrawn = (element) => element.placeOf || /WebGL/.test(element.parentElement.textContent);
  await page.waitForFunction(isDrawn, await canvas.elementHandle());
  const at = await canvas.evaluate((element) => element.placeOf?.("workpiece_ball_mm"));
  if (at) {
    const box = await canvas.boundingBox();
    await page.mouse.move(box.x + at.x, box.y + at.y);
    await page.mouse.down();
    await page.mouse.move(box.x + at.x + 2, box.y + at.y, { steps: 5 });
    await page.mouse.up();
    await page.waitForFunction(
      (before) => document.querySelector('[aria-label="table ball, mm x, mm"]').value !== before,
      before,
    );
  } else {
    await enter(page, "table ball, mm x, mm", 12);
  }
  const seen = (rows) =>
    [...document.querySelectorAll("table tr td:nth-child(2)")].some((cell, k) => cell.textContent !== rows[k]);
  await page.waitForFunction(seen, rows);
  assert.equal(await page.getByRole("alert").count(), 0);
  await page.close();
});

test("from slider to picture, four tests of 721 readings with patterns of eight errors", async (context) => {
  const { page } = await explorer(own.server.address);
  const text = page.getByLabel("Text of plan.toml");
  // By the keyboard: what still arrives above moves the line between press and release of a mouse.
  await page.getByText("Texts of plan and machine").press("Enter");
  // One traversal of 721 readings in each of the four tests.
  const plan = (await text.inputValue())
    .replaceAll(/from_deg = -20, to_deg = 70, step_deg = 0.25/g, "from_deg = -20, to_deg = 70, step_deg = 0.125")
    .replaceAll("runs = 2, both_directions = true", "runs = 1, both_directions = false");
  await text.fill(plan);
  await page.waitForFunction(
    () => [...document.querySelectorAll("option")].filter((one) => /721 readings/.test(one.textContent)).length === 4,
  );
  const errors = ["EY0A", "EZ0A", "EB0A", "EC0A", "EX0C", "EY0C", "EA0C", "EB0C"];
  for (const error of errors) await slide(page, error, 5);
  const times = [];
  for (let k = 0; k < 30; k++) {
    const old = await page.locator("[data-ms]").getAttribute("data-pictures");
    await slide(page, errors[k % 8], 6 + k / 10);
    await page.waitForFunction((old) => document.querySelector("[data-ms]").dataset.pictures !== old, old);
    times.push(Number(await page.locator("[data-ms]").getAttribute("data-ms")));
  }
  times.sort((a, b) => a - b);
  context.diagnostic(`median ${times[15]} ms, largest ${times[29]} ms`);
  await page.close();
});

test("the form of a test offers the keys of the schema", async () => {
  const { page, wrong } = await explorer(own.server.address);
  const offer = page.getByLabel("Add a key");
  const offered = await offer.locator("option").allTextContents();
  for (const key of ["bar_setup", "spindle_setup", "bar_u_um"]) {
    const isStated = (await page.getByLabel(key, { exact: true }).count()) > 0;
    assert.ok(isStated || offered.includes(key), key);
  }
  await offer.selectOption("bar_setup");
  const input = page.getByLabel("bar_setup", { exact: true });
  await input.fill('"one bar"');
  await input.press("Enter");
  await page.waitForFunction(() => document.querySelector("textarea")?.value.includes('bar_setup = "one bar"'));
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a plan is shared by its address, saved as a folder, and opened in Analyse", async () => {
  const { page, wrong } = await explorer(own.server.address);
  await fragmentAfter(page, () => slide(page, "EY0C", 7));
  const address = own.server.address + (await fragmentAfter(page, () => enter(page, "bar, mm", 101.5)));
  const download = page.waitForEvent("download");
  await page.getByRole("button", { name: "Save as a session folder" }).click();
  const files = unzipSync(new Uint8Array(readFileSync(await (await download).path())));
  assert.deepEqual(Object.keys(files).sort(), ["machine.toml", "plan.toml"]);
  assert.match(Buffer.from(files["plan.toml"]).toString(), /bar_mm = 101\.5\n/);
  await page.getByRole("button", { name: "Open in Analyse" }).click();
  await page.getByText("a plan without readings").waitFor();
  assert.deepEqual(wrong, []);
  await page.close();

  const { page: other } = await opened(own.chromium, address);
  await other.getByText(/Rank \d+ of/).waitFor();
  assert.equal(await other.getByLabel("bar, mm").inputValue(), "101.5");
  assert.equal(await other.getByLabel("EY0C", { exact: true }).inputValue(), "7");
  await other.close();
});

test("a structural code makes a machine, and a wrong one a message", async () => {
  const { page } = await explorer(own.server.address);
  const code = page.getByLabel("Structural code");
  await code.fill("[wCbXYZBt]");
  await page.getByRole("button", { name: "Create" }).click();
  await page.getByText("Machine w C b X Y Z B t: w C b X Y Z B t").waitFor();
  await analysed(page);
  await code.fill("<b>");
  await page.getByRole("button", { name: "Create" }).click();
  await page.getByRole("alert").waitFor();
  await page.close();
});

test("improve proposes a test that the plan takes up", async () => {
  const { page } = await explorer(own.server.address);
  const before = await page.getByText(/Rank \d+ of/).textContent();
  const tests = await page.getByLabel("Test", { exact: true }).locator("option").count();
  await page.getByRole("button", { name: "Improve" }).click();
  const add = page.getByRole("button", { name: "Add", exact: true });
  await add.waitFor();
  const [theirs] = command(join(root, "sessions/hermle-c600u"), "plan", "chapter5.toml", "--no-effects", "--improve")
    .improvement.steps;
  const words = await page.locator("li", { has: add }).textContent();
  assert.ok(words.startsWith(`${theirs.test}, ${theirs.duration_min.toFixed(1)} min`), words);
  assert.ok(words.includes(`→ ${theirs.after.toPrecision(3)}`), words);
  await add.click();
  await page.waitForFunction(
    (count) => document.querySelector('select[aria-label="Test"]').options.length === count,
    tests + 1,
  );
  // The block of the test as it was proposed, with its name.
  const plan = await page.getByLabel("Text of plan.toml").inputValue();
  const block = theirs.session_toml.trim();
  assert.ok(plan.includes(block), block);
  // Its readings are analysed with the others.
  await page.waitForFunction((words) => !document.body.textContent.includes(words), before);
  assert.equal(await page.getByRole("alert").count(), 0);
  await page.close();
});
