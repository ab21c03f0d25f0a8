//! `abbe paper`: the folder compiles without a warning in every class, its numbers are those of the library, and
//! invalid requests are refused.

use std::path::{Path, PathBuf};
use std::process::Command;
use test_needs::data;

use crate::suite::codegen::equation_command::printed;
use crate::suite::{abbe, ready};

/// Classes and columns.
const LAYOUTS: [&[&str]; 4] =
    [&[], &["--class", "ieeetran", "--two-column"], &["--two-column"], &["--class", "ieeetran"]];

/// The three methods of Jiang (2014), measured and planned sessions, every instrument; robots if their data are there.
fn sessions() -> Vec<(PathBuf, Option<PathBuf>)> {
    let names = [
        "hermle-c600u/chapter4.toml",
        "hermle-c600u/chapter5.toml",
        "hermle-c600u/chapter6.toml",
        "hermle-c600u/measured/session.toml",
        "r-test/measured/session.toml",
        "self-calibration/measured/session.toml",
        "laser/session.toml",
        "angle/session.toml",
        "diagonals/session.toml",
        "distance/session.toml",
        "pose/session.toml",
    ];
    let mut sessions: Vec<_> = names.map(|name| (ready(name), None)).to_vec();
    sessions.extend(
        data("papers_typeset_in_latex_without_a_warning", "mukca")
            .map(|folder| (ready("kuka-iiwa14/session.toml"), folder.parent().map(Path::to_path_buf))),
    );
    sessions
}

/// Writes the paper of a session and returns its folder.
fn paper(session: &Path, data: Option<&Path>, layout: &[&str], out: &Path) {
    let mut arguments = vec!["paper", session.to_str().unwrap(), "--out", out.to_str().unwrap()];
    arguments.extend(layout);
    let data = data.map(|folder| folder.to_str().unwrap().to_string());
    arguments.extend(data.iter().flat_map(|folder| ["--data", folder, "--allow-outside"]));
    let output = abbe(&arguments);
    assert!(output.status.success(), "{}: {}", session.display(), String::from_utf8_lossy(&output.stderr));
}

/// Runs pdfLaTeX and BibTeX as the README of the folder says, and returns the complaints of the last log.
fn latex_complaints(folder: &Path) -> Vec<String> {
    let run = |program: &str, arguments: &[&str]| {
        let output = Command::new(program).current_dir(folder).args(arguments).output().unwrap();
        let log = std::fs::read(folder.join("main.log")).unwrap_or_default();
        let log = String::from_utf8_lossy(&log).into_owned();
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{program}: {text}\n{}", &log[log.len().saturating_sub(3000)..]);
    };
    let once = ["-interaction=nonstopmode", "-halt-on-error", "-draftmode", "main"];
    run("pdflatex", &once);
    run("bibtex", &["main"]);
    run("pdflatex", &once);
    run("pdflatex", &once);
    run("pdflatex", &["-interaction=nonstopmode", "-halt-on-error", "main"]);
    let complains = |line: &&str| ["Warning", "Overfull"].iter().any(|word| line.contains(word));
    let logs = ["main.log", "main.blg"].map(|name| std::fs::read(folder.join(name)).unwrap());
    logs.iter()
        .flat_map(|log| String::from_utf8_lossy(log).lines().filter(complains).map(str::to_string).collect::<Vec<_>>())
        .collect()
}

/// `ABBE_ALL_PAPERS=1` typesets every session in every layout; without it each session has one layout.
#[test]
fn papers_typeset_in_latex_without_a_warning() {
    let name = "papers_typeset_in_latex_without_a_warning";
    let found = |file: &&str| test_needs::first(&["kpsewhich"], &[file]).is_some();
    if !["elsarticle.cls", "IEEEtran.cls", "booktabs.sty"].iter().all(found) {
        test_needs::skip(name, "no pdflatex with elsarticle, IEEEtran and booktabs");
        return;
    }
    let all = std::env::var_os("ABBE_ALL_PAPERS").is_some();
    for (number, (session, data)) in sessions().iter().enumerate() {
        for (k, layout) in LAYOUTS.iter().enumerate().filter(|(k, _)| all || *k == number % LAYOUTS.len()) {
            let folder = tempfile::tempdir().unwrap();
            let out = folder.path().join("paper");
            paper(session, data.as_deref(), layout, &out);
            let complaints = latex_complaints(&out);
            assert!(complaints.is_empty(), "{} {layout:?} ({k}): {complaints:#?}", session.display());
        }
    }
}

