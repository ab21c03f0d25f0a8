//! URDF (ROS, "XML Robot Description Format", wiki.ros.org/urdf/XML): the chain to one link. Lengths in m, angles in rad.
//!
//! The pose of a joint in the link before it is `origin`: `Trans(xyz)·Rz(yaw)·Ry(pitch)·Rx(roll)`. The joint moves about or
//! along `axis`, which is given in its own frame. Masses, meshes and everything else are not looked at.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::Path;

use abbe_model::axis::AxisKind;
use abbe_model::diagnostic::{Diagnostic, Location};
use abbe_model::unit::Unit;
use abbe_model::words::{first_of, number};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::chain::{Chain, Joint};
use crate::source::Source;
use crate::spelling::suggestion;

/// Largest length in a file, m: a kilometre.
const MAX_M: f64 = 1e3;
/// Limit that says that there is none, rad or m.
const NO_LIMIT: f64 = 1e5;
/// Number of links that a message names.
const NAMED: usize = 20;
/// Links that makers call the end of the arm, the first of them first.
const ENDS: [&str; 7] = ["tool0", "flange", "ee_link", "tcp", "panda_link8", "fr3_link8", "iiwa_link_ee"];

/// The kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Rotary,
    Linear,
    Fixed,
    Other,
}

/// A joint as it stands in the file.
#[derive(Clone, Debug)]
pub struct UrdfJoint {
    /// Its name.
    pub name: String,
    kind: Kind,
    /// The word of its kind.
    word: String,
    parent: String,
    child: String,
    /// Its pose in the link before it, mm.
    pub origin: Isometry3<f64>,
    axis: Vector3<f64>,
    /// Least and greatest position, m or rad; 0 where the file states one only.
    limits: Option<[f64; 2]>,
    mimics: bool,
    /// The bytes of the element `origin` in the text, if there is one.
    pub origin_bytes: Option<Range<usize>>,
    /// The byte behind the start tag of the joint.
    pub after_start: usize,
    line: usize,
}

impl UrdfJoint {
    /// Whether it moves.
    pub fn moves(&self) -> bool {
        matches!(self.kind, Kind::Rotary | Kind::Linear)
    }
}

/// A URDF file.
#[derive(Debug, Default)]
pub struct Urdf {
    name: String,
    links: Vec<String>,
    joints: Vec<UrdfJoint>,
    /// The joint before each link, by the name of the link.
    before: HashMap<String, usize>,
    /// The line and the name of an element of xacro beside links and joints.
    xacro: Option<(usize, String)>,
}

/// Reads a URDF file.
///
/// # Errors
/// If it is no URDF, or its links form no tree, with the line and what to do.
pub fn read(source: &Source) -> Result<Urdf, Diagnostic> {
    let mut urdf = Urdf::default();
    let outcome = urdf.read(source);
    match (&urdf.xacro, outcome) {
        // Links and joints that the program would write are missing.
        (Some((line, _)), outcome) if outcome.is_err() || !urdf.joints.iter().any(UrdfJoint::moves) => {
            Err(Diagnostic::input(
                Location::line(&source.file, *line),
                "this is a xacro file, a program that writes a URDF",
                "write the URDF that it describes: `xacro FILE.xacro > robot.urdf`",
            ))
        }
        (_, outcome) => outcome.map(|()| urdf),
    }
}

