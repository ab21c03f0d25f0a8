// Analyse: the results of the command, in the browser; faults as messages.

import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, rmSync, truncateSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { zipSync } from "fflate";
import { analysed, command, differences, filesOf, give, hermle, opened, root, saved, shared, single } from "./page.mjs";

const own = shared();

const SESSIONS = ["hermle-c600u", "r-test", "self-calibration", "table-and-head", "tilting-head"].map((name) =>
  join(root, "sessions", name, "measured"),
);
async function result(page, kind) {
  await page.getByRole("button", { name: kind, exact: true }).click();
  await page.locator(`[data-kind="${kind.toLowerCase()}"]`).waitFor();
  return JSON.parse(await saved(page, "JSON"));
}

for (const folder of SESSIONS) {
  for (const kind of ["Fit", "Trace"]) {
    test(`${kind} of ${folder.slice(root.length + 1)} gives the JSON of the command`, async (context) => {
      const { page, wrong } = await opened(own.chromium, own.server.address);
      await give(page, filesOf(folder));
      const ours = await result(page, kind);
      context.diagnostic(`${await page.locator("[data-seconds]").getAttribute("data-seconds")} s`);
      const theirs = command(folder, kind.toLowerCase(), "session.toml", "--allow-implausible");
      const found = differences(ours, theirs);
      assert.equal(found.length, 0, `${found.length} differences:\n${found.slice(0, 20).join("\n")}`);
      assert.deepEqual(wrong, []);
      await page.close();
    });
  }
}

test("a long session says that the page has one processor", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const files = filesOf(hermle);
  await give(page, files);
  await page.getByText(/\d+ readings/).first().waitFor();
  const says = page.getByText("the page computes on one processor");
  assert.equal(await says.count(), 0);
  // More runs of the same.
  const name = Object.keys(files).find((name) => name.endsWith(".csv"));
  const [header, ...rows] = files[name].toString().trim().split("\n");
  assert.match(header, /^time_s,run,/);
  const later = (row, times) =>
    row.replace(/^([\d.]+),(\d+)/, (_, time, run) => `${Number(time) + 1e4 * times},${Number(run) + 100 * times}`);
  const copies = Array.from({ length: Math.ceil(50_000 / rows.length) }, (_, times) => times);
  const repeated = copies.flatMap((times) => rows.map((row) => later(row, times)));
  await give(page, { ...files, [name]: [header, ...repeated].join("\n") });
  await says.waitFor();
  assert.deepEqual(wrong, []);
  await page.close();
});

test("the single file does the same from the disk, and the report is that of the command", async () => {
  const { page, wrong } = await opened(own.chromium, single);
  await give(page, {
    "session.zip": zipSync(
      Object.fromEntries(
        Object.entries(filesOf(hermle)).map(([name, bytes]) => [`folder/${name}`, new Uint8Array(bytes)]),
      ),
    ),
  });
  const ours = await result(page, "Trace");
  assert.deepEqual(differences(ours, command(hermle, "trace", "session.toml", "--allow-implausible")), []);
  const report = page.frameLocator("iframe");
  await report.getByText("explained").first().waitFor();
  // The script of the report runs in its frame.
  await report.locator("#download").waitFor();
  assert.match(
    await saved(page, "Continued session"),
    /\[\[effect\]\]\ncomponent = "EZC"\ndriver = "C"\nshape = "harmonic"\norder = 2/,
  );
  assert.deepEqual(wrong, []);
  await page.close();
});

/** Presses Stop while a trace compares candidates; in the page, so that the trace cannot end between the two. */
async function stoppedTrace(page) {
  await page.getByRole("button", { name: "Trace", exact: true }).click();
  await page.waitForFunction(() => {
    const isSearching = /screening/.test(document.querySelector('[role="status"]')?.textContent ?? "");
    if (isSearching) [...document.querySelectorAll("button")].find((one) => one.textContent === "Stop").click();
    return isSearching;
  });
}

