//! Reports in a browser: no console messages, no requests, sliders that agree with the closed form, and a layout
//! without overflow.
//!
//! A script is added to a copy of the page. Chromium runs it and prints the document. Without Chromium the tests are
//! skipped.

use std::path::{Path, PathBuf};
use std::process::Command;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

use crate::suite::report::pages::with_markup_in_names;
use crate::suite::{abbe, ready, text};

/// Opens a page of this width (px) with a script added to it. Returns the value of the script and the messages on the
/// console.
fn run(browser: &Path, page: &Path, width: u32, script: &str) -> (Value, Vec<String>) {
    let profile = tempfile::tempdir().unwrap();
    let copy = profile.path().join("page.html");
    let html = std::fs::read_to_string(page).unwrap();
    let added = format!(
        "<script>addEventListener('load', async () => {{ let found; try {{ found = await (async () => {{ {script} }})(); }} \
         catch (error) {{ found = {{ fault: String(error) }}; }} \
         const element = document.createElement('pre'); element.id = 'found'; element.textContent = JSON.stringify(found); document.body.append(element); }});</script></body>"
    );
    // Virtual time ends the test as soon as the page is idle. It draws no frames, so that a timer replaces them.
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
            "--virtual-time-budget=8000",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", profile.path().join("profile").display()))
        .arg(format!("--window-size={width},900"))
        .arg(format!("file://{}", copy.display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    let found = dom
        .split("<pre id=\"found\">")
        .nth(1)
        .and_then(|rest| rest.split("</pre>").next())
        .unwrap_or_else(|| panic!("the script did not end:\n{}", String::from_utf8_lossy(&output.stderr)));
    let found = found.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
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
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    page
}

const HELPERS: &str = "
    const frame = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const plot = (kind, column, name) => [...document.querySelectorAll('svg[data-interaction]')].find((svg) => {
        const settings = JSON.parse(svg.dataset.interaction);
        return settings.kind === kind && settings.column === column && svg.getAttribute('aria-label').startsWith(name);
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
fn pages_request_nothing_and_sliders_agree_with_the_closed_form() {
    let name = "pages_request_nothing_and_sliders_agree_with_the_closed_form";
    let Some(browser) = test_needs::browser(name) else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = report(folder.path(), "trace", &ready("hermle-c600u/measured/session.toml"));
    let script = format!(
        "{HELPERS}
        const trace = plot('polar', 'deviation', 'C150');
        const settings = JSON.parse(trace.dataset.interaction);
        const path = trace.querySelector('path[data-run=\"0\"]');
        const radius = ([x, y]) => Math.hypot(x - settings.x0, y - settings.y0);
        const before = places(path);
        await slide('EX0C', 0);
        const without = places(path);
        const moves = before.map((p, i) => (radius(without[i]) - radius(p)) / settings.px * settings.um);
        const angles = before.map(([x, y]) => Math.atan2(settings.y0 - y, x - settings.x0) * 180 / Math.PI);
        await slide('EX0C', 50);
        const half = places(path).map((p, i) => (radius(p) - radius(before[i])) / settings.px * settings.um);
        [...document.querySelectorAll('.controls button')].find((b) => b.textContent === 'none').click();
        await frame();
        const left = places(path).map((p) => Math.abs(radius(p) - settings.r) / settings.px * settings.um);
        await tick('magnify the remainder', true);
        const division = trace.querySelector('.division').textContent;
        await tick('backward', false);
        const shown = [...trace.querySelectorAll('path[data-run]')].filter((p) => p.style.display !== 'none').length;
        await tick('C100', false);
        const hidden = plot('polar', 'deviation', 'C100').closest('figure').hidden;
        const over = [...document.querySelectorAll('path.bars')].filter((p) => p.style.display === 'none').map((p) => p.classList[p.classList.length - 2]);
        const at = new DOMPoint(...places(path)[10]).matrixTransform(trace.getScreenCTM());
        trace.dispatchEvent(new PointerEvent('pointermove', {{ clientX: at.x, clientY: at.y }}));
        const tip = document.getElementById('tip').hidden ? '' : document.getElementById('tip').textContent;
        const bytes = Uint8Array.from(atob(document.getElementById('csv').textContent), (c) => c.charCodeAt(0));
        const csv = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'))).text();
        return {{ angles, moves, half, left: Math.max(...left), division, shown, hidden, over, tip, rows: csv.trim().split('\\n').length,
            requests: performance.getEntriesByType('resource').length, wide: document.documentElement.scrollWidth }};"
    );
    let (found, console) = run(&browser, &page, 1280, &script);
    assert_eq!(console, Vec::<String>::new());
    assert_eq!(found["fault"], Value::Null, "{found}");
    assert_eq!(found["requests"], 0);
    // C rotates the ball at (0, R, 0); the spindle ball is at (0, 0, D). To first order ∂L/∂EX0C = −R·sin C/L₀. The
    // error is −36.29 µm, and its removal subtracts this share.
    let numbers =
        |key: &str| -> Vec<f64> { found[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect() };
    let (angles, moves, half) = (numbers("angles"), numbers("moves"), numbers("half"));
    assert!(moves.len() > 100);
    for ((angle, moved), half) in angles.iter().zip(&moves).zip(&half) {
        let wanted = -36.29 * 100.0 / 150.0 * angle.to_radians().sin();
        // Coordinates have a resolution of a tenth of a pixel, 0.14 µm here.
        assert!((moved - wanted).abs() < 0.3, "at {angle}°: {moved} {wanted}");
        assert!((half - wanted / 2.0).abs() < 0.3, "at {angle}°: {half} {wanted}");
    }
    // Without all shares the residual remains: noise of 0.3 µm.
    let left = found["left"].as_f64().unwrap();
    assert!(left < 1.6, "{left}");
    // "0.5 µm per division; angle of C"
    let division: f64 = found["division"].as_str().unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(division <= 0.5, "{division}");
    assert_eq!(found["shown"], 2);
    assert_eq!(found["hidden"], true);
    // C100 is the third test. Its series before and after are hidden in the plot over time.
    assert_eq!(found["over"], serde_json::json!(["of-test-2", "of-test-2"]));
    let tip = found["tip"].as_str().unwrap();
    assert!(tip.starts_with("C150, run ") && tip.contains("deviation") && tip.contains("line "), "{tip}");
    // A header and all readings, not decimated.
    assert_eq!(found["rows"], 2417);
    assert!(found["wide"].as_f64().unwrap() <= 1280.0, "the page scrolls sideways");
}

#[test]
fn reports_of_plan_and_fit_write_nothing_to_the_console() {
    let Some(browser) = test_needs::browser("reports_of_plan_and_fit_write_nothing_to_the_console") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    with_markup_in_names(folder.path());
    let plan = report(folder.path(), "plan", &ready("hermle-c600u/chapter5.toml"));
    // Markup in names stays text in the browser.
    let fit = report(folder.path(), "fit", &folder.path().join("session.toml"));
    let script = "return { requests: performance.getEntriesByType('resource').length, hit: window.hit || 0, \
                  images: document.images.length, title: document.title, labels: [...document.querySelectorAll('.controls label')].map((l) => l.textContent) };";
    for page in [plan, fit] {
        let (found, console) = run(&browser, &page, 1280, script);
        assert_eq!(console, Vec::<String>::new());
        assert_eq!((&found["requests"], &found["hit"], &found["images"]), (&0.into(), &0.into(), &0.into()));
        if page.ends_with("fit.html") {
            assert_eq!(found["title"], "Fit of <script>window.hit = 1</script>");
            let label = " C150</script><img src=x onerror=\"window.hit=2\">&amp;";
            assert!(found["labels"].as_array().unwrap().iter().any(|l| l == label), "{found}");
        }
    }
}

/// A page that shows another page in a frame. Chromium has no windows narrower than 500 px.
fn framed(folder: &Path, page: &Path) -> PathBuf {
    let source = STANDARD.encode(std::fs::read(page).unwrap());
    let frame = folder.join("frame.html");
    let html =
        format!("<html><head></head><body><script type='text/plain' id='source'>{source}</script></body></html>");
    std::fs::write(&frame, html).unwrap();
    frame
}

/// Opens all folded parts, then lists what exceeds its container: the page, elements outside scroll boxes, and text
/// outside its plot.
const OVERFLOW: &str = "
    const bytes = Uint8Array.from(atob(document.getElementById('source').textContent), (c) => c.charCodeAt(0));
    const frame = document.createElement('iframe');
    Object.assign(frame.style, { width: `${width}px`, height: '900px', border: 0 });
    frame.srcdoc = new TextDecoder().decode(bytes);
    document.body.append(frame);
    await new Promise((loaded) => { frame.onload = loaded; });
    const page = frame.contentDocument, inner = frame.contentWindow.innerWidth;
    page.querySelectorAll('details').forEach((part) => { part.open = true; });
    const outside = [...page.querySelectorAll('body *')].filter((element) => {
        if (element.closest('svg') && element.tagName !== 'svg') return false;
        if (element.parentElement.closest('.scroll')) return false;
        const box = element.getBoundingClientRect();
        return box.width && (box.right > inner + 1 || box.left < -1);
    });
    const texts = [...page.querySelectorAll('svg.plot text')];
    const cut = texts.filter((text) => {
        const [box, frame] = [text.getBoundingClientRect(), text.closest('svg').getBoundingClientRect()];
        return box.width && (box.left < frame.left - 1 || box.right > frame.right + 1 || box.bottom > frame.bottom + 1);
    });
    const name = (element) => `${element.tagName}.${element.getAttribute('class')}: ${element.textContent.slice(0, 40)}`;
    return { inner, width: page.documentElement.scrollWidth, texts: texts.length, outside: outside.map(name), cut: cut.map(name) };";

#[test]
fn nothing_is_cut_on_narrow_and_wide_pages() {
    let Some(browser) = test_needs::browser("nothing_is_cut_on_narrow_and_wide_pages") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let measured = ready("hermle-c600u/measured/session.toml");
    let pages = [
        report(folder.path(), "trace", &measured),
        report(folder.path(), "fit", &measured),
        report(folder.path(), "plan", &ready("hermle-c600u/chapter5.toml")),
    ];
    for page in &pages {
        let frame = framed(folder.path(), page);
        for width in [400, 1280, 1800] {
            let script = format!("const width = {width}; {OVERFLOW}");
            let (found, _) = run(&browser, &frame, 1900, &script);
            let name = format!("{} at {width} px", page.display());
            assert_eq!(found["inner"], width, "{name}: {found}");
            assert!(found["texts"].as_u64().unwrap() > 100, "{name}: {found}");
            assert!(found["width"].as_u64().unwrap() <= width, "{name}: {found}");
            assert_eq!(found["outside"], serde_json::json!([]), "{name}");
            assert_eq!(found["cut"], serde_json::json!([]), "{name}");
        }
    }
}

#[test]
fn a_trace_shows_its_values_within_1500_px_and_folds_unaffected_tests() {
    let Some(browser) = test_needs::browser("a_trace_shows_its_values_within_1500_px_and_folds_unaffected_tests")
    else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let page = report(folder.path(), "trace", &ready("hermle-c600u/measured/session.toml"));
    let script = "
        const table = document.querySelector('#values table');
        const isFolded = (test) => Boolean(document.querySelector(`#residuals svg[aria-label^=\"${test}\"]`).closest('details:not([open])'));
        const tops = [...document.querySelectorAll('#residuals svg[aria-label^=\"C150\"]')].map((svg) => svg.getBoundingClientRect().top);
        const effect = document.querySelector('#effects-and-competing-explanations .halves');
        const [words, figures] = [...effect.children].map((part) => part.getBoundingClientRect());
        return { bottom: table.getBoundingClientRect().bottom + scrollY, rows: table.rows.length,
            folded: ['A100', 'A150', 'C100', 'C150'].map(isFolded), beside: tops[0] === tops[1],
            alternatives: effect.querySelectorAll('table')[1].querySelectorAll('tbody tr').length,
            right: figures.left >= words.right && figures.top === words.top };";
    let (found, _) = run(&browser, &page, 1280, script);
    // 8 errors, amplitude and phase of the found effect, and the header.
    assert_eq!(found["rows"], 11, "{found}");
    assert!(found["bottom"].as_f64().unwrap() <= 1500.0, "{found}");
    // The simulator changed the axial motion of C only, which C150 alone measures.
    assert_eq!(found["folded"], serde_json::json!([true, true, true, false]), "{found}");
    assert_eq!(found["beside"], true, "{found}");
    // The selected effect and its 6 alternatives, with their evidence beside them.
    assert_eq!(found["alternatives"], 7, "{found}");
    assert_eq!(found["right"], true, "{found}");
}