impl Urdf {
    /// Reads a file into an empty one.
    fn read(&mut self, source: &Source) -> Result<(), Diagnostic> {
        let text = &source.text;
        // The bytes at which lines end, so that the line of a byte is found by bisection.
        let ends: Vec<usize> =
            text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(place, _)| place).collect();
        let line_of = |byte: usize| 1 + ends.partition_point(|end| *end < byte);
        let fault = |byte: usize, message: String, help: &str| {
            Diagnostic::input(Location::line(&source.file, line_of(byte)), message, help)
        };
        let mut reader = Reader::from_str(text);
        let mut path: Vec<(String, usize)> = Vec::new();
        loop {
            let before = reader.buffer_position() as usize;
            let event = reader
                .read_event()
                .map_err(|cause| fault(before, format!("not valid XML: {cause}"), "check that the file is a URDF"))?;
            let after = reader.buffer_position() as usize;
            let (element, is_empty) = match event {
                Event::Start(element) => (element, false),
                Event::Empty(element) => (element, true),
                Event::End(_) => {
                    path.pop();
                    continue;
                }
                Event::Eof => match path.last() {
                    None => break,
                    Some((open, start)) => {
                        let message =
                            format!("the file ends within <{open}>, which begins on line {}", line_of(*start));
                        return Err(fault(text.len(), message, "the file is cut off: get it whole"));
                    }
                },
                _ => continue,
            };
            let name = element.name().as_ref().to_string();
            let whole = |message: String| fault(before, message, "correct the file");
            let text_of = |key: &str| attribute(&element, key);
            // What lies deeper is not looked at.
            let above: Vec<&str> = path.iter().take(3).map(|(name, _)| name.as_str()).collect();
            match (above.as_slice(), name.as_str()) {
                ([], "robot") => self.name = text_of("name").map_err(whole)?.unwrap_or_default(),
                ([], _) => {
                    return Err(fault(
                        before,
                        format!("the first element is <{name}>, not <robot>"),
                        "name a URDF file",
                    ));
                }
                (["robot"], _) if name.starts_with("xacro:") => {
                    self.xacro.get_or_insert((line_of(before), name.clone()));
                }
                (["robot"], "link") => self.links.extend(text_of("name").map_err(whole)?),
                (["robot"], "joint") => {
                    let word = text_of("type").map_err(whole)?.unwrap_or_default();
                    let kind = match word.as_str() {
                        "revolute" | "continuous" => Kind::Rotary,
                        "prismatic" => Kind::Linear,
                        "fixed" => Kind::Fixed,
                        _ => Kind::Other,
                    };
                    self.joints.push(UrdfJoint {
                        name: text_of("name").map_err(whole)?.unwrap_or_default(),
                        kind,
                        word,
                        parent: String::new(),
                        child: String::new(),
                        origin: Isometry3::identity(),
                        axis: Vector3::x(),
                        limits: None,
                        mimics: false,
                        origin_bytes: None,
                        after_start: after,
                        line: line_of(before),
                    });
                }
                (["robot", "joint"], _) => {
                    if let Some(joint) = self.joints.last_mut() {
                        part_of_joint(joint, &name, &text_of, before..after).map_err(whole)?;
                    }
                }
                _ => {}
            }
            if !is_empty {
                path.push((name, before));
            }
        }
        if self.name.is_empty() && self.joints.is_empty() {
            return Err(fault(0, "no element <robot>".into(), "name a URDF file"));
        }
        self.connect()
            .map_err(|(line, message, help)| Diagnostic::input(Location::line(&source.file, line), message, help))
    }
}

/// An element of a joint; the error is a message.
fn part_of_joint(
    joint: &mut UrdfJoint,
    name: &str,
    text_of: &dyn Fn(&str) -> Result<Option<String>, String>,
    bytes: Range<usize>,
) -> Result<(), String> {
    let numbers = |key: &str, absent: [f64; 3]| text_of(key)?.as_deref().map_or(Ok(absent), three);
    let place = |found: [f64; 3]| match found.into_iter().find(|length| length.abs() > MAX_M) {
        Some(length) => Err(format!("{} m is no length of a robot", number(length))),
        None => Ok(found),
    };
    match name {
        "parent" => joint.parent = text_of("link")?.unwrap_or_default(),
        "child" => joint.child = text_of("link")?.unwrap_or_default(),
        "mimic" => joint.mimics = true,
        "origin" => {
            joint.origin = pose(place(numbers("xyz", [0.0; 3])?)?, numbers("rpy", [0.0; 3])?);
            joint.origin_bytes = Some(bytes);
        }
        "axis" => {
            let axis = Vector3::from(numbers("xyz", [1.0, 0.0, 0.0])?).try_normalize(1e-9);
            // A joint that does not move has no use for a direction.
            joint.axis = match axis {
                Some(axis) => axis,
                None if joint.moves() => return Err("the axis of the joint has no direction".into()),
                None => joint.axis,
            };
        }
        "limit" => {
            for (place, key) in ["lower", "upper"].into_iter().enumerate() {
                if let Some(text) = text_of(key)? {
                    let limit = text.trim().parse().ok().filter(|limit: &f64| !limit.is_nan());
                    let limit = limit.ok_or_else(|| format!("`{text}` is no limit of joint `{}`", joint.name))?;
                    joint.limits.get_or_insert([0.0; 2])[place] = limit;
                }
            }
            if let Some([lower, upper]) = joint.limits
                && lower > upper
            {
                return Err(format!("the lower limit of joint `{}` is above the upper one", joint.name));
            }
        }
        _ => {}
    }
    Ok(())
}

fn attribute(element: &BytesStart<'_>, key: &str) -> Result<Option<String>, String> {
    for found in element.attributes() {
        let found = found.map_err(|cause| format!("an attribute cannot be read: {cause}"))?;
        if found.key.as_ref() == key {
            let text = quick_xml::escape::unescape(&found.value).map_err(|cause| cause.to_string())?;
            return Ok(Some(text.into_owned()));
        }
    }
    Ok(None)
}

