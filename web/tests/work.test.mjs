// The work of a user stays: what is dropped is added, what is open survives a reload, leaving asks.

import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { zipSync } from "fflate";
import { analysed, drop, enter, filesOf, give, hermle, opened, opening, root, saved, shared, single } from "./page.mjs";

const own = shared();
const rTest = join(root, "sessions/r-test/measured");
const files = filesOf(hermle);
const part = (...names) => Object.fromEntries(names.map((name) => [name, files[name]]));
const area = (page) => page.getByLabel("Analyse", { exact: true }).locator(".drop");
const textOf = (page, name) => page.getByLabel(`Text of ${name}`, { exact: true });

test("the first screen says what a session is in three sentences, and opens three examples", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const words = await page.locator(".first p").innerText();
  // `session.toml` has a point too.
  const sentences = words.replaceAll("session.toml", "").match(/[.!?](\s|$)/g);
  assert.equal(sentences.length, 3, words);
  for (const word of ["session", "machine", "tests", "readings", "Fit", "Trace", "plan"])
    assert.ok(words.includes(word));
  const examples = page.getByRole("list", { name: "Examples" }).getByRole("button");
  assert.equal(await examples.count(), 3);
  await examples.nth(0).click();
  await page.getByText("2416 readings").waitFor();
  assert.equal(await page.locator(".first").count(), 0);
  await page.getByRole("button", { name: "Close", exact: true }).click();
  await examples.nth(1).click();
  await page.getByText("r-test:").waitFor();
  await page.getByRole("button", { name: "Close", exact: true }).click();
  await examples.nth(2).click();
  await analysed(page);
  assert.equal(await page.getByRole("tab", { name: "Explore" }).getAttribute("aria-selected"), "true");
  assert.deepEqual(wrong, []);
  await page.close();
});

test("files that are dropped one after the other make one session", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const alert = page.getByRole("alert");
  await give(page, part("machine.toml"));
  await alert.getByText("no session file").waitFor();
  await give(page, part("session.toml"));
  await alert.getByText("A100.csv").waitFor();
  await give(page, part("A100.csv", "A150.csv"));
  await alert.getByText("C100.csv").waitFor();
  await give(page, part("C100.csv"));
  await give(page, part("C150.csv"));
  await page.getByText("2416 readings").waitFor();
  assert.equal(await alert.count(), 0);
  // So they do in a folder of their own, beside another session.
  const other = await opened(own.chromium, own.server.address);
  await give(other.page, filesOf(rTest));
  await other.page.getByText("r-test:").waitFor();
  await give(other.page, part("machine.toml", "session.toml"));
  await other.page.getByRole("alert").getByText("A100.csv").waitFor();
  for (const name of ["A100.csv", "A150.csv", "C100.csv", "C150.csv"]) await give(other.page, part(name));
  await other.page.getByText("2416 readings").waitFor();
  await other.page.close();
  // A newer file takes the place of its name, and can be taken back.
  const shorter = `${files["C150.csv"]}`.trimEnd().split("\n").slice(0, -100).join("\n");
  await give(page, { "C150.csv": shorter });
  await page.getByText("2316 readings").waitFor();
  await page.getByText("replaced C150.csv").waitFor();
  await page.getByRole("button", { name: "Undo", exact: true }).first().click();
  await page.getByText("2416 readings").waitFor();
  assert.deepEqual(wrong, []);
  await page.close();
});

