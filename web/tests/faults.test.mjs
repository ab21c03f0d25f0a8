// What goes wrong is told, and changes nothing else.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { zipSync } from "fflate";
import { abbe, analysed, enter, filesOf, fragmentAfter, give, hermle, opened, root, saved, shared } from "./page.mjs";

const own = shared();
const rTest = join(root, "sessions/r-test/measured");

const zipOf = (files) => zipSync(Object.fromEntries(Object.entries(files).map(([k, v]) => [k, new Uint8Array(v)])));

async function fitted(page) {
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await page.locator('[data-kind="fit"]').waitFor();
}

test("what holds no session leaves the open one as it is", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  await give(page, filesOf(hermle));
  await page.getByText("2416 readings").waitFor();
  const text = page.getByLabel("Text of session.toml");
  await text.fill(`# own words\n${await text.inputValue()}`);
  await give(page, { "session.zip": "no ZIP file" });
  await page.getByRole("alert").waitFor();
  assert.match(await text.inputValue(), /^# own words/);
  await give(page, { "notes.txt": "nothing" });
  await page.getByText("added notes.txt").waitFor();
  assert.match(await text.inputValue(), /^# own words/);
  // Two sessions whose files have the same names are not mixed.
  await give(page, { "one.zip": zipOf(filesOf(hermle)), "two.zip": zipOf(filesOf(rTest)) });
  await page.getByRole("alert").getByText("two of these files have the path").waitFor();
  assert.match(await text.inputValue(), /^# own words/);
  // A drop that has no file: a text, a link.
  const drop = () => {
    const transfer = new DataTransfer();
    transfer.setData("text/plain", "words");
    const event = new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true });
    document.querySelector(".drop").dispatchEvent(event);
  };
  await page.evaluate(drop);
  await page.getByRole("alert").getByText("no file was dropped").waitFor();
  assert.match(await text.inputValue(), /^# own words/);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a result goes with the session and the text that it is of", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const inside = (name, folder) =>
    Object.fromEntries(Object.entries(filesOf(folder)).map(([file, bytes]) => [`${name}/${file}`, bytes]));
  await give(page, { "both.zip": zipOf({ ...inside("one", hermle), ...inside("two", rTest) }) });
  const session = page.getByLabel("Analyse", { exact: true }).getByLabel("Session", { exact: true });
  await page.getByText("2416 readings").waitFor();
  assert.deepEqual(await session.locator("option").allTextContents(), ["one/session.toml", "two/session.toml"]);
  await fitted(page);
  await session.selectOption("two/session.toml");
  await page.getByText("r-test:").waitFor();
  assert.equal(await page.locator("[data-kind]").count(), 0);
  await fitted(page);
  const text = page.getByLabel("Text of two/session.toml");
  await page.getByText("Files", { exact: true }).press("Enter");
  await text.fill(`${await text.inputValue()}\n`);
  await page.locator("[data-kind]").waitFor({ state: "detached" });
  assert.deepEqual(wrong, []);
  await page.close();
});

test("Explore is offered for tests that move by themselves only", async () => {
  const { page } = await opened(own.chromium, own.server.address);
  const explore = page.getByRole("button", { name: "Explore", exact: true });
  await give(page, filesOf(hermle));
  await page.getByText("These have their readings only: A100, A150, C100, C150.").waitFor();
  assert.ok(await explore.isDisabled());
  await give(page, filesOf(rTest));
  await page.getByText("r-test:").waitFor();
  await explore.click();
  await analysed(page);
  await page.close();
});

test("every coordinate of an R-test is drawn", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  await give(page, filesOf(rTest));
  await page.getByText("r-test:").waitFor();
  await page.getByRole("button", { name: "Explore", exact: true }).click();
  await analysed(page);
  const charts = page.locator(".charts figcaption");
  const titles = async () => (await charts.allTextContents()).map((words) => words.split(":")[0]);
  assert.deepEqual(
    await titles(),
    ["BK1", "BK2", "C-alone"].flatMap((name) => ["dx", "dy", "dz"].map((coordinate) => `${name} ${coordinate}`)),
  );
  // In BK2 the ball is at R on the table: a displacement of the axis along X moves it along X alone.
  await page.getByLabel("EX0C", { exact: true }).fill("10");
  await page.waitForFunction(() => Number(document.querySelector("[data-pictures]").dataset.pictures) > 0);
  const largest = async (title) => {
    const words = await charts.filter({ hasText: `${title}:` }).textContent();
    return Number(words.match(/largest ([\d.e+-]+)/)[1]);
  };
  assert.ok((await largest("BK2 dx")) > 9.9);
  assert.ok((await largest("BK2 dz")) < 1e-3);
  await page.getByLabel("Coordinate", { exact: true }).selectOption("dy");
  assert.deepEqual(await titles(), ["BK1 dy", "BK2 dy", "C-alone dy"]);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("an address with a part missing is told, and another address in the same tab is read", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  await page.getByRole("tab", { name: "Explore" }).click();
  await analysed(page);
  const whole = await fragmentAfter(page, () => enter(page, "bar, mm", 101.5));
  await page.close();
  for (const broken of [whole.slice(0, 200), "#plan=", "#plan=%00<b>", `#plan=${"A".repeat(1 << 19)}`]) {
    const { page } = await opened(own.chromium, own.server.address + broken);
    await page.getByRole("alert").getByText("the address holds no plan").waitFor();
    await page.evaluate((hash) => (location.hash = hash), whole);
    await analysed(page);
    assert.equal(await page.getByLabel("bar, mm").inputValue(), "101.5");
    assert.equal(await page.getByRole("alert").count(), 0);
    await page.close();
  }
  assert.deepEqual(wrong, []);
});

test("the table of figures is that of the command, with its convention of signs", async () => {
  const { page } = await opened(own.chromium, own.server.address);
  await give(page, filesOf(hermle));
  await fitted(page);
  const scratch = mkdtempSync(join(tmpdir(), "abbe-web-"));
  const out = join(scratch, "figures.csv");
  execFileSync(abbe, ["fit", "session.toml", "--csv", out, "--quiet"], { cwd: hermle, stdio: "ignore" });
  const theirs = readFileSync(out, "utf8").split("\n");
  rmSync(scratch, { recursive: true });
  const ours = (await saved(page, "CSV")).split("\n");
  const isWord = (cell) => Number.isNaN(Number(cell));
  const words = (lines) => lines.map((line) => line.split(",").filter(isWord));
  assert.match(ours[0], /^# .*ISO 230-1/);
  assert.deepEqual(words(ours), words(theirs));
  await page.close();
});