test("Stop ends a trace without an error, and the next computation works", async () => {
  const { page } = await opened(own.chromium, own.server.address);
  await give(page, filesOf(hermle));
  await stoppedTrace(page);
  await page.getByText("trace stopped", { exact: true }).waitFor();
  assert.equal(await page.getByRole("alert").count(), 0);
  assert.ok((await result(page, "Fit")).rms_um > 0.5);
  await page.close();
});

test("Stop keeps the fit of before, with all its files", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  await give(page, filesOf(hermle));
  const fit = await result(page, "Fit");
  await stoppedTrace(page);
  await page.getByText("trace stopped; the fit before stays").waitFor();
  assert.equal(await page.getByRole("alert").count(), 0);
  await page.frameLocator("iframe").getByText("EX0C").first().waitFor();
  assert.deepEqual(JSON.parse(await saved(page, "JSON")), fit);
  assert.equal((await saved(page, "Residuals")).split("\n").filter((line) => /^\w*\d+,/.test(line)).length, 2416);
  assert.match(await saved(page, "Model"), /"EX0C"/);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a trace tells what it does with counts, and for how long", async () => {
  const { page } = await opened(own.chromium, own.server.address);
  await give(page, filesOf(hermle));
  await page.getByText("2416 readings").waitFor();
  await page.evaluate(() => {
    const [words, bars, times] = [new Set(), new Set(), new Set()];
    Object.assign(window, { told: { words, bars, times } });
    const look = () => {
      words.add(document.querySelector('[role="status"]').textContent);
      const bar = document.querySelector("progress");
      if (bar) bars.add(`${bar.value} of ${bar.max}`);
      times.add(document.querySelector(".time")?.textContent ?? "");
    };
    new MutationObserver(look).observe(document.body, {
      subtree: true,
      childList: true,
      characterData: true,
      attributes: true,
    });
  });
  await result(page, "Trace");
  const told = await page.evaluate(() => Object.fromEntries(Object.entries(window.told).map(([k, v]) => [k, [...v]])));
  assert.ok(told.words.includes("reading 2416 readings"), told.words.join("\n"));
  assert.ok(
    told.words.some((words) => /^screening \d+ candidates$/.test(words)),
    told.words.join("\n"),
  );
  const draws = told.words.map((words) => /^null distribution: (\d+) of (\d+) draws$/.exec(words)).filter(Boolean);
  assert.ok(draws.length > 5, told.words.join("\n"));
  const folds = told.words.map((words) => /^searching without one fold: (\d+) of (\d+)$/.exec(words)).filter(Boolean);
  assert.ok(folds.length > 1, told.words.join("\n"));
  for (const [, ended, all] of [...draws, ...folds]) assert.ok(told.bars.includes(`${ended} of ${all}`), told.bars.join("\n"));
  assert.ok(told.times.includes("0 s"), told.times.join("\n"));
  await page.close();
});

test("a fault is shown with file, line and column, and marked in the text", async () => {
  const { page } = await opened(own.chromium, own.server.address);
  const files = filesOf(hermle);
  files["session.toml"] = files["session.toml"].toString().replace("noise_um", "noise_umm");
  const line = 1 + files["session.toml"].split("noise_umm")[0].split("\n").length - 1;
  await give(page, files);
  const alert = page.getByRole("alert");
  await alert.getByText(`session.toml:${line}:1`).waitFor();
  assert.equal(await page.locator(".editor .marked").textContent(), `${line}\n`);
  // The corrected text is read again.
  const text = page.getByLabel("Text of session.toml");
  await text.fill((await text.inputValue()).replace("noise_umm", "noise_um"));
  await page.getByText("2416 readings").waitFor();
  assert.equal(await alert.count(), 0);
  // A cell of a data file.
  files["session.toml"] = files["session.toml"].replace("noise_umm", "noise_um");
  files["A100.csv"] = files["A100.csv"].toString().replace(/\n([^\n]*),[^,\n]*\n/, "\n$1,what\n");
  await give(page, files);
  await alert.getByText(/A100\.csv:\d+:\d+/).waitFor();
  await page.close();
});