#[test]
fn papers_typeset_in_typst_without_a_warning() {
    let name = "papers_typeset_in_typst_without_a_warning";
    let Some(python) = test_needs::python(name, "typst") else { return };
    for (session, layout) in [("hermle-c600u/measured/session.toml", LAYOUTS[0]), ("r-test/plan.toml", LAYOUTS[1])] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("paper");
        paper(&ready(session), None, layout, &out);
        let script = "import typst\n_, found = typst.compile_with_warnings('main.typ', root='.', output='main.pdf')\n\
                      for one in found: print(one.message)";
        let output = Command::new(&python).current_dir(&out).args(["-c", script]).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && text.trim().is_empty(), "{session}: {text}");
    }
}

/// The tables have the numbers of the library, the README the command, and every figure its three files.
#[test]
fn the_folder_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("paper");
    let three = ["hermle-c600u/chapter4.toml", "hermle-c600u/chapter5.toml", "hermle-c600u/chapter6.toml"].map(ready);
    let mut arguments: Vec<&str> = vec!["paper"];
    arguments.extend(three.iter().map(|path| path.to_str().unwrap()));
    arguments.extend(["--out", out.to_str().unwrap(), "--effects", "EZC~C:h2"]);
    printed(&arguments);
    let text = |name: &str| std::fs::read_to_string(out.join(name)).unwrap_or_else(|_| panic!("{name}"));
    let readme = text("README.md");
    assert!(readme.contains("paper") && readme.contains("--effects EZC~C:h2") && readme.contains("SHA-256"));
    let comparison = text("tables/comparison-uncertainty.csv");
    assert!(comparison.starts_with("error,unit,chapter4,chapter5,chapter6"), "{comparison}");
    let bias = text("tables/bias.csv");
    assert_eq!(bias.lines().count(), 3, "{bias}");
    for figure in ["machine", "set-up", "correlation", "singular-values", "patterns-A150"] {
        assert!(text(&format!("figures/{figure}.svg")).starts_with("<svg"));
        assert!(std::fs::read(out.join(format!("figures/{figure}.pdf"))).unwrap().starts_with(b"%PDF-1.4"));
        assert!(text(&format!("figures/{figure}.csv")).lines().count() > 1);
    }
    // The pivot of the A tests of chapter 4 is on the A table: EY0C changes the tests of C alone.
    let equations = text("sections/equations.tex");
    let (of_a, of_c) = equations.split_once("\\paragraph{Test C100}").unwrap();
    assert!(of_a.contains("\\label{eq:ldbb-A100}") && !of_a.contains("e_{y0c}"), "{equations}");
    assert!(of_c.contains("e_{y0c}"), "{equations}");
    // Comments of the session, such as tables of a source, are no words of a paper, nor are identifiers.
    assert!(!equations.contains("Table 3.1") && equations.contains("Symbol & Meaning & Unit"), "{equations}");
    assert!(text("sections/equations.typ").contains("e_\"y0c\""));
    let budget = text("tables/budget.csv");
    assert!(budget.contains("spindle ball") && !budget.contains("spindle_ball"), "{budget}");
    for part in [
        "methods",
        "equations",
        "set-up",
        "sensitivity",
        "uncertainty",
        "correlation",
        "identifiability",
        "bias",
        "comparison",
    ] {
        assert!(text("main.tex").contains(&format!("\\input{{sections/{part}}}")), "{part}");
        assert!(text("main.typ").contains(&format!("/sections/{part}.typ")), "{part}");
    }
}

#[test]
fn invalid_requests_are_refused() {
    let plan = ready("hermle-c600u/chapter5.toml");
    let plan = plan.to_str().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("paper");
    let out = out.to_str().unwrap();
    for (arguments, status, part) in [
        (vec!["--parts", "comparison"], 2, "two sessions"),
        (vec!["--parts", "trace"], 1, "no readings"),
        (vec!["--parts", "nothing"], 2, "identifiability"),
        (vec!["--effects", "EZC~C:h0"], 1, "has no effect `EZC~C:h0`"),
        (vec![plan], 1, "named twice"),
    ] {
        let output = abbe(&[vec!["paper", plan, "--out", out], arguments].concat());
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{stderr}");
        assert!(stderr.contains(part), "{stderr}");
        assert!(!Path::new(out).exists());
    }
    let output = abbe(&["plan", plan, "--global", "--samples", "100"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("a power of two"));
}
