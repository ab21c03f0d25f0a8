// Explore: numbers that count when they are complete, faults at their fields, undo; the drawing; a phone.

import assert from "node:assert/strict";
import { test } from "node:test";
import { analysed, enter, opened, shared } from "./page.mjs";

const own = shared();

async function explorer(options) {
  const { page, wrong } = await opened(own.chromium, own.server.address, options);
  await page.getByRole("tab", { name: "Explore" }).click();
  await analysed(page);
  return { page, wrong };
}

const bar = (page) => page.getByLabel("bar, mm");
const planText = (page) => page.getByLabel("Text of plan.toml").inputValue();
const undo = (page) => page.getByLabel("Explore", { exact: true }).getByRole("button", { name: "Undo" });
const redo = (page) => page.getByRole("button", { name: "Redo" });
/** What is said at a field. */
const described = (field) =>
  field.evaluate((element) => document.getElementById(element.getAttribute("aria-describedby"))?.textContent);
/** The bars of the tests in the text of the plan. */
const bars = async (page) => [...(await planText(page)).matchAll(/^bar_mm = (.*)$/gm)].map(([, mm]) => mm);

test("a number that is typed key by key counts with Enter, or when the field is left", async () => {
  const { page, wrong } = await explorer();
  const before = await bars(page);
  await bar(page).click();
  await page.keyboard.press("Control+a");
  await page.keyboard.type("150", { delay: 60 });
  // Not yet.
  assert.deepEqual(await bars(page), before);
  assert.equal(await page.getByRole("alert").count(), 0);
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelector("textarea").value.includes("bar_mm = 150\n"));
  // A bar of 150 mm does not fit between these balls. That is said at its field, which keeps what was typed.
  await page.waitForFunction(() => document.querySelector("#bar").getAttribute("aria-invalid") === "true");
  assert.match(await described(bar(page)), /a bar of 150\.0000 mm cannot reach between its balls/);
  assert.equal(await bar(page).inputValue(), "150");
  await page.keyboard.press("Control+a");
  await page.keyboard.type("100.25", { delay: 60 });
  await page.keyboard.press("Tab");
  await page.waitForFunction(() => document.querySelector("textarea").value.includes("bar_mm = 100.25\n"));
  await page.waitForFunction(() => document.querySelector("#bar").getAttribute("aria-invalid") === null);
  assert.equal(await bar(page).inputValue(), "100.25");
  // Escape leaves the number as it was.
  await bar(page).click();
  await page.keyboard.press("Control+a");
  await page.keyboard.type("7");
  await page.keyboard.press("Escape");
  assert.equal(await bar(page).inputValue(), "100.25");
  await page.keyboard.press("Tab");
  assert.ok((await bars(page)).includes("100.25"));
  assert.deepEqual(wrong, []);
  await page.close();
});