/// Three numbers, separated by spaces.
fn three(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> =
        text.split_whitespace().filter_map(|number| number.parse().ok()).filter(|x: &f64| x.is_finite()).collect();
    match numbers[..] {
        [x, y, z] if text.split_whitespace().count() == 3 => Ok([x, y, z]),
        _ => Err(format!("`{text}` is not three numbers")),
    }
}

/// `Trans(xyz)·Rz(yaw)·Ry(pitch)·Rx(roll)`, from m to mm.
fn pose(xyz: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    let turn = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
    let rotation = turn(Vector3::z(), yaw) * turn(Vector3::y(), pitch) * turn(Vector3::x(), roll);
    Isometry3::from_parts(Translation3::from(Vector3::from(xyz) * Unit::Metre.internal()), rotation)
}

impl Urdf {
    /// The joints from the base to a link, fixed ones among them; without `tip` to the end of the arm. Returns them with the
    /// link.
    ///
    /// # Errors
    /// If there is no such link, or it is not clear where the arm ends.
    pub fn path(&self, file: &Path, tip: Option<&str>) -> Result<(Vec<&UrdfJoint>, String), Diagnostic> {
        let fault = |line: usize, message: String, help: String| {
            Diagnostic::input(if line > 0 { Location::line(file, line) } else { Location::file(file) }, message, help)
        };
        let tip = match tip {
            Some(tip) if self.links.iter().any(|link| link == tip) => tip.to_string(),
            Some(tip) => {
                let help = format!(
                    "{}its links are {}",
                    suggestion(tip, &self.links),
                    first_of(&self.links, NAMED, ", ", "link")
                );
                return Err(fault(0, format!("there is no link `{tip}`"), help));
            }
            None => self.end().map_err(|(message, help)| fault(0, message, help))?,
        };
        let mut path: Vec<&UrdfJoint> = Vec::new();
        let mut link = tip.as_str();
        while let Some(joint) = self.joint_before(link) {
            if joint.kind == Kind::Other || joint.mimics {
                let what = if joint.mimics {
                    "follows another joint (`mimic`)".into()
                } else {
                    format!("is `{}`", joint.word)
                };
                let help = "a serial chain has revolute, continuous, prismatic and fixed joints";
                return Err(fault(joint.line, format!("joint `{}` {what}", joint.name), help.into()));
            }
            path.push(joint);
            link = &joint.parent;
        }
        if !path.iter().any(|joint| joint.moves()) {
            let help = "name a link behind the joints, such as that of the flange";
            return Err(fault(0, format!("no joint moves link `{tip}` against the base"), help.into()));
        }
        path.reverse();
        Ok((path, tip))
    }

    /// The joint before a link.
    fn joint_before(&self, link: &str) -> Option<&UrdfJoint> {
        self.before.get(link).map(|joint| &self.joints[*joint])
    }

    /// Finds the joint before each link. The fault is a line, a message and what to do.
    fn connect(&mut self) -> Result<(), (usize, String, String)> {
        let links: HashSet<&str> = self.links.iter().map(String::as_str).collect();
        for (number, joint) in self.joints.iter().enumerate() {
            for (what, link) in [("parent", &joint.parent), ("child", &joint.child)] {
                if link.is_empty() {
                    let message = format!("joint `{}` has no {what} link", joint.name);
                    return Err((joint.line, message, format!("state <{what} link=\"…\"/>")));
                }
                if !links.contains(link.as_str()) {
                    let help = format!(
                        "{}its links are {}",
                        suggestion(link, &self.links),
                        first_of(&self.links, NAMED, ", ", "link")
                    );
                    return Err((
                        joint.line,
                        format!("joint `{}` names link `{link}`, which the file does not have", joint.name),
                        help,
                    ));
                }
            }
            if let Some(other) = self.before.insert(joint.child.clone(), number) {
                let other = &self.joints[other];
                let message = format!(
                    "link `{}` is behind joint `{}` and behind joint `{}` of line {}",
                    joint.child, joint.name, other.name, other.line
                );
                return Err((
                    joint.line,
                    message,
                    "the links of a URDF form a tree: remove one of the two joints".into(),
                ));
            }
        }
        // From each link back to the base, or to a link from which that is known.
        let mut ends: HashSet<&str> = HashSet::new();
        for joint in &self.joints {
            let (mut way, mut link) = (HashSet::new(), joint.child.as_str());
            while !ends.contains(link) {
                if !way.insert(link) {
                    return Err((joint.line, "the links form a circle".into(), "correct the file".into()));
                }
                match self.joint_before(link) {
                    Some(before) => link = &before.parent,
                    None => break,
                }
            }
            ends.extend(way);
        }
        Ok(())
    }

