//! Names: of the files that are written, of the keys that are set.

use abbe::files::{self, ReadOptions};

use super::{abbe, difference, foreign, import, message, text};

#[test]
fn no_file_is_replaced_unless_it_is_forced() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("plan");
    std::fs::create_dir_all(&folder).unwrap();
    let other = folder.join("gaps-normalised.csv");
    std::fs::write(&other, "readings of another day\n").unwrap();
    let (output, session) = import(&folder, &foreign("gaps.csv"), Some("plan-hermle.toml"), &[]);
    assert!(!output.status.success());
    let said = message(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("gaps-normalised.csv: a file with this name exists") && said.contains("--force"), "{said}");
    assert_eq!(std::fs::read_to_string(&other).unwrap(), "readings of another day\n");
    let plan = std::fs::read_to_string(foreign("plan-hermle.toml")).unwrap();
    assert_eq!(std::fs::read_to_string(&session).unwrap(), plan, "the session is as it was");
    let (output, session) = import(&folder, &foreign("gaps.csv"), Some("plan-hermle.toml"), &["--force"]);
    assert!(output.status.success(), "{}", message(&output));
    let read = files::session(&session, &ReadOptions::default()).unwrap();
    assert_eq!(difference(&read, "gaps.csv"), None);
}

#[test]
fn files_of_one_name_lie_beside_each_other() {
    let place = tempfile::tempdir().unwrap();
    // One file that is read as it is, under the name of the copy of the other.
    let named = place.path().join("spaces-normalised.csv");
    std::fs::copy(foreign("inch.csv"), &named).unwrap();
    let machine = super::ready("ur10/machine.toml");
    let out = place.path().join("out");
    let own = foreign("spaces.dat");
    let output = abbe(&["import", text(&own), text(&named), "--machine", text(&machine), "--out", text(&out)]);
    assert!(output.status.success(), "{}", message(&output));
    let read = files::session(&out.join("session.toml"), &ReadOptions::default()).unwrap();
    assert_eq!(difference(&read, "spaces.dat"), None);
    assert_eq!(read.tests.len(), 2);

    // The second import of one name, after the test of the first has another.
    let (output, session) = import(&place.path().join("twice"), &foreign("ros.csv"), None, &[]);
    assert!(output.status.success(), "{}", message(&output));
    let first = std::fs::read_to_string(&session).unwrap();
    std::fs::write(&session, first.replace("name = \"ros\"", "name = \"monday\"")).unwrap();
    let second = place.path().join("ros.csv");
    let text_of = std::fs::read_to_string(foreign("ros.csv")).unwrap();
    let without_last = text_of.trim_end().rsplit_once('\n').unwrap().0;
    std::fs::write(&second, without_last).unwrap();
    let output = abbe(&["import", text(&second), "--session", text(&session)]);
    assert!(output.status.success(), "{}", message(&output));
    let read = files::session(&session, &ReadOptions::default()).unwrap();
    let rows: Vec<usize> = read.tests.iter().map(|test| test.readings.as_ref().unwrap().rows()).collect();
    assert_eq!(rows, [60, 59]);
}

#[test]
fn keys_that_follow_from_the_file_are_refused() {
    let place = tempfile::tempdir().unwrap();
    for (key, expected) in [
        ("name=\"other\"", "rename the file"),
        ("data=\"other.csv\"", "the data of the test are the file"),
        ("format={ separator = \";\" }", "separator, decimal sign and lines above are found"),
        ("columns={ c_deg = 3 }", "say what a column holds"),
    ] {
        let (output, session) = import(&place.path().join("new"), &foreign("ros.csv"), None, &["--set", key]);
        let said = message(&output).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(!output.status.success() && !session.exists(), "{key}");
        assert!(said.contains("is no key that a new test can be given") && said.contains(expected), "{key}: {said}");
    }
    for more in [["--set", "bar_mm=100"], ["--like", "gaps"]] {
        let (output, _) =
            import(&place.path().join(more[0]), &foreign("kugelstab.csv"), Some("plan-hermle.toml"), &more);
        let said = message(&output).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(!output.status.success() && said.contains("test \"kugelstab\" is planned in the session"), "{said}");
    }
}
