//! Words in the names of columns: of axes, of readings, of directions.

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;

/// The words of a name, in lower case: letters and digits apart, umlauts as their letters.
pub(super) fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut last: Option<char> = None;
    for c in name.chars() {
        let starts = match last {
            Some(before) => before.is_ascii_digit() != c.is_ascii_digit() || before.is_lowercase() && c.is_uppercase(),
            None => true,
        };
        if c.is_alphanumeric() {
            if starts {
                words.push(String::new());
            }
            if let Some(word) = words.last_mut() {
                for low in c.to_lowercase() {
                    match low {
                        'ä' | 'à' | 'â' => word.push('a'),
                        'ö' | 'ô' => word.push('o'),
                        'ü' | 'û' => word.push('u'),
                        'é' | 'è' | 'ê' => word.push('e'),
                        'ß' => word.push_str("ss"),
                        'δ' => word.push_str("delta"),
                        'θ' => word.push_str("theta"),
                        'φ' => word.push_str("phi"),
                        low => word.push(low),
                    }
                }
            }
            last = Some(c);
        } else {
            last = None;
        }
    }
    words
}

/// Whether a list of words holds one.
fn holds(list: &str, word: &str) -> bool {
    list.split(' ').any(|own| own == word)
}

/// What programs say of the position of an axis, besides its name.
const OF_AXIS: &str = "axis achse axe pos position angle winkel joint gelenk theta actual act ist istwert cmd command commanded \
    soll sollwert set setpoint nominal nom encoder value wert rotary machine maschine programmed prog target ref \
    nc mcs drehwinkel lage";
/// Words before the number of a joint.
const NUMBERED: &str = "joint gelenk axis achse q j a theta axe";
/// The joints of a six-axis arm in the words of ROS, in their order.
const ROS: [&[&str]; 6] =
    [&["shoulder", "pan"], &["shoulder", "lift"], &["elbow"], &["wrist", "1"], &["wrist", "2"], &["wrist", "3"]];

/// What a name says of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AxisWord {
    /// The axis, by index.
    Axis(usize),
    /// The number of a joint, from 0 or from 1.
    Number(usize),
    /// An axis without its name.
    Unnamed,
}

/// Words without what programs say of the position of an axis.
fn bare(words: &[String]) -> Vec<&str> {
    words.iter().map(String::as_str).filter(|word| !holds(OF_AXIS, word)).collect()
}

/// The axis of a name.
pub(super) fn axis(words: &[String], machine: &Machine) -> Option<AxisWord> {
    let only = |is: &dyn Fn(&Axis) -> bool| {
        let mut found = (0..machine.axes.len()).filter(|k| is(&machine.axes[*k]));
        found.next().filter(|_| found.next().is_none())
    };
    let rest = bare(words);
    for joined in [words.concat(), rest.concat()] {
        if let Some(axis) = only(&|axis| axis.name.to_lowercase() == joined) {
            return Some(AxisWord::Axis(axis));
        }
    }
    // The name that the robot's own file gives the joint, with or without what programs say besides.
    let joint = |axis: &Axis| axis.joint.as_deref().map(self::words).filter(|joint| !joint.is_empty());
    let has_letters = rest.iter().any(|word| !word.chars().all(|c| c.is_ascii_digit()));
    if let Some(axis) = only(&|axis| joint(axis).is_some_and(|joint| joint == words))
        .or_else(|| only(&|axis| has_letters && joint(axis).is_some_and(|joint| bare(&joint) == rest)))
    {
        return Some(AxisWord::Axis(axis));
    }
    let rotary = machine.axes.iter().filter(|axis| axis.kind == AxisKind::Rotary).count();
    if rotary == ROS.len()
        && let Some(joint) = ROS.iter().position(|joint| rest == **joint)
    {
        let axes = (0..machine.axes.len()).filter(|k| machine.axes[*k].kind == AxisKind::Rotary);
        return axes.clone().nth(joint).map(AxisWord::Axis);
    }
    let is_joint = words.iter().any(|word| holds(NUMBERED, word));
    let numbers: Vec<&str> = rest.iter().copied().filter(|word| !holds(NUMBERED, word)).collect();
    match numbers[..] {
        [number] if is_joint => number.parse().ok().map(AxisWord::Number),
        [] if !words.is_empty() && rest.is_empty() => Some(AxisWord::Unnamed),
        _ => None,
    }
}

/// The direction of a traversal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Direction {
    Forward,
    Backward,
}

const FORWARD: &str = "forward forwards fwd vor vorwarts vorwaerts hin hinweg cw clockwise plus positive aller";
const BACKWARD: &str = "backward backwards bwd back ruck rueck zuruck zurueck ruckwarts rueckwarts ruckweg return reverse rev ccw \
    anticlockwise counterclockwise minus retour";

