//! Reports in a browser: nothing on the console, nothing asked for, and the sliders move the traces by what the closed form says.
//!
//! A script is added to a copy of the page; Chromium runs it and prints the document. Skipped by name where there is no Chromium.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use super::report::with_markup_in_names;
use super::{abbe, ready, text};

fn chromium(test: &str) -> Option<&'static str> {
    let found = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| {
            let version = Command::new(name).arg("--version").output();
            version.is_ok_and(|output| output.status.success())
        });
    if found.is_none() {
        assert!(
            std::env::var("CI").as_deref() != Ok("true"),
            "{test}: no Chromium, and CI needs it"
        );
        println!("skipped: {test} (no Chromium)");
    }
    found
}

/// Opens a page with a script added to it, whose value it returns, beside what stood on the console.
fn run(browser: &str, page: &Path, script: &str) -> (Value, Vec<String>) {
    let profile = tempfile::tempdir().unwrap();
    let copy = profile.path().join("page.html");
    let html = std::fs::read_to_string(page).unwrap();
    let added = format!(
        "<script>addEventListener('load', async () => {{ let found; try {{ found = await (async () => {{ {script} }})(); }} \
         catch (error) {{ found = {{ fault: String(error) }}; }} \
         const element = document.createElement('pre'); element.id = 'found'; element.textContent = JSON.stringify(found); document.body.append(element); }});</script></body>"
    );
    // Virtual time, which lets the test end as soon as the page has nothing to do, draws no frames: a timer stands for them.
    let frames = "<head><script>window.requestAnimationFrame = (call) => setTimeout(call, 16)</script>";
    let html = html.replacen("<head>", frames, 1);
    std::fs::write(&copy, html.replacen("</body>", &added, 1)).unwrap();
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--enable-logging=stderr",
            "--window-size=1280,900",
            "--virtual-time-budget=8000",
            "--dump-dom",
        ])
        .arg(format!(
            "--user-data-dir={}",
            profile.path().join("profile").display()
        ))
        .arg(format!("file://{}", copy.display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    let found = dom
        .split("<pre id=\"found\">")
        .nth(1)
        .and_then(|rest| rest.split("</pre>").next())
        .unwrap_or_else(|| {
            panic!(
                "the script did not end:\n{}",
                String::from_utf8_lossy(&output.stderr)
            )
        });
    let found = found
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&amp;", "&");
    let console = String::from_utf8_lossy(&output.stderr)
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .map(ToString::to_string)
        .collect();
    (serde_json::from_str(&found).unwrap(), console)
}

fn report(folder: &Path, command: &str, session: &Path) -> PathBuf {
    let page = folder.join(format!("{command}.html"));
    let output = abbe(&[command, text(session), "--quiet", "--report", text(&page)]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    page
}

const HELPERS: &str = "
    const frame = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const plot = (kind, column, name) => [...document.querySelectorAll('svg[data-live]')].find((svg) => {
        const live = JSON.parse(svg.dataset.live);
        return live.kind === kind && live.column === column && svg.getAttribute('aria-label').startsWith(name);
    });
    const places = (path) => [...path.getAttribute('d').matchAll(/[ML]([-.0-9]+) ([-.0-9]+)/g)].map((m) => [Number(m[1]), Number(m[2])]);
    const slide = async (id, value) => {
        const input = document.querySelector(`input[data-id=\"${id}\"]`);
        input.value = value;
        input.dispatchEvent(new Event('input'));
        await frame();
    };
    const tick = async (label, on) => {
        const box = [...document.querySelectorAll('.controls label')].find((l) => l.textContent.trim() === label).querySelector('input');
        box.checked = on;
        box.dispatchEvent(new Event('change'));
        await frame();
    };
";

#[test]
fn pages_ask_for_nothing_and_their_sliders_move_the_traces() {
    let name = "pages_ask_for_nothing_and_their_sliders_move_the_traces";
    let Some(browser) = chromium(name) else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = report(
        folder.path(),
        "trace",
        &ready("hermle-c600u/measured/session.toml"),
    );
    let script = format!(
        "{HELPERS}
        const trace = plot('polar', 'deviation', 'C150');
        const live = JSON.parse(trace.dataset.live);
        const path = trace.querySelector('path[data-run=\"0\"]');
        const radius = ([x, y]) => Math.hypot(x - live.x0, y - live.y0);
        const before = places(path);
        await slide('EX0C', 0);
        const without = places(path);
        const moves = before.map((p, i) => (radius(without[i]) - radius(p)) / live.px * live.um);
        const angles = before.map(([x, y]) => Math.atan2(live.y0 - y, x - live.x0) * 180 / Math.PI);
        await slide('EX0C', 50);
        const half = places(path).map((p, i) => (radius(p) - radius(before[i])) / live.px * live.um);
        [...document.querySelectorAll('.controls button')].find((b) => b.textContent === 'none').click();
        await frame();
        const left = places(path).map((p) => Math.abs(radius(p) - live.r) / live.px * live.um);
        await tick('magnify what is left', true);
        const division = trace.querySelector('.division').textContent;
        await tick('backward', false);
        const shown = [...trace.querySelectorAll('path[data-run]')].filter((p) => p.style.display !== 'none').length;
        await tick('C100', false);
        const hidden = plot('polar', 'deviation', 'C100').closest('figure').hidden;
        const over = [...document.querySelectorAll('path.bars')].filter((p) => p.style.display === 'none').map((p) => p.classList[p.classList.length - 2]);
        const at = new DOMPoint(...places(path)[10]).matrixTransform(trace.getScreenCTM());
        trace.dispatchEvent(new PointerEvent('pointermove', {{ clientX: at.x, clientY: at.y }}));
        const tip = document.getElementById('tip').hidden ? '' : document.getElementById('tip').textContent;
        const bytes = Uint8Array.from(atob(document.getElementById('table').textContent), (c) => c.charCodeAt(0));
        const csv = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'))).text();
        return {{ angles, moves, half, left: Math.max(...left), division, shown, hidden, over, tip, rows: csv.trim().split('\\n').length,
            requests: performance.getEntriesByType('resource').length, wide: document.documentElement.scrollWidth }};"
    );
    let (found, console) = run(browser, &page, &script);
    assert_eq!(console, Vec::<String>::new());
    assert_eq!(found["fault"], Value::Null, "{found}");
    assert_eq!(found["requests"], 0);
    // C turns the ball at (0, R, 0) by C; the spindle ball stands at (0, 0, D): to first order ∂L/∂EX0C = −R·sin C/L₀. The error was −36.29 µm, and
    // without it the readings differ by its share, less.
    let numbers = |key: &str| -> Vec<f64> {
        found[key]
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap())
            .collect()
    };
    let (angles, moves, half) = (numbers("angles"), numbers("moves"), numbers("half"));
    assert!(moves.len() > 100);
    for ((angle, moved), half) in angles.iter().zip(&moves).zip(&half) {
        let wanted = -36.29 * 100.0 / 150.0 * angle.to_radians().sin();
        // Places are written to a tenth of a pixel, 0.12 µm here.
        assert!((moved - wanted).abs() < 0.3, "at {angle}°: {moved} {wanted}");
        assert!((half - wanted / 2.0).abs() < 0.3, "at {angle}°: {half} {wanted}");
    }
    // Without everything only the residual is left, which the fit says is noise of 0.3 µm.
    let left = found["left"].as_f64().unwrap();
    assert!(left < 1.6, "{left}");
    let division: f64 = found["division"].as_str().unwrap().parse().unwrap();
    assert!(division <= 0.5, "{division}");
    assert_eq!(found["shown"], 2);
    assert_eq!(found["hidden"], true);
    // C100 is the third test; it leaves the plot over time, before and after.
    assert_eq!(found["over"], serde_json::json!(["of-test-2", "of-test-2"]));
    let tip = found["tip"].as_str().unwrap();
    assert!(
        tip.starts_with("C150, run ") && tip.contains("deviation") && tip.contains("line "),
        "{tip}"
    );
    // A header and every reading, none thinned.
    assert_eq!(found["rows"], 2417);
    assert!(
        found["wide"].as_f64().unwrap() <= 1280.0,
        "the page scrolls sideways"
    );
}

#[test]
fn reports_of_plan_and_fit_say_nothing_on_the_console() {
    let Some(browser) = chromium("reports_of_plan_and_fit_say_nothing_on_the_console") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    with_markup_in_names(folder.path());
    let plan = report(folder.path(), "plan", &ready("hermle-c600u/chapter5.toml"));
    // Names that hold markup are text in the browser too: no element, no script came of them.
    let fit = report(folder.path(), "fit", &folder.path().join("session.toml"));
    let script = "return { requests: performance.getEntriesByType('resource').length, hit: window.hit || 0, \
                  images: document.images.length, title: document.title, labels: [...document.querySelectorAll('.controls label')].map((l) => l.textContent) };";
    for page in [plan, fit] {
        let (found, console) = run(browser, &page, script);
        assert_eq!(console, Vec::<String>::new());
        assert_eq!(
            (&found["requests"], &found["hit"], &found["images"]),
            (&0.into(), &0.into(), &0.into())
        );
        if page.ends_with("fit.html") {
            assert_eq!(found["title"], "Fit of <script>window.hit = 1</script>");
            let label = " C150</script><img src=x onerror=\"window.hit=2\">&amp;";
            assert!(
                found["labels"].as_array().unwrap().iter().any(|l| l == label),
                "{found}"
            );
        }
    }
}
