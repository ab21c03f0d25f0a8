// Draws the pictures of docs/guide/browser.md: `node tests/pictures.mjs` in web/, after the build.

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { analysed, browser, filesOf, give, hermle, opened, root, served } from "./page.mjs";

const pictures = join(root, "docs/pictures");
const chromium = await browser();
const server = await served();

const VIEWS = {
  async analyse(page) {
    await give(page, filesOf(hermle));
    await page.getByText("2416 readings").waitFor();
  },
  async report(page) {
    await VIEWS.analyse(page);
    await page.getByRole("button", { name: "Trace", exact: true }).click();
    await page.locator("[data-seconds]").waitFor();
    await page.frameLocator("iframe").getByText("explained").first().waitFor();
    await page.locator("iframe").evaluate((frame) => frame.scrollIntoView());
    await page.evaluate(() => scrollBy(0, -60));
  },
  async explore(page) {
    await page.getByRole("tab", { name: "Explore" }).click();
    await analysed(page);
    for (const [error, value] of Object.entries({ EX0C: 10, EY0A: -8, EB0C: 5 })) {
      await page.getByLabel(error, { exact: true }).fill(String(value));
    }
    await page.waitForFunction(() => Number(document.querySelector("[data-pictures]").dataset.pictures) > 0);
    await page.waitForFunction(() => document.querySelector('canvas[aria-label^="Set-up"]').placeOf);
    if (page.viewportSize().width < 600) {
      // A slider under the charts, which stay in sight.
      const slider = page.getByLabel("EC0A", { exact: true });
      await slider.evaluate((element) => element.scrollIntoView({ block: "center" }));
    }
  },
  async import(page) {
    await page.getByRole("tab", { name: "Import" }).click();
    const view = page.getByLabel("Import", { exact: true });
    await view.getByLabel("Session", { exact: true }).selectOption("hermle-c600u/chapter5.toml");
    const rows = readFileSync(join(hermle, "C150.csv"), "utf8").trim().split("\n").slice(1);
    const foreign = [
      "Zeit [s];Run;X [mm];Y [mm];Z [mm];A [deg];C-Achse [°];Länge [mm]",
      ...rows.map((row) => row.replaceAll(",", ";").replaceAll(".", ",")),
    ];
    const buffer = Buffer.from(foreign.join("\r\n"), "latin1");
    await view.locator('input[type="file"]').setInputFiles({ name: "C150.csv", mimeType: "text/csv", buffer });
    await view.locator("tbody").waitFor();
  },
};

for (const [name, show] of Object.entries(VIEWS)) {
  for (const [width, height, colorScheme] of [
    [1280, 860, "light"],
    [360, 720, name === "explore" ? "dark" : "light"],
  ]) {
    const { page } = await opened(chromium, server.address, { viewport: { width, height }, colorScheme });
    await show(page);
    const overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    if (overflow > 0) throw new Error(`${name} at ${width} px is ${overflow} px too wide`);
    await page.screenshot({ path: join(pictures, `browser-${name}-${width}.png`) });
    await page.close();
  }
}
await chromium.close();
server.end();
