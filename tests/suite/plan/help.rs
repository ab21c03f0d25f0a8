//! Helpers for the tests of plans: sessions from text.

use abbe::files::{ReadOptions, session as read};
use abbe::identify::linear::Linearisation;
use abbe::identify::noise::{Noise, NoiseSource};
use abbe::model::session::Session;
use abbe::plan::states;

/// The `[machine]` table of a structural code with the axis directions of ISO 841 and, if stated, the travel of rotary
/// axes.
pub fn machine(code: &str, travel_deg: Option<[i32; 2]>) -> String {
    let mut text = format!("[machine]\nname = \"{code}\"\nchain = \"{code}\"\n");
    for letter in code.chars().filter(char::is_ascii_uppercase) {
        let direction = match letter {
            'A' | 'X' => [1, 0, 0],
            'B' | 'Y' => [0, 1, 0],
            _ => [0, 0, 1],
        };
        text.push_str(&format!("[machine.axis.{letter}]\ndirection = {direction:?}\n"));
        if let (Some(travel), 'A' | 'B' | 'C') = (travel_deg, letter) {
            text.push_str(&format!("travel_deg = {travel:?}\n"));
        }
    }
    text
}

/// A session from the text of its file.
pub fn session(text: &str) -> Session {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("session.toml");
    std::fs::write(&file, text).unwrap();
    read(&file, &ReadOptions::default()).unwrap_or_else(|fault| panic!("{fault}\n{text}"))
}

/// A ready session of the workspace.
pub fn ready(name: &str) -> Session {
    read(&crate::suite::ready(name), &ReadOptions::default()).unwrap()
}

/// White noise, µm.
pub fn noise_um(um: f64) -> Noise {
    Noise::white(um * 1e-3, NoiseSource::Stated)
}

/// The linearisation of a plan, with the names of its parameters.
pub fn linearised(session: &Session) -> (Vec<String>, Linearisation) {
    let complete = states::complete(session, true).unwrap();
    let problem = states::problem_by_test(&complete, noise_um(session.noise_mm.unwrap_or(3e-4) * 1e3)).unwrap();
    let list = &problem.parameters.list;
    let linear = Linearisation::of(&problem, &vec![0.0; list.len()]).unwrap();
    (list.iter().map(|parameter| parameter.id.to_string()).collect(), linear)
}
