//! URDF (ROS, "XML Robot Description Format", wiki.ros.org/urdf/XML): the chain to one link. Lengths in m, angles in rad.
//!
//! The pose of a joint in the link before it is `origin`: `Trans(xyz)·Rz(yaw)·Ry(pitch)·Rx(roll)`. The joint moves about or
//! along `axis`, which is given in its own frame. Masses, meshes and everything else are not looked at.

use std::ops::Range;
use std::path::Path;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::chain::{Chain, Joint};
use crate::axis::AxisKind;
use crate::document::source::Source;
use crate::error::{Location, ModelError};

/// Millimetres per metre.
const MM: f64 = 1e3;
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
    limits: [Option<f64>; 2],
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
#[derive(Debug)]
pub struct Urdf {
    name: String,
    links: Vec<String>,
    joints: Vec<UrdfJoint>,
}

/// Reads a URDF file.
///
/// # Errors
/// If it is no URDF, with the line and what to do.
pub fn read(source: &Source) -> Result<Urdf, ModelError> {
    let text = &source.text;
    let line_of =
        |byte: usize| 1 + text.as_bytes()[..byte.min(text.len())].iter().filter(|byte| **byte == b'\n').count();
    let fault = |byte: usize, message: String, help: &str| ModelError::Input {
        location: Location::line(&source.file, line_of(byte)),
        message,
        help: Some(help.into()),
    };
    if let Some(byte) = text.find("<xacro:") {
        let help = "write the URDF that it describes: `xacro FILE.xacro > robot.urdf`";
        return Err(fault(byte, "this is a xacro file, a program that writes a URDF".into(), help));
    }
    let mut urdf = Urdf { name: String::new(), links: Vec::new(), joints: Vec::new() };
    let mut reader = Reader::from_str(text);
    let mut path: Vec<String> = Vec::new();
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
            Event::Eof => break,
            _ => continue,
        };
        let name = element.name().as_ref().to_string();
        let whole = |message: String| fault(before, message, "correct the file");
        let text_of = |key: &str| attribute(&element, key);
        match (path.iter().map(String::as_str).collect::<Vec<_>>().as_slice(), name.as_str()) {
            ([], "robot") => urdf.name = text_of("name").map_err(whole)?.unwrap_or_default(),
            ([], _) => {
                return Err(fault(before, format!("the first element is <{name}>, not <robot>"), "name a URDF file"));
            }
            (["robot"], "link") => urdf.links.extend(text_of("name").map_err(whole)?),
            (["robot"], "joint") => {
                let word = text_of("type").map_err(whole)?.unwrap_or_default();
                let kind = match word.as_str() {
                    "revolute" | "continuous" => Kind::Rotary,
                    "prismatic" => Kind::Linear,
                    "fixed" => Kind::Fixed,
                    _ => Kind::Other,
                };
                urdf.joints.push(UrdfJoint {
                    name: text_of("name").map_err(whole)?.unwrap_or_default(),
                    kind,
                    word,
                    parent: String::new(),
                    child: String::new(),
                    origin: Isometry3::identity(),
                    axis: Vector3::x(),
                    limits: [None, None],
                    mimics: false,
                    origin_bytes: None,
                    after_start: after,
                    line: line_of(before),
                });
            }
            (["robot", "joint"], _) => {
                if let Some(joint) = urdf.joints.last_mut() {
                    part_of_joint(joint, &name, &text_of, before..after).map_err(whole)?;
                }
            }
            _ => {}
        }
        if !is_empty {
            path.push(name);
        }
    }
    if urdf.name.is_empty() && urdf.joints.is_empty() {
        return Err(fault(0, "no element <robot>".into(), "name a URDF file"));
    }
    Ok(urdf)
}