/// The direction of a name, and its words without it.
pub(super) fn direction(name: &str, words: &[String]) -> (Option<Direction>, Vec<String>) {
    let of = |word: &str| match word {
        word if holds(FORWARD, word) => Some(Direction::Forward),
        word if holds(BACKWARD, word) => Some(Direction::Backward),
        _ => None,
    };
    let rest: Vec<String> = words.iter().filter(|word| of(word).is_none()).cloned().collect();
    let sign = match name.trim_end_matches([')', ']', ' ']).chars().last() {
        Some('+' | '→' | '↑') => Some(Direction::Forward),
        Some('-' | '←' | '↓' | '−') => Some(Direction::Backward),
        _ => None,
    };
    (words.iter().find_map(|word| of(word)).or(sign), rest)
}

/// The words of a reading of an instrument, by the name of our column without its unit.
const READINGS: [(&str, &str); 23] = [
    ("length", "lange laenge l dbb bar ballbar messwert reading barlength stablange radius"),
    ("deviation", "abweichung dev delta dl deltal error fehler messabweichung ecart abw radialerror"),
    ("distance", "abstand distanz d entfernung range"),
    ("range", "distance dist entfernung strecke slope slopedistance d r"),
    ("azimuth", "az hz azimut horizontal horizontalangle horizontalwinkel"),
    ("elevation", "el elev vertical verticalangle hohenwinkel"),
    ("px", "x"),
    ("py", "y"),
    ("pz", "z"),
    ("dx", "deltax ex x devx abwx"),
    ("dy", "deltay ey y devy abwy"),
    ("dz", "deltaz ez z devz abwz"),
    ("du", "u sensor1 probe1 taster1"),
    ("dv", "v sensor2 probe2 taster2"),
    ("dw", "w sensor3 probe3 taster3"),
    ("displacement", "laser weg verschiebung laserposition"),
    ("horizontal", "horizontalstraightness straightnessh geradheith h"),
    ("vertical", "verticalstraightness straightnessv geradheitv v"),
    ("pitch", "nick nicken nickwinkel"),
    ("yaw", "gier gieren gierwinkel"),
    ("roll", "roll rollen rollwinkel"),
    ("angle", "winkel reading deviation abweichung messwert autocollimator"),
    ("socket", "nest cup aufnahme pfanne"),
];

/// What programs say of what an instrument measured.
const MEASURED: &str = "meas measured measurement mess messung gemessen tracker laser smr lt reflector reflektor";
/// What programs say of a reading besides.
const OF_READING: &str = "target point value wert pos position coordinate koordinate coord actual act ist mean p";

/// The words of our column of readings in other programs.
fn others_of(stem: &str) -> &'static str {
    READINGS.iter().find(|(own, _)| *own == stem).map_or("", |(_, others)| others)
}

/// Whether words say that an instrument measured.
pub(super) fn is_measured(words: &[String]) -> bool {
    words.iter().any(|word| holds(MEASURED, word))
}

/// The words of our column of readings, without its unit; ours is the first.
pub(super) fn of_reading(stem: &'static str) -> impl Iterator<Item = &'static str> {
    std::iter::once(stem).chain(others_of(stem).split(' ').filter(|word| !word.is_empty()))
}

/// Whether words name our column of readings, without its unit.
pub(super) fn is_reading(words: &[String], stem: &str) -> bool {
    let others = others_of(stem);
    let is = |joined: &str| joined == stem.replace('_', "") || holds(others, joined);
    let without = |left_out: &[&str]| {
        words
            .iter()
            .map(String::as_str)
            .filter(|word| !left_out.iter().any(|list| holds(list, word)))
            .collect::<String>()
    };
    is(&words.concat()) || is(&without(&[MEASURED])) || is(&without(&[MEASURED, OF_READING]))
}

/// Words of other columns.
pub(super) fn is_one_of(words: &[String], known: &str) -> bool {
    holds(known, &words.concat()) || words.first().is_some_and(|word| holds(known, word))
}

pub(super) const TIME: &str = "time t zeit timestamp temps elapsed";
pub(super) const RUN: &str = "run lauf pass cycle zyklus traversal";
pub(super) const TEMPERATURE: &str = "temp temperature temperatur tair ambient";
pub(super) const POLAR: &str = "polar polarangle polarwinkel phi bahnwinkel kreiswinkel angle winkel circleangle";
pub(super) const ZENITH: &str = "zenith zenit zenitwinkel zd vz";

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str) -> Vec<String> {
        words(name)
    }

    #[test]
    fn words_are_split_where_programs_join_them() {
        assert_eq!(of("Länge_vorwärts"), ["lange", "vorwarts"]);
        assert_eq!(of("joint1Position"), ["joint", "1", "position"]);
        assert_eq!(of("J1"), ["j", "1"]);
        assert_eq!(of("ΔL"), ["deltal"]);
    }

    #[test]
    fn an_axis_is_found_by_its_name_or_its_number() {
        let machine = Machine::from_code("[wCAbYXZt]").unwrap();
        let found = |name: &str| axis(&of(name), &machine);
        assert_eq!(found("C"), Some(AxisWord::Axis(0)));
        assert_eq!(found("Achse C Ist"), Some(AxisWord::Axis(0)));
        assert_eq!(found("pos_X"), Some(AxisWord::Axis(3)));
        assert_eq!(found("Joint 3"), Some(AxisWord::Number(3)));
        assert_eq!(found("Winkel"), Some(AxisWord::Unnamed));
        assert_eq!(found("Länge"), None);
    }
}