test("every change is taken back and done again, in the order of the hand", async () => {
  const { page, wrong } = await explorer();
  const start = await planText(page);
  assert.ok(await undo(page).isDisabled());
  await enter(page, "bar, mm", 101);
  await enter(page, "table ball, mm x, mm", 3);
  const slider = page.getByLabel("EX0C", { exact: true });
  await slider.focus();
  // Steps of one slider in a row are one change.
  for (let k = 0; k < 5; k++) await page.keyboard.press("ArrowRight");
  assert.equal(await slider.inputValue(), "0.5");
  await page.keyboard.press("Control+z");
  assert.equal(await slider.inputValue(), "0");
  await undo(page).click();
  assert.ok((await bars(page)).includes("101"));
  await undo(page).click();
  assert.equal(await planText(page), start);
  await page.waitForFunction(() => document.querySelector("#bar").value === "99.9881");
  assert.ok(await undo(page).isDisabled());
  for (let k = 0; k < 3; k++) await redo(page).click();
  assert.ok(await redo(page).isDisabled());
  assert.equal(await slider.inputValue(), "0.5");
  await page.waitForFunction(() => document.querySelector("#bar").value === "101");
  await page.waitForFunction(() => document.querySelector('[aria-label="table ball, mm x, mm"]').value === "3");
  assert.equal(await page.getByRole("alert").count(), 0);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a fault is shown at its field, and the last plan that can be used stays", async () => {
  const { page, wrong } = await explorer();
  const rank = await page.getByText(/Rank \d+ of/).textContent();
  // What the page itself knows.
  await enter(page, "bar, mm", -5);
  assert.match(await described(bar(page)), /a bar is longer than 0/);
  assert.equal((await bars(page)).includes("-5"), false);
  await enter(page, "bar, mm", 99.9881);
  assert.equal(await bar(page).getAttribute("aria-invalid"), null);
  // What the library finds: a step that divides nothing.
  const step = page.getByLabel("step, °", { exact: true });
  await enter(page, "step, °", -1);
  await page.waitForFunction(() => document.querySelector('[aria-label="step, °"]').getAttribute("aria-invalid"));
  const alert = page.getByRole("alert");
  await alert.getByText(/plan\.toml:\d+:\d+/).waitFor();
  assert.ok((await alert.textContent()).includes(await described(step)));
  // Only this field, and what was shown is shown.
  assert.equal(await page.locator('input[aria-invalid="true"]').count(), 1);
  assert.equal(await page.getByText(/Rank \d+ of/).textContent(), rank);
  // The sliders go on with the last plan that can be used.
  await enter(page, "EX0C, µm", 10);
  await page.waitForFunction(() => document.body.textContent.includes("C150: largest 6.67"));
  assert.equal(await step.inputValue(), "-1");
  await alert.getByRole("button", { name: "Go back to it" }).click();
  await alert.waitFor({ state: "detached" });
  await page.waitForFunction(() => document.querySelector('[aria-label="step, °"]').value === "0.25");
  // The fault of a text is found again by undo, and left again.
  await undo(page).click();
  await alert.waitFor();
  await undo(page).click();
  await undo(page).click();
  await alert.waitFor({ state: "detached" });
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a plan that cannot be used is kept over a reload, with the last one that can", async () => {
  const { page, wrong } = await explorer();
  await enter(page, "step, °", -1);
  await page.getByRole("alert").waitFor();
  await page.waitForTimeout(500);
  await page.reload();
  await page
    .getByRole("alert")
    .getByText(/plan\.toml:\d+:\d+/)
    .waitFor();
  await analysed(page);
  await page.getByRole("alert").getByRole("button", { name: "Go back to it" }).click();
  await page.getByRole("alert").waitFor({ state: "detached" });
  assert.equal(await page.getByLabel("step, °", { exact: true }).inputValue(), "0.25");
  assert.deepEqual(wrong, []);
  await page.close();
});

test("each slider has a number, also beyond its ends", async () => {
  const { page, wrong } = await explorer();
  const sliders = page.locator('.slider input[type="range"]');
  assert.equal(await page.locator('.slider input[type="number"]').count(), await sliders.count());
  await enter(page, "EX0C, µm", 120);
  // 100 mm from the axis, with a bar of 149.9946 mm: R / L of the error, and e² / 2L at most.
  await page.waitForFunction(() => /C150: largest 80\.\d/.test(document.body.textContent));
  assert.equal(await page.getByLabel("EX0C", { exact: true }).inputValue(), "120");
  await page.getByLabel("EX0C", { exact: true }).fill("-4");
  await page.waitForFunction(() => document.querySelector('[aria-label="EX0C, µm"]').value === "-4");
  assert.deepEqual(wrong, []);
  await page.close();
});