/// An element of a joint; the error is a message.
fn part_of_joint(
    joint: &mut UrdfJoint,
    name: &str,
    text_of: &dyn Fn(&str) -> Result<Option<String>, String>,
    bytes: Range<usize>,
) -> Result<(), String> {
    let numbers = |key: &str, absent: [f64; 3]| text_of(key)?.as_deref().map_or(Ok(absent), three);
    match name {
        "parent" => joint.parent = text_of("link")?.unwrap_or_default(),
        "child" => joint.child = text_of("link")?.unwrap_or_default(),
        "mimic" => joint.mimics = true,
        "origin" => {
            joint.origin = pose(numbers("xyz", [0.0; 3])?, numbers("rpy", [0.0; 3])?);
            joint.origin_bytes = Some(bytes);
        }
        "axis" => {
            let axis = Vector3::from(numbers("xyz", [1.0, 0.0, 0.0])?);
            joint.axis = axis.try_normalize(1e-9).ok_or("the axis of the joint has no direction")?;
        }
        "limit" => {
            for (place, key) in ["lower", "upper"].into_iter().enumerate() {
                let limit = text_of(key)?.map_or(Ok(0.0), |text| text.trim().parse::<f64>());
                joint.limits[place] = limit.ok().filter(|limit| limit.is_finite());
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
    Isometry3::from_parts(Translation3::from(Vector3::from(xyz) * MM), rotation)
}

impl Urdf {
    /// The joints from the base to a link, fixed ones among them; without `tip` to the end of the arm. Returns them with the
    /// link.
    ///
    /// # Errors
    /// If there is no such link, or it is not clear where the arm ends.
    pub fn path(&self, file: &Path, tip: Option<&str>) -> Result<(Vec<&UrdfJoint>, String), ModelError> {
        let fault = |line: usize, message: String, help: String| ModelError::Input {
            location: if line > 0 { Location::line(file, line) } else { Location::file(file) },
            message,
            help: Some(help),
        };
        let tip = match tip {
            Some(tip) if self.links.iter().any(|link| link == tip) => tip.to_string(),
            Some(tip) => {
                let help = format!("its links are {}", self.links.join(", "));
                return Err(fault(0, format!("there is no link `{tip}`"), help));
            }
            None => self.end().map_err(|(message, help)| fault(0, message, help))?,
        };
        let mut path = Vec::new();
        let mut link = tip.clone();
        while let Some(joint) = self.joints.iter().find(|joint| joint.child == link) {
            if joint.kind == Kind::Other || joint.mimics {
                let what = if joint.mimics {
                    "follows another joint (`mimic`)".into()
                } else {
                    format!("is `{}`", joint.word)
                };
                let help = "a serial chain has revolute, continuous, prismatic and fixed joints";
                return Err(fault(joint.line, format!("joint `{}` {what}", joint.name), help.into()));
            }
            if path.len() > self.joints.len() {
                return Err(fault(joint.line, "the links form a circle".into(), "correct the file".into()));
            }
            path.push(joint);
            link.clone_from(&joint.parent);
        }
        path.reverse();
        Ok((path, tip))
    }

    /// The link at which the arm ends.
    fn end(&self) -> Result<String, (String, String)> {
        let moving = |tip: &str| {
            let (mut count, mut link, mut steps) = (0, tip, 0);
            while let Some(joint) = self.joints.iter().find(|joint| joint.child == link) {
                count += usize::from(joint.moves() && !joint.mimics);
                link = &joint.parent;
                steps += 1;
                if steps > self.joints.len() {
                    break;
                }
            }
            count
        };
        if let Some(end) = ENDS.iter().find(|end| self.links.iter().any(|link| link == *end) && moving(end) > 0) {
            return Ok((*end).to_string());
        }
        let leaves: Vec<&String> =
            self.links.iter().filter(|link| !self.joints.iter().any(|joint| joint.parent == **link)).collect();
        let most = leaves.iter().map(|leaf| moving(leaf)).max().unwrap_or(0);
        if most == 0 {
            return Err(("the file has no movable joint".into(), "name the URDF of a robot".into()));
        }
        let last: Vec<&str> = leaves.iter().filter(|leaf| moving(leaf) == most).map(|leaf| leaf.as_str()).collect();
        match last[..] {
            [end] => Ok(end.to_string()),
            _ => Err((
                format!("the arm may end at {}", last.join(", ")),
                "state the link of the flange: its name is the tip of the chain".into(),
            )),
        }
    }

    /// The chain to a link.
    ///
    /// # Errors
    /// As [`Urdf::path`].
    pub fn chain(&self, file: &Path, tip: Option<&str>) -> Result<Chain, ModelError> {
        let (path, flange) = self.path(file, tip)?;
        let mut frame = Isometry3::identity();
        let mut joints = Vec::new();
        for joint in &path {
            frame *= joint.origin;
            let kind = match joint.kind {
                Kind::Linear => AxisKind::Linear,
                Kind::Rotary => AxisKind::Rotary,
                Kind::Fixed | Kind::Other => continue,
            };
            let scale = if kind == AxisKind::Linear { MM } else { 1.0 };
            let travel = match joint.limits {
                [Some(lower), Some(upper)] if lower < upper && joint.word != "continuous" => {
                    Some([lower * scale, upper * scale])
                }
                _ => None,
            };
            joints.push(Joint { name: joint.name.clone(), kind, pose: frame, direction: joint.axis, travel });
        }
        let base = path.first().map_or_else(String::new, |joint| joint.parent.clone());
        Ok(Chain { name: self.name.clone(), base, flange, joints, end: frame, assumed: Vec::new() })
    }
}