    /// The number of movable joints before each link.
    fn moving(&self) -> HashMap<&str, usize> {
        let mut counts: HashMap<&str, usize> = HashMap::new();
        for start in &self.links {
            let mut way: Vec<&UrdfJoint> = Vec::new();
            let mut link = start.as_str();
            while let (false, Some(joint)) = (counts.contains_key(link), self.joint_before(link)) {
                way.push(joint);
                link = &joint.parent;
            }
            let mut count = *counts.entry(link).or_insert(0);
            for joint in way.into_iter().rev() {
                count += usize::from(joint.moves() && !joint.mimics);
                counts.insert(&joint.child, count);
            }
        }
        counts
    }

    /// The link at which the arm ends.
    fn end(&self) -> Result<String, (String, String)> {
        let counts = self.moving();
        let moving = |link: &str| counts.get(link).copied().unwrap_or(0);
        if let Some(end) = ENDS.iter().find(|end| moving(end) > 0) {
            return Ok((*end).to_string());
        }
        let parents: HashSet<&str> = self.joints.iter().map(|joint| joint.parent.as_str()).collect();
        let leaves: Vec<&str> = self.links.iter().map(String::as_str).filter(|link| !parents.contains(link)).collect();
        let most = leaves.iter().map(|leaf| moving(leaf)).max().unwrap_or(0);
        if most == 0 {
            return Err(("the file has no movable joint".into(), "name the URDF of a robot".into()));
        }
        let last: Vec<&str> = leaves.into_iter().filter(|leaf| moving(leaf) == most).collect();
        // Fingers and frames behind the flange: the arm ends where it forks, if most of its joints lie before.
        let fork = self.fork(&last);
        match last[..] {
            [end] => Ok(end.to_string()),
            _ if 2 * moving(&fork) > most => Ok(fork),
            _ => Err((
                format!("the arm may end at {}", first_of(&last, NAMED, ", ", "link")),
                "state the link of the flange: its name is the tip of the chain".into(),
            )),
        }
    }

    /// The last link before all of these.
    fn fork(&self, links: &[&str]) -> String {
        let way = |end: &str| -> Vec<&str> {
            let before = |link: &&str| self.joint_before(link).map(|joint| joint.parent.as_str());
            let start = self.joints.iter().find(|joint| joint.child == end).map(|joint| joint.child.as_str());
            std::iter::successors(start, before).collect()
        };
        let ways: Vec<HashSet<&str>> = links.iter().map(|link| way(link).into_iter().collect()).collect();
        let first = links.first().map_or_else(Vec::new, |link| way(link));
        first.into_iter().find(|link| ways.iter().all(|way| way.contains(link))).unwrap_or_default().to_string()
    }

    /// The chain to a link.
    ///
    /// # Errors
    /// As [`Urdf::path`].
    pub fn chain(&self, file: &Path, tip: Option<&str>) -> Result<Chain, Diagnostic> {
        let (path, flange) = self.path(file, tip)?;
        let mut frame = Isometry3::identity();
        let (mut joints, mut assumed) = (Vec::new(), Vec::new());
        if tip.is_none() && self.joints.iter().filter(|joint| joint.parent == flange).count() > 1 {
            assumed.push(format!("the arm ends at link `{flange}`, where it forks"));
        }
        if let Some((line, name)) = &self.xacro {
            assumed.push(format!("<{name}> on line {line} is a program of xacro and was not run"));
        }
        for joint in &path {
            frame *= joint.origin;
            let kind = match joint.kind {
                Kind::Linear => AxisKind::Linear,
                Kind::Rotary => AxisKind::Rotary,
                Kind::Fixed | Kind::Other => continue,
            };
            let scale = if kind == AxisKind::Linear { Unit::Metre.internal() } else { 1.0 };
            let is_endless = joint.word == "continuous";
            let is_far = |limit: &f64| limit.abs() >= NO_LIMIT;
            let travel = joint.limits.filter(|ends| !is_endless && ends[0] < ends[1] && !ends.iter().any(is_far));
            // What a file states and the machine does not have is named.
            let why = match joint.limits {
                Some([0.0, 0.0]) if is_endless => None,
                Some(_) if is_endless => Some("is continuous, and its limits are not used"),
                None if !is_endless => Some("states no limits"),
                Some(ends) if ends.iter().any(is_far) => Some("states limits that no joint reaches"),
                Some(_) if travel.is_none() => Some("states limits between which it cannot move"),
                _ => None,
            };
            assumed.extend(why.map(|why| format!("joint `{}` {why}: its travel is open", joint.name)));
            let travel = travel.map(|ends| ends.map(|end| end * scale));
            joints.push(Joint { name: joint.name.clone(), kind, pose: frame, direction: joint.axis, travel });
        }
        let base = path.first().map_or_else(String::new, |joint| joint.parent.clone());
        Chain { name: self.name.clone(), base, flange, joints, end: frame, assumed }.within_limit(file)
    }
}