test("balls and bar are drawn at the positions of the test", async (context) => {
  const { page, wrong } = await explorer();
  const canvas = page.locator('canvas[aria-label^="Set-up"]');
  const isDrawn = (element) => element.pointOf || /WebGL/.test(element.parentElement.textContent);
  await page.waitForFunction(isDrawn, await canvas.elementHandle());
  if (!(await canvas.evaluate((element) => element.pointOf !== undefined))) return context.skip("no WebGL");
  const test = page.getByLabel("Test", { exact: true });
  const label = (await test.locator("option").allTextContents()).find((words) => words.startsWith("C150"));
  await test.selectOption({ label });
  await page.waitForFunction(() => /Balls and bar at/.test(document.body.textContent));
  const position = page.getByLabel("Position");
  const [last, own] = [
    Number(await position.getAttribute("max")),
    await Promise.all(["x", "y", "z"].map((k) => page.getByLabel(`table ball, mm ${k}, mm`).inputValue())),
  ];
  const ball = own.map(Number);
  const length = Number(await bar(page).inputValue());
  const seen = new Set();
  for (const k of [0, Math.round(last / 3), last]) {
    await position.fill(String(k));
    const caption = await page.locator("figcaption", { hasText: "Balls and bar at" }).textContent();
    const at = Object.fromEntries(
      [...caption.matchAll(/\b([XYZAC]) (-?\d+(?:\.\d+)?)/g)].map(([, axis, n]) => [axis, Number(n)]),
    );
    const [table, tool] = await canvas.evaluate((element) =>
      ["workpiece_ball_mm", "spindle_ball_mm"].map((one) => element.pointOf(one)),
    );
    // C turns the table about +Z, with A at rest at zero; the positions in the caption are rounded.
    assert.equal(at.A, 0, caption);
    const turn = (at.C * Math.PI) / 180;
    const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
    const expected = [cos * ball[0] - sin * ball[1], sin * ball[0] + cos * ball[1], ball[2]];
    expected.forEach((mm, i) => assert.ok(Math.abs(mm - table[i]) < 0.05, `${caption}: ${table} is not ${expected}`));
    const spindle = ["X", "Y", "Z"].map((axis) => at[axis]);
    spindle.forEach((mm, i) => assert.ok(Math.abs(mm - tool[i]) < 0.06, `${caption}: ${tool}`));
    const distance = Math.hypot(...table.map((mm, i) => mm - tool[i]));
    assert.ok(Math.abs(distance - length) < 0.05, `${distance} is not ${length}`);
    seen.add(caption);
  }
  assert.equal(seen.size, 3);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a ball is dragged where it is drawn, in the frame that carries it", async (context) => {
  const { page, wrong } = await explorer();
  const canvas = page.locator('canvas[aria-label^="Set-up"]');
  await page.waitForFunction(
    (element) => element.placeOf || /WebGL/.test(element.parentElement.textContent),
    await canvas.elementHandle(),
  );
  if (!(await canvas.evaluate((element) => element.placeOf !== undefined))) return context.skip("no WebGL");
  const position = page.getByLabel("Position");
  await position.fill(String(Math.round(Number(await position.getAttribute("max")) / 2)));
  const own = () => Promise.all(["x", "y", "z"].map((k) => page.getByLabel(`table ball, mm ${k}, mm`).inputValue()));
  const before = (await own()).map(Number);
  const [from, at] = await canvas.evaluate((element) => [
    element.pointOf("workpiece_ball_mm"),
    element.placeOf("workpiece_ball_mm"),
  ]);
  const box = await canvas.boundingBox();
  await page.mouse.move(box.x + at.x, box.y + at.y);
  await page.mouse.down();
  await page.mouse.move(box.x + at.x + 2, box.y + at.y - 1, { steps: 3 });
  await page.mouse.up();
  await page.waitForFunction(
    (before) => Number(document.querySelector('[aria-label="table ball, mm x, mm"]').value) !== before[0],
    before,
  );
  await page.waitForTimeout(500);
  const to = await canvas.evaluate((element) => element.pointOf("workpiece_ball_mm"));
  const after = (await own()).map(Number);
  const moved = (one, other) => Math.hypot(...one.map((mm, k) => mm - other[k]));
  // A frame keeps lengths: to the tenth of a millimetre of the numbers.
  assert.ok(moved(from, to) > 0.5);
  assert.ok(Math.abs(moved(from, to) - moved(before, after)) < 0.2, `${moved(from, to)}, ${moved(before, after)}`);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("on a phone the chart stays in sight while a slider is moved", async () => {
  const { page, wrong } = await explorer({ viewport: { width: 360, height: 720 }, hasTouch: true });
  const errors = page.locator(".slider:not(.setup)");
  for (let k = 0; k < (await errors.count()); k++) {
    const slider = errors.nth(k).locator('input[type="range"]');
    // As far down as a thumb would scroll it.
    await slider.evaluate((element) => element.scrollIntoView({ block: "center" }));
    const boxes = await Promise.all([slider, page.locator(".charts canvas").first()].map((one) => one.boundingBox()));
    const [ours, chart] = boxes;
    assert.ok(chart.y >= 0 && chart.y + chart.height <= 720, `chart at ${chart.y}`);
    assert.ok(ours.y >= chart.y + chart.height && ours.y + ours.height <= 720, `slider at ${ours.y}`);
    // Nothing lies over either.
    const isOnTop = ({ x, y, width, height }) => [x + width / 2, y + height / 2];
    for (const [one, selector] of [
      [ours, 'input[type="range"]'],
      [chart, "canvas"],
    ]) {
      assert.ok(
        await page.evaluate(([[x, y], s]) => document.elementFromPoint(x, y).matches(s), [isOnTop(one), selector]),
      );
    }
  }
  assert.ok((await page.evaluate(() => document.documentElement.scrollWidth - innerWidth)) <= 0);
  // The chart of the chosen test is the one in sight.
  await page.getByLabel("Test", { exact: true }).selectOption("2");
  await page.waitForFunction(() => {
    const strip = document.querySelector(".charts").getBoundingClientRect();
    const third = document.querySelectorAll(".charts figure")[2].getBoundingClientRect();
    return third.left >= strip.left - 2 && third.right <= strip.right + strip.width * 0.1;
  });
  assert.deepEqual(wrong, []);
  await page.close();
});
