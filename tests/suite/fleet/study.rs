//! `abbe fleet study`: power, false claims and coverage of simulated sessions.
#![cfg(unix)]

use serde_json::Value;

use crate::suite::abbe;
use crate::suite::command::faults::TestFolder;
use crate::suite::fleet::run::{files, read};

/// A study of fits: 95 % intervals of simulated sessions contain the true values as often as they should.
#[test]
fn a_study_has_its_nominal_coverage() {
    let place = TestFolder::new();
    let plan = crate::suite::ready("hermle-c600u/chapter4.toml");
    let study = |draws: usize| {
        let file = format!(
            "[study]\nanalysis = \"fit\"\nseed = 20260101120000\ndraws = {draws}\nlocation_um = 20\nlocation_arcsec = 8\n\
             [[plan]]\nname = \"four\"\nsession = {plan:?}\n[[noise]]\nname = \"white\"\num = 0.3\n[[effect]]\nname = \"none\"\n"
        );
        place.put("study.toml", &file);
        let output =
            place.shell("abbe fleet study study.toml --out study --threads 2 --json study.json --csv study.csv");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_str::<Value>(&read(&place.at("study.json"))).unwrap()
    };
    let found = study(60);
    let cell = &found["cells"][0];
    assert_eq!((&cell["draws"], &cell["failed"]), (&60.into(), &0.into()));
    let (rate, of) = (cell["coverage"]["rate"].as_f64().unwrap(), cell["coverage"]["of"].as_f64().unwrap());
    // Eight location errors of a session share its set-up: as many independent intervals as sessions, at worst.
    assert!(of >= 240.0 && (rate - 0.95).abs() < 4.0 * (0.95 * 0.05 / 60.0_f64).sqrt(), "{cell:#}");
    let schema: Value = serde_json::from_slice(&abbe(&["schema", "study"]).stdout).unwrap();
    assert!(jsonschema::is_valid(&schema, &found));
    // Finished draws are kept, byte by byte.
    let draws = files(&place.at("study"));
    assert_eq!(draws.len(), 60);
    study(60);
    assert_eq!(files(&place.at("study")), draws);
}

#[test]
fn a_study_finds_a_large_effect_and_claims_no_other() {
    let place = TestFolder::new();
    // The plan lies beside the study: the draws follow from the bytes of the study, which hold no path of this computer.
    for file in ["chapter4.toml", "machine.toml"] {
        place.put(file, &read(&crate::suite::ready(&format!("hermle-c600u/{file}"))));
    }
    place.put(
        "study.toml",
        "[study]\nanalysis = \"trace\"\ndraws = 3\nlocation_um = 20\n[[plan]]\nname = \"four\"\nsession = \"chapter4.toml\"\n\
         [[noise]]\nname = \"serial\"\num = 0.3\nautocorrelation = 0.5\noutlier_share = 0.01\n\
         [[effect]]\nname = \"axial\"\nsize = 20\n\
         effect = { component = \"EZC\", driver = \"C\", shape = \"harmonic\", order = 2 }\n",
    );
    let output = place.shell("abbe fleet study study.toml --out study --threads 2 --json -");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["effects"][0]["found"]["count"], 3, "{found:#}");
}

#[test]
fn unusable_study_files_are_named() {
    let place = TestFolder::new();
    let file = "[study]\nanalysis = \"fit\"\ndraws = 1\n[[plan]]\nname = \"a\"\nsession = \"session.toml\"\n\
                [[noise]]\nname = \"n\"\num = 0.3\n[[effect]]\nname = \"none\"\n";
    for (from, to, expected) in [
        ("draws = 1", "draws = 0", "study.toml:3: `draws` is 0; a whole number from 1 to 1000000 is expected"),
        ("draws = 1", "draws = 1000001", "`draws` is 1000001; a whole number from 1 to 1000000 is expected"),
        (
            "[[effect]]",
            "[[noise]]\nname = \"m\"\num = 1\n[[effect]]",
            "1 plans × 1 effects × 2 kinds of noise × 600000 draws: at most 1000000 draws",
        ),
        ("draws = 1", "draws = 1\nfoo = 2", "foo"),
        (
            "um = 0.3",
            "um = 0.3\nautocorrelation = 1",
            "study.toml:10: `autocorrelation` is 1; 0 to below 1 is expected",
        ),
        ("name = \"none\"", "name = \"none\"\nsize = 5", "effect `none`"),
        (
            "name = \"none\"",
            "name = \"x\"\nsize = 5\neffect = { component = \"EZQ\", shape = \"constant\" }",
            "study.toml:13: effect on \"EZQ\": the machine \"w X b Y t\" has no axis `Q`",
        ),
        ("session = \"session.toml\"", "session = \"nowhere.toml\"", "nowhere.toml"),
        ("[[noise]]", "[[noise]]\nname = \"n\"\num = 1\n[[noise]]", "two [[noise]] are called `n`"),
        (
            "\"fit\"\ndraws = 1",
            "\"trace\"\ndraws = 1\n[[effect]]\nname = \"x\"\nsize = 5\n\
             effect = { component = \"EYY\", driver = \"Y\", shape = \"polynomial\", order = 2 }",
            "the library of the trace has no effect",
        ),
    ] {
        assert!(file.contains(from));
        // Every number of draws is allowed by itself, and not with two kinds of noise.
        let draws = if to.contains("name = \"m\"") { "draws = 600000" } else { "draws = 1" };
        place.put("study.toml", &file.replacen("draws = 1", draws, 1).replacen(from, to, 1));
        let output = place.shell("abbe fleet study study.toml --out study");
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && message.contains(expected), "{to}: {message}");
    }
}

/// A plan that determines fewer errors is no better, however well it determines the others. An effect that a plan does
/// not observe is not found.
#[test]
fn a_blind_plan_is_the_last() {
    let place = TestFolder::new();
    let whole = read(&crate::suite::ready("hermle-c600u/chapter4.toml"));
    let machine = read(&crate::suite::ready("hermle-c600u/machine.toml"));
    place.put("machine.toml", &machine);
    place.put("whole.toml", &whole);
    let one = whole.split("[[test]]").take(2).collect::<Vec<_>>().join("[[test]]");
    place.put("one.toml", &one);
    let study = "[study]\nanalysis = \"trace\"\ndraws = 2\nlocation_um = 5\n[[plan]]\nname = \"one test\"\n\
                 session = \"one.toml\"\n[[plan]]\nname = \"four tests\"\nsession = \"whole.toml\"\n[[noise]]\n\
                 name = \"white\"\num = 0.3\n[[effect]]\nname = \"drift\"\nsize = 10\n\
                 effect = { component = \"EYA\", driver = \"A\", shape = \"harmonic\", order = 3 }\n";
    place.put("study.toml", study);
    let output = place.shell("abbe fleet study study.toml --out study --threads 2 --json -");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let ranking = found["ranking"].as_array().unwrap();
    let names: Vec<&str> = ranking.iter().map(|cell| cell["plan"].as_str().unwrap()).collect();
    assert_eq!(names, ["four tests", "one test"], "{found:#}");
    assert!(ranking[0]["undetermined"].as_f64() < ranking[1]["undetermined"].as_f64());
    for cell in ranking {
        let rate = |key: &str| cell["found"][key].as_u64().unwrap();
        assert_eq!(rate("of"), 2, "{cell:#}");
        assert!(rate("count") + cell["not_observed"].as_u64().unwrap() <= 2, "{cell:#}");
    }
}