/** A ZIP file whose entry unpacks to many zeros. */
function bomb(mebibytes) {
  return zipSync({ "session.toml": [new Uint8Array(mebibytes << 20), { level: 9 }] });
}

test("what cannot be used is refused with a message", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const alert = page.getByRole("alert");
  const refused = async (files, words) => {
    await give(page, files);
    await alert.getByText(words).waitFor();
  };
  await refused({ "notes.txt": "nothing" }, "no session file");
  await refused({ "session.zip": "this is no ZIP file" }, "no ZIP file");
  await refused({ "session.zip": bomb(150) }, "more than 100 MiB");
  await refused(
    {
      "session.zip": zipSync(
        Object.fromEntries(Array.from({ length: 3000 }, (_, k) => [`${k}.csv`, new Uint8Array(1)])),
      ),
    },
    "more than 2000 files",
  );
  await refused({ "session.toml": "[[test]]\nname = [" }, "not valid TOML");
  // A session whose own keys are complete: they are read before the machine file.
  const complete =
    '[instrument]\nkind = "ballbar"\n[[test]]\nname = "A"\nbar_mm = 100\n' +
    "workpiece_ball_mm = [0, 0, 0]\nspindle_ball_mm = [0, 0, 0]\n[machine]\n";
  await refused(
    { "session.toml": complete + 'file = "machine.toml"\n' },
    "the machine file `machine.toml` does not exist",
  );
  await refused({ "session.toml": complete + 'file = "../../etc/passwd"\n', "machine.toml": "" }, "does not exist");
  const broken = filesOf(hermle);
  broken["session.toml"] = broken["session.toml"].toString().replace("A100.csv", "A100.xlsx");
  broken["A100.xlsx"] = Buffer.from("PK\u0003\u0004 no spreadsheet");
  await refused(broken, "the spreadsheet cannot be read");
  // The page still works.
  await give(page, filesOf(hermle));
  assert.ok((await result(page, "Fit")).rms_um > 0.5);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a damaged ZIP file is refused, and an undamaged one with a comment is not", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const alert = page.getByRole("alert");
  const plain = Object.fromEntries(
    Object.entries(filesOf(hermle)).map(([name, bytes]) => [`séance/${name}`, new Uint8Array(bytes)]),
  );
  for (const level of [0, 6]) {
    const whole = Buffer.from(zipSync(plain, { level }));
    const damaged = Buffer.from(whole);
    // Within the readings of a test, which would be other readings.
    const at = whole.indexOf("C150.csv") + 4000;
    damaged[at] ^= 1;
    await give(page, { "session.zip": damaged });
    await alert.getByText(/is damaged|cannot be unpacked/).waitFor();
    await give(page, { "session.zip": whole });
    await alert.waitFor({ state: "detached" });
    await page.getByText("2416 readings").waitFor();
    for (const part of [0.5, 0.8, 0.999].map((share) => whole.subarray(0, Math.floor(share * whole.length)))) {
      await give(page, { "session.zip": part });
      await alert.getByText(/is damaged|cannot be unpacked/).waitFor();
      await give(page, { "session.zip": whole });
      await alert.waitFor({ state: "detached" });
    }
    // A directory that lists one entry less.
    const fewer = Buffer.from(whole);
    const end = fewer.length - 22;
    fewer.writeUInt16LE(fewer.readUInt16LE(end + 10) - 1, end + 10);
    await give(page, { "session.zip": fewer });
    await alert.getByText("is damaged").waitFor();
    const commented = Buffer.concat([whole, Buffer.from("of the machine")]);
    commented.writeUInt16LE(14, end + 20);
    await give(page, { "session.zip": commented });
    await alert.waitFor({ state: "detached" });
    await page.getByText("2416 readings").waitFor();
  }
  assert.deepEqual(wrong, []);
  await page.close();
});

