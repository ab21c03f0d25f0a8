// Rules of accessibility (axe): no finding in any view, light and dark, wide and narrow, nor in a report.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { test } from "node:test";
import { analysed, enter, filesOf, give, hermle, opened, shared } from "./page.mjs";

const own = shared();
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** The findings of axe in a page or a frame, each with its elements. */
async function findings(frame) {
  await frame.evaluate(axe);
  return frame.evaluate(async () => {
    // Frames are looked at by themselves.
    const { violations, passes } = await window.axe.run(document, { iframes: false });
    if (passes.length < 10) return [`only ${passes.length} rules were applied`];
    return violations.map(
      ({ id, nodes }) =>
        `${id}: ${nodes
          .map(({ html }) => html)
          .slice(0, 5)
          .join(" | ")}`,
    );
  });
}

const VIEWS = {
  "first screen": async () => {},
  session: async (page) => {
    await give(page, filesOf(hermle));
    await page.getByText("2416 readings").waitFor();
  },
  "session with a fault": async (page) => {
    const files = filesOf(hermle);
    await give(page, { ...files, "session.toml": `${files["session.toml"]}`.replace("noise_um", "noise_umm") });
    await page.getByRole("alert").waitFor();
  },
  report: async (page) => {
    await VIEWS.session(page);
    await page.getByRole("button", { name: "Trace", exact: true }).click();
    await page.locator('[data-kind="trace"]').waitFor();
    await page.frameLocator("iframe").getByText("explained").first().waitFor();
  },
  Explore: async (page) => {
    await page.getByRole("tab", { name: "Explore" }).click();
    await analysed(page);
    await page.locator("math").first().waitFor();
    for (const closed of await page.locator("summary:visible").all()) await closed.click();
  },
  "Explore with a fault": async (page) => {
    await VIEWS.Explore(page);
    await enter(page, "step, °", -1);
    await page.getByRole("alert").waitFor();
  },
  Import: async (page) => {
    await page.getByRole("tab", { name: "Import" }).click();
    const view = page.getByLabel("Import", { exact: true });
    await view.getByLabel("Session", { exact: true }).selectOption("hermle-c600u/chapter5.toml");
    const buffer = filesOf(hermle)["C150.csv"];
    await view.locator('input[type="file"]').setInputFiles({ name: "C150.csv", mimeType: "text/csv", buffer });
    await view.locator("tbody").waitFor();
    for (const closed of await page.locator("summary:visible").all()) await closed.click();
  },
  "Import with a fault": async (page) => {
    await page.getByRole("tab", { name: "Import" }).click();
    const view = page.getByLabel("Import", { exact: true });
    await view.getByLabel("Machine", { exact: true }).selectOption("ur10/machine.toml");
    const buffer = Buffer.from("1,2\n3,4\n5,6\n");
    await view.locator('input[type="file"]').setInputFiles({ name: "readings.csv", mimeType: "text/csv", buffer });
    await page.getByRole("alert").waitFor();
  },
};

for (const [name, show] of Object.entries(VIEWS)) {
  test(`axe finds nothing: ${name}`, async () => {
    for (const colorScheme of ["light", "dark"]) {
      for (const width of [1280, 360]) {
        const { page } = await opened(own.chromium, own.server.address, {
          viewport: { width, height: 800 },
          colorScheme,
        });
        await show(page);
        assert.deepEqual(await findings(page), [], `${colorScheme}, ${width} pixels`);
        for (const frame of page.frames().slice(1)) {
          assert.deepEqual(await findings(frame), [], `the report, ${colorScheme}, ${width} pixels`);
        }
        await page.close();
      }
    }
  });
}