test("another session is opened beside the open one, whose edits stay", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  await give(page, files);
  await page.getByText("2416 readings").waitFor();
  const text = textOf(page, "session.toml");
  await text.fill(`# own words\n${await text.inputValue()}`);
  await give(page, filesOf(rTest));
  await page.getByText("r-test:").waitFor();
  const session = page.getByLabel("Analyse", { exact: true }).getByLabel("Session", { exact: true });
  assert.deepEqual((await session.locator("option").allTextContents()).sort(), [
    "session-2/session.toml",
    "session.toml",
  ]);
  await session.selectOption("session.toml");
  await page.getByText("2416 readings").waitFor();
  assert.match(await text.inputValue(), /^# own words/);
  // A plan from Explore does not take the place of it either; a second time it takes that of the first.
  await page.getByRole("tab", { name: "Explore" }).click();
  await analysed(page);
  for (let k = 0; k < 2; k++) {
    await page.getByRole("tab", { name: "Explore" }).click();
    await enter(page, "bar, mm", 100.5 + k);
    await page.getByRole("button", { name: "Open in Analyse" }).click();
    await page.getByText("a plan without readings").waitFor();
  }
  const paths = await session.locator("option").allTextContents();
  assert.equal(paths.filter((path) => path.endsWith("plan.toml")).length, 1, paths.join());
  await session.selectOption("session.toml");
  assert.match(await text.inputValue(), /^# own words/);
  assert.deepEqual(wrong, []);
  await page.close();
});

for (const [words, address] of [
  ["from a server", () => own.server.address],
  ["as a single file on the disk", () => single],
]) {
  test(`files of a disk are dropped on the page ${words}`, async () => {
    const { page, wrong } = await opened(own.chromium, address());
    await drop(
      page,
      area(page),
      ["machine.toml", "session.toml", "A100.csv"].map((name) => join(hermle, name)),
    );
    await page.getByRole("alert").getByText("A150.csv").waitFor();
    await drop(
      page,
      area(page),
      ["A150.csv", "C100.csv", "C150.csv"].map((name) => join(hermle, name)),
    );
    await page.getByText("2416 readings").waitFor();
    assert.equal(await page.getByRole("alert").count(), 0);
    assert.deepEqual(wrong, []);
    await page.close();
  });
}

test("a folder of a disk is dropped on the page", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  await drop(page, area(page), [hermle]);
  await page.getByText("2416 readings").waitFor();
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a CSV alone leads to the import, before or after its session", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const view = page.getByLabel("Import", { exact: true });
  const meanings = () => view.locator("thead select").evaluateAll((all) => all.map((one) => one.value));
  const names = `${files["C150.csv"]}`.split("\n").find((line) => !line.startsWith("#"));
  await drop(page, area(page), [join(hermle, "C150.csv")]);
  await view.getByText("Files: C150.csv.").waitFor();
  assert.equal(await page.getByRole("tab", { name: "Import" }).getAttribute("aria-selected"), "true");
  // The session names the file, which is not among its own.
  await drop(
    page,
    view.locator(".drop"),
    ["machine.toml", "session.toml", "A100.csv", "A150.csv", "C100.csv"].map((name) => join(hermle, name)),
  );
  await view.locator("thead select").first().waitFor();
  assert.deepEqual(await meanings(), names.trim().split(","));
  await view.getByRole("button", { name: "Open in Analyse" }).click();
  await page.getByText("2416 readings").waitFor();
  // A file that no session names, beside an open one: the page asks which test is set up like it.
  await give(page, { "of another program.csv": `${files["C150.csv"]}`.replaceAll(",", ";").replaceAll(".", ",") });
  await view.getByText("Files: of another program.csv.").waitFor();
  await view.getByText("The tests go into session.toml.").waitFor();
  await view.getByRole("alert").getByText("its tests differ in their set-up").waitFor();
  await enter(page, "New tests are set up like", "C150");
  await view.locator("thead select").first().waitFor();
  assert.deepEqual(await meanings(), names.trim().split(","));
  await view.getByRole("button", { name: "Open in Analyse" }).click();
  await page.getByText("3220 readings").waitFor();
  await page.getByText("the imported readings are in the session").waitFor();
  assert.deepEqual(wrong, []);
  await page.close();
});

