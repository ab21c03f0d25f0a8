// Import: the page writes what the command writes, and shows the first rows as they were understood.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { abbe, drop, hermle, opened, root, shared } from "./page.mjs";

const own = shared();

const foreign = (name) => join(root, "tests/foreign", name);

/** What the command writes: the texts of the files by name. */
function command(name, plan) {
  const scratch = mkdtempSync(join(tmpdir(), "abbe-web-"));
  try {
    const folder = plan ? scratch : join(scratch, "session");
    const into = plan
      ? ["--session", join(scratch, plan)]
      : ["--machine", join(root, "sessions/ur10/machine.toml"), "--out", folder];
    if (plan) copyFileSync(foreign(plan), join(scratch, plan));
    const json = join(scratch, "result.json");
    execFileSync(abbe, ["import", foreign(name), ...into, "--json", json, "--quiet"], { stdio: "ignore" });
    const { data } = JSON.parse(readFileSync(json, "utf8")).tests[0];
    const session = plan ?? "session.toml";
    return { session: readFileSync(join(folder, session), "utf8"), data, read: readFileSync(join(folder, data)) };
  } finally {
    rmSync(scratch, { recursive: true });
  }
}

async function importing(options) {
  const { page, wrong } = await opened(own.chromium, own.server.address, options);
  await page.getByRole("tab", { name: "Import" }).click();
  return { page, wrong, view: page.getByLabel("Import", { exact: true }) };
}

/** The files of the collection of the command's tests, with the plan that has their test. */
const FILES = [
  // Joints in radians, coordinates in metres: the machine decides.
  ["ros.csv"],
  // UTF-16 with a byte order mark.
  ["unicode.txt"],
  // A polar tracker, of which a normalised copy is written.
  ["polar-tracker.csv"],
  // Semicolons, decimal commas, a German head.
  ["kugelstab.csv", "plan-hermle.toml"],
  // Forward and backward in two columns.
  ["two-directions.csv", "plan-hermle.toml"],
];

for (const [name, plan] of FILES) {
  test(`${name}: the page writes what the command writes`, async () => {
    const { page, view, wrong } = await importing();
    const input = view.locator('input[type="file"]');
    if (plan) {
      await input.setInputFiles(foreign(plan));
      await view.getByText(`The tests go into ${plan}.`).waitFor();
    } else {
      await view.getByLabel("Machine", { exact: true }).selectOption("ur10/machine.toml");
    }
    await input.setInputFiles(foreign(name));
    await view.getByRole("button", { name: "Open in Analyse" }).waitFor();
    const theirs = command(name, plan);
    assert.equal(await view.locator("pre").textContent(), theirs.session);
    // The first rows stand there as in the file.
    const cells = await view.locator("tbody").first().locator("td").allTextContents();
    assert.ok(cells.length >= 15 && cells.every((cell) => cell !== "" || plan));
    await view.getByRole("button", { name: "Open in Analyse" }).click();
    await page.locator('[role="tabpanel"]:visible').getByText("readings").first().waitFor();
    const analyse = page.getByLabel("Analyse", { exact: true });
    if (theirs.data !== name) {
      await analyse.getByLabel("File", { exact: true }).selectOption(theirs.data);
      assert.equal(await analyse.locator("textarea").inputValue(), theirs.read.toString());
    }
    assert.deepEqual(wrong, []);
    await page.close();
  });
}

test("what a column holds can be said, and a file without names says so", async () => {
  const { page, view, wrong } = await importing();
  await view.getByLabel("Machine", { exact: true }).selectOption("ur10/machine.toml");
  await view.locator('input[type="file"]').setInputFiles(foreign("no-names.csv"));
  await view.getByRole("alert").getByText("no names of columns").first().waitFor();
  const hints = ["j1", "j2", "j3", "j4", "j5", "j6"].map((joint, k) => `${joint}_rad=${k + 1}`);
  const area = view.getByLabel("What columns hold, by name or number");
  await area.fill([...hints, "px_mm=7", "py_mm=8", "pz_mm=9"].join("\n"));
  await area.blur();
  await view.getByText("60 readings").waitFor();
  assert.equal(await view.getByRole("alert").count(), 0);
  const meanings = await view.locator("thead select").evaluateAll((all) => all.map((one) => one.value));
  assert.deepEqual(meanings.slice(0, 2), ["j1_rad", "j2_rad"]);
  // Degrees as radians contradict the machine, and the message says so; a choice in the table takes that back.
  await view.locator("thead select").first().selectOption("j1_deg");
  await view.getByRole("alert").waitFor();
  await area.fill((await area.inputValue()).replace("j1_deg", "j1_rad"));
  await area.blur();
  await view.getByText("60 readings").waitFor();
  assert.deepEqual(wrong, []);
  await page.close();
});

/** C150.csv as a measuring program writes it. */
function exported() {
  const rows = readFileSync(join(hermle, "C150.csv"), "utf8")
    .trim()
    .split("\n")
    .filter((line) => !line.startsWith("#"));
  const head = "Zeit [s];Run;X [mm];Y [mm];Z [mm];A [deg];C-Achse [°];Länge [mm]".split(";");
  const cells = rows.slice(1).map((row) => row.replaceAll(",", ";").replaceAll(".", ","));
  return Buffer.from(["Ball bar export", "", head.join(";"), ...cells].join("\r\n"), "latin1");
}

test("readings of a planned test, with decimal commas and a head in Windows-1252", async () => {
  const { page, view, wrong } = await importing();
  await view.getByLabel("Session", { exact: true }).selectOption("hermle-c600u/chapter5.toml");
  const file = { name: "C150.csv", mimeType: "text/csv", buffer: exported() };
  await view.locator('input[type="file"]').setInputFiles(file);
  await view.getByText(/^\d+ readings; latin1, semicolon/).waitFor();
  const meanings = await view.locator("thead select").evaluateAll((all) => all.map((one) => one.value));
  assert.deepEqual(meanings, ["time_s", "run", "x_mm", "y_mm", "z_mm", "a_deg", "c_deg", "length_mm"]);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a CSV alone leads to import, with a machine of the examples", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const area = page.getByLabel("Analyse", { exact: true }).locator(".drop");
  await drop(page, area, [foreign("ros.csv")]);
  const view = page.getByLabel("Import", { exact: true });
  await view.getByText("Files: ros.csv.").waitFor();
  await view.getByText("Choose the machine").waitFor();
  await view.getByLabel("Machine", { exact: true }).selectOption("ur10/machine.toml");
  await view.getByText("The tests go into a new session: UR10.").waitFor();
  await view.getByRole("button", { name: "Open in Analyse" }).click();
  await page.getByText("60 readings").waitFor();
  assert.equal(await page.getByRole("alert").count(), 0);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("Stop ends an import, which can begin again", async () => {
  const { page, view, wrong } = await importing();
  await view.getByLabel("Machine", { exact: true }).selectOption("ur10/machine.toml");
  await view.locator('input[type="file"]').setInputFiles(foreign("ros.csv"));
  await view.getByRole("button", { name: "Stop" }).click();
  await view.getByText("stopped", { exact: true }).waitFor();
  await page.waitForTimeout(1000);
  assert.equal(await view.locator("table").count(), 0);
  assert.equal(await page.getByRole("alert").count(), 0);
  await view.getByRole("button", { name: "Read again" }).click();
  await view.getByText("60 readings").waitFor();
  assert.deepEqual(wrong, []);
  await page.close();
});
