// Without a network, without a mouse, on a small screen; many readings.

import assert from "node:assert/strict";
import { test } from "node:test";
import { analysed, filesOf, give, hermle, opened, PATIENCE_MS, saved, served, shared, single } from "./page.mjs";

const own = shared();

const files = filesOf(hermle);

async function fitted(page) {
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await page.locator("[data-seconds]").waitFor();
  return JSON.parse(await saved(page, "JSON"));
}

test("after the first visit the page works without its server", async () => {
  const context = await own.chromium.newContext();
  const server = await served();
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  await page.goto(server.address);
  await page.evaluate(() => navigator.serviceWorker.ready.then(() => undefined));
  server.end();
  await context.setOffline(true);
  await page.reload();
  await give(page, files);
  assert.ok((await fitted(page)).rms_um > 0.5);
  await page.getByRole("tab", { name: "Explore" }).click();
  await analysed(page);
  assert.deepEqual(await context.cookies(), []);
  await context.close();
});

test("the keyboard reaches and operates everything", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const press = async (name) => {
    for (let k = 0; k < 60; k++) {
      const focused = await page.evaluate(() =>
        (document.activeElement?.textContent || document.activeElement?.getAttribute("aria-label") || "").trim(),
      );
      if (focused === name) return page.keyboard.press("Enter");
      await page.keyboard.press("Tab");
    }
    throw new Error(`the keyboard does not reach ${name}`);
  };
  await give(page, files);
  await page.getByText("2416 readings").waitFor();
  await press("Fit");
  await page.locator("[data-seconds]").waitFor();
  await page.locator("h1").click();
  // The tabs are one stop; the arrow keys go from one to the other.
  const tab = (name) => page.getByRole("tab", { name });
  await page.keyboard.press("Tab");
  for (const [key, name] of [
    ["ArrowLeft", "Import"],
    ["Home", "Analyse"],
    ["End", "Import"],
    ["ArrowRight", "Analyse"],
    ["ArrowRight", "Explore"],
  ]) {
    await page.keyboard.press(key);
    assert.equal(await tab(name).getAttribute("aria-selected"), "true", `${key}: ${name}`);
    assert.ok(await tab(name).evaluate((element) => element === document.activeElement));
    assert.ok(await page.getByRole("tabpanel", { name, exact: true }).isVisible());
    assert.equal(await page.locator('[role="tab"][tabindex="0"]').count(), 1);
  }
  await analysed(page);
  const slider = page.getByLabel("EX0C", { exact: true });
  await slider.focus();
  await page.keyboard.press("ArrowRight");
  assert.equal(await slider.inputValue(), "0.1");
  assert.deepEqual(wrong, []);
  await page.close();
});

test("no view is wider than a screen of 360 pixels, light and dark", async () => {
  for (const colorScheme of ["light", "dark"]) {
    const { page } = await opened(own.chromium, single, { viewport: { width: 360, height: 720 }, colorScheme });
    await give(page, files);
    await page.getByText("2416 readings").waitFor();
    for (const view of ["Analyse", "Explore", "Import"]) {
      await page.getByRole("tab", { name: view }).click();
      if (view === "Explore") await analysed(page);
      assert.ok(
        (await page.evaluate(() => document.documentElement.scrollWidth - innerWidth)) <= 0,
        `${view}, ${colorScheme}`,
      );
    }
    await page.close();
  }
});

test("200,000 readings are fitted", async (context) => {
  const { page } = await opened(own.chromium, own.server.address);
  const session = `${files["session.toml"]}`.replace(
    /\[\[test\]\]\nname = "A100"[\s\S]*?(?=\[\[test\]\]\nname = "C150")/,
    "",
  );
  const [header, ...rows] = `${files["C150.csv"]}`
    .trim()
    .split("\n")
    .filter((line) => !line.startsWith("#"));
  const lines = [header];
  for (let k = 0; lines.length <= 200_000; k++) {
    const cells = rows[k % rows.length].split(",");
    // Another run each time, later in time, with another reading in the last place.
    cells[0] = (Number(cells[0]) + 1e4 * Math.floor(k / rows.length)).toFixed(3);
    cells[1] = String(Number(cells[1]) + 100 * Math.floor(k / rows.length));
    cells[cells.length - 1] = (Number(cells.at(-1)) + 3e-4 * Math.sin(1e3 * k)).toFixed(5);
    lines.push(cells.join(","));
  }
  await give(page, { ...files, "session.toml": session, "C150.csv": lines.join("\n") });
  await page.getByText("200000 readings").waitFor();
  assert.equal((await fitted(page)).readings, 200_000);
  const bytes = Number(await page.locator("[data-bytes]").getAttribute("data-bytes"));
  context.diagnostic(
    `${await page.locator("[data-seconds]").getAttribute("data-seconds")} s, ${(bytes / 1e6).toFixed(0)} MB`,
  );
  assert.ok(bytes <= 512e6);
  await page.close();
});
