//! `abbe sheet`: one page for each test, and what stands on it. The pages are counted in the PDF of a browser.

use std::process::Command;

use super::{abbe, ready, text};

fn page(plan: &str, more: &[&str]) -> String {
    let plan = ready(plan);
    let fixed = ["sheet", text(&plan), "--out", "-"];
    let output = abbe(&fixed.iter().chain(more).copied().collect::<Vec<_>>());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn a_sheet_states_what_the_operator_sets_up() {
    let page = page("hermle-c600u/chapter5.toml", &[]);
    assert_eq!(page.matches("<section class=\"sheet\">").count(), 5);
    for expected in [
        "Test C150",
        "149.9946 mm",
        "with an extension of 50 mm",
        "Workpiece ball: stays as in test",
        "Both balls coincide at",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    let bad = abbe(&["sheet", text(&ready("hermle-c600u/chapter5.toml")), "--out", "-", "--setup-min=-1"]);
    assert_eq!(bad.status.code(), Some(1));
}

/// Robots and other instruments have sheets too.
#[test]
fn every_bundled_plan_has_sheets() {
    for plan in [
        "r-test/plan.toml",
        "tilting-head/session.toml",
        "table-and-head/session.toml",
        "self-calibration/session.toml",
    ] {
        let page = page(plan, &[]);
        assert!(page.matches("<section class=\"sheet\">").count() > 1, "{plan}");
    }
}

#[test]
fn a_test_is_one_printed_page() {
    let Some(browser) = test_needs::browser("a_test_is_one_printed_page") else { return };
    let folder = tempfile::tempdir().unwrap();
    for (plan, tests) in [("hermle-c600u/chapter5.toml", 4), ("r-test/plan.toml", 3)] {
        let [html, pdf] = ["sheets.html", "sheets.pdf"].map(|name| folder.path().join(name));
        let page = page(plan, &[]);
        assert_eq!(page.matches("<section class=\"sheet\">").count(), tests + 1, "{plan}");
        std::fs::write(&html, page).unwrap();
        let run = Command::new(&browser)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--no-pdf-header-footer"])
            .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
            .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
            .arg(format!("--print-to-pdf={}", pdf.display()))
            .arg(format!("file://{}", html.display()))
            .output()
            .unwrap();
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let written = std::fs::read(&pdf).unwrap();
        let text = String::from_utf8_lossy(&written);
        let pages = text.matches("/Type /Page").count() - text.matches("/Type /Pages").count();
        assert_eq!(pages, tests + 1, "{plan}");
    }
}