test("session, edits and result survive a reload, and leaving asks only for what is on no disk", async () => {
  for (const address of [own.server.address, single]) {
    const context = await own.chromium.newContext();
    const { page, wrong, asked } = await opening(await context.newPage(), address);
    await give(page, files);
    await page.getByText("2416 readings").waitFor();
    // Nothing is lost yet.
    await page.locator("h1").click();
    await page.reload();
    await page.getByText("2416 readings").waitFor();
    assert.deepEqual(asked, []);
    const text = textOf(page, "session.toml");
    await text.fill(`# own words\n${await text.inputValue()}`);
    await page.getByText("2416 readings").waitFor();
    await page.getByRole("button", { name: "Fit", exact: true }).click();
    await page.locator('[data-kind="fit"]').waitFor();
    const fit = await saved(page, "JSON");
    await page.reload();
    assert.deepEqual(asked, ["beforeunload"]);
    await page.getByText("2416 readings").waitFor();
    assert.match(await text.inputValue(), /^# own words/);
    assert.equal(await saved(page, "JSON"), fit);
    await page.frameLocator("iframe").getByText("EX0C").first().waitFor();
    // What is saved to a disk need not be asked for.
    const download = page.waitForEvent("download");
    await page.getByRole("button", { name: "Download the session" }).click();
    await download;
    await page.reload();
    await page.getByText("2416 readings").waitFor();
    assert.equal(asked.length, 1);
    // A second tab begins with the newest work, and each keeps its own.
    const other = await opening(await context.newPage(), address);
    await other.page.getByText("2416 readings").waitFor();
    await other.page.getByRole("button", { name: "Close", exact: true }).click();
    await other.page.reload();
    await other.page.locator(".first").waitFor();
    await page.reload();
    await page.getByText("2416 readings").waitFor();
    assert.match(await text.inputValue(), /^# own words/);
    assert.deepEqual([...wrong, ...other.wrong], []);
    await context.close();
  }
});

test("a trace that runs asks before the page is left", async () => {
  const { page, asked } = await opened(own.chromium, own.server.address);
  await give(page, files);
  await page.getByText("2416 readings").waitFor();
  await page.getByRole("button", { name: "Trace", exact: true }).click();
  await page.waitForFunction(() => document.querySelector('[role="status"]').textContent);
  await page.reload();
  assert.deepEqual(asked, ["beforeunload"]);
  await page.close();
});

test("the plan, what it was before, and the import survive a reload", async () => {
  const { page, wrong, asked } = await opened(own.chromium, own.server.address);
  await page.getByRole("tab", { name: "Explore" }).click();
  await analysed(page);
  await enter(page, "bar, mm", 101);
  await page.getByLabel("EX0C", { exact: true }).fill("7");
  await page.waitForTimeout(500);
  await page.reload();
  assert.deepEqual(asked, ["beforeunload"]);
  await analysed(page);
  assert.equal(await page.getByRole("tab", { name: "Explore" }).getAttribute("aria-selected"), "true");
  assert.equal(await page.getByLabel("bar, mm").inputValue(), "101");
  assert.equal(await page.getByLabel("EX0C", { exact: true }).inputValue(), "7");
  const undo = page.getByLabel("Explore", { exact: true }).getByRole("button", { name: "Undo" });
  await undo.click();
  await undo.click();
  await page.waitForFunction(() => document.querySelector("#bar").value === "99.9881");
  await page.getByRole("tab", { name: "Import" }).click();
  const view = page.getByLabel("Import", { exact: true });
  await view.getByLabel("Session", { exact: true }).selectOption("hermle-c600u/chapter5.toml");
  await view.locator('input[type="file"]').setInputFiles(join(hermle, "C150.csv"));
  await view.locator("thead select").first().waitFor();
  await view.locator("thead select").nth(2).selectOption("x_um");
  await view.getByText("Say more about the files").waitFor();
  const said = view.getByLabel("What columns hold, by name or number");
  await page.waitForFunction((area) => area.value === "x_um=3", await said.elementHandle());
  await page.reload();
  await page.waitForFunction((area) => area.value === "x_um=3", await said.elementHandle());
  await view.getByText("The tests go into chapter5.toml.").waitFor();
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a ZIP file and the same files from the disk are one session", async () => {
  const { page } = await opened(own.chromium, own.server.address);
  await give(page, files);
  await page.getByText("2416 readings").waitFor();
  const zip = zipSync(Object.fromEntries(Object.entries(files).map(([k, v]) => [`s/${k}`, new Uint8Array(v)])));
  await give(page, { "s.zip": zip });
  await page.getByText("these files are open already").waitFor();
  const session = page.getByLabel("Analyse", { exact: true }).getByLabel("Session", { exact: true });
  assert.deepEqual(await session.locator("option").allTextContents(), ["session.toml"]);
  await page.close();
});