test("many blank lines do not stop the page", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const folder = join(root, "sessions/hermle-c600u");
  const [machine, plan] = ["machine.toml", "chapter5.toml"].map((name) => readFileSync(join(folder, name), "utf8"));
  await give(page, { "machine.toml": machine, "chapter5.toml": "\n".repeat(80_000) + plan });
  await page.getByText("a plan without readings").waitFor();
  assert.ok((await page.locator(".editor pre > *").count()) <= 1);
  await page.getByRole("button", { name: "Explore", exact: true }).click();
  await analysed(page);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("views keep their work, and a trace runs on while others are looked at", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  await give(page, filesOf(hermle));
  await page.getByText("2416 readings").waitFor();
  await page.getByRole("button", { name: "Trace", exact: true }).click();
  await page.waitForFunction(() => document.querySelector('[role="status"]')?.textContent);
  await page.getByRole("tab", { name: "Explore" }).click();
  await page.getByLabel("Template").selectOption("hermle-c600u/chapter5.toml");
  await analysed(page);
  await page.getByLabel("EX0C", { exact: true }).fill("7");
  await page.getByRole("tab", { name: "Analyse" }).click();
  await page.getByRole("button", { name: "Import readings" }).click();
  const goes = page.getByLabel("Import", { exact: true }).getByText("The tests go into session.toml.");
  await goes.waitFor();
  await page.getByRole("tab", { name: "Explore" }).click();
  assert.equal(await page.getByLabel("EX0C", { exact: true }).inputValue(), "7");
  await page.getByRole("tab", { name: "Import" }).click();
  await goes.waitFor();
  await page.getByRole("tab", { name: "Analyse" }).click();
  await page.locator('[data-kind="trace"]').waitFor();
  assert.equal(await page.getByRole("alert").count(), 0);
  assert.deepEqual(wrong, []);
  await page.close();
});

test("a file of 300 MB is refused before it is read", async (context) => {
  const { page } = await opened(own.chromium, own.server.address);
  const folder = mkdtempSync(join(tmpdir(), "abbe-web-"));
  context.after(() => rmSync(folder, { recursive: true }));
  const file = join(folder, "session.csv");
  writeFileSync(file, "");
  truncateSync(file, 300_000_000);
  await page.getByLabel("Analyse", { exact: true }).locator('input[type="file"]').first().setInputFiles(file);
  await page.getByRole("alert").getByText("more than 100 MiB").waitFor();
  await page.close();
});

test("markup in names is text, in the page and in the report", async () => {
  const { page, wrong } = await opened(own.chromium, own.server.address);
  const name = "<img src=x onerror=alert(1)>";
  const files = filesOf(hermle);
  files["session.toml"] = `${files["session.toml"]}`
    .replaceAll('"A100"', `"${name}"`)
    .replace('data = "A100.csv"', 'data = "<script>alert(2)</script>.csv"');
  files["<script>alert(2)</script>.csv"] = files["A100.csv"];
  files["machine.toml"] = `${files["machine.toml"]}`.replace("Hermle C600U", "<script>alert(3)</script>");
  // A file of a real folder cannot have a slash in its name; one in a ZIP file can have anything.
  await give(page, {
    "session.zip": zipSync(
      Object.fromEntries(
        Object.entries(files).map(([path, bytes]) => [
          path.replace("</script>", "<script>"),
          new Uint8Array(Buffer.from(`${bytes}`.replaceAll("alert(2)</script>", "alert(2)<script>"))),
        ]),
      ),
    ),
  });
  await page.getByText(name).first().waitFor();
  await result(page, "Fit");
  await page.frameLocator("iframe").getByText("alert(3)").first().waitFor();
  assert.equal(await page.locator("img").count(), 0);
  assert.equal(await page.frameLocator("iframe").locator("img").count(), 0);
  assert.deepEqual(wrong, []);
  await page.close();
});
