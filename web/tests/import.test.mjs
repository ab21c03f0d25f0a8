// Import: foreign files give the result of the original.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { hermle, opened, shared } from "./page.mjs";

const own = shared();

const original = readFileSync(join(hermle, "C150.csv"), "utf8");

/** C150.csv as another program writes it. */
function foreign(separator, decimal, header, above = []) {
  const rows = original
    .trim()
    .split("\n")
    .filter((line) => !line.startsWith("#"));
  const cells = rows.slice(1).map((line) =>
    line
      .split(",")
      .map((cell) => cell.replace(".", decimal))
      .join(separator),
  );
  return [...above, header, ...cells].join("\r\n");
}

const names = original
  .split("\n")
  .find((line) => !line.startsWith("#"))
  .trim();

async function wizard() {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  await page.getByRole("tab", { name: "Import" }).click();
  const view = page.getByLabel("Import", { exact: true });
  await view.getByLabel("Session", { exact: true }).selectOption("hermle-c600u/measured/session.toml");
  await view.getByLabel("Test", { exact: true }).selectOption("C150");
  return { page, view, wrong };
}

const theirs = names
  .split(",")
  .map(
    (name) =>
      ({
        time_s: "Zeit [s]",
        run: "Run",
        c_deg: "C-Achse [°]",
        a_deg: "A [deg]",
        x_mm: "X [mm]",
        y_mm: "Y [mm]",
        z_mm: "Z [mm]",
        length_mm: "Länge [mm]",
      })[name] ?? name,
  );

const FILES = {
  "semicolons, decimal commas, two lines above, Windows-1252": Buffer.from(
    foreign(";", ",", theirs.join(";"), ["Ball bar export", ""]),
    "latin1",
  ),
  "tabs, UTF-8": Buffer.from(foreign("\t", ".", theirs.join("\t"))),
  "UTF-16 with a byte order mark": Buffer.from(`\ufeff${foreign(";", ".", theirs.join(";"))}`, "utf16le"),
};

for (const [words, buffer] of Object.entries(FILES)) {
  test(`${words}: the guess gives the residual of the original`, async () => {
    const { page, view, wrong } = await wizard();
    await view.locator('input[type="file"]').setInputFiles({ name: "export.csv", mimeType: "text/csv", buffer });
    await view.locator("thead select").first().waitFor();
    const guessed = await view.locator("thead select").evaluateAll((all) => all.map((one) => one.value));
    assert.deepEqual(guessed, names.split(","));
    await view.getByRole("button", { name: /^Fit/ }).click();
    const results = view.locator("tbody").last().locator("td:last-child");
    await results.first().getByText("0.548").waitFor();
    await view.locator("button:enabled", { hasText: /^Fit/ }).waitFor();
    // A wrong guess is seen: a fault, or a larger residual. A column that is zero throughout has any unit.
    const others = (await results.allTextContents()).slice(1);
    assert.ok(others.length > 2);
    assert.ok(others.every((one) => !(Number(one) < 0.548)), others.join("\n"));
    assert.ok(others.some((one) => !(Number(one) < 1)), others.join("\n"));
    await view.getByRole("button", { name: "Open in Analyse" }).click();
    await page.getByText("2416 readings").waitFor();
    assert.deepEqual(wrong, []);
    await page.close();
  });
}
