//! A machine from its tables.

use abbe_model::axis::{Axis, AxisKind};
use abbe_model::chain::Machine;
use abbe_model::code::StructuralCode;
use abbe_model::document::fault::{Fault, Within};
use abbe_model::document::machine as document;
use abbe_model::document::value::Vector;
use abbe_model::frames::FixedPose;

use super::body::{self, BodyFiles};
use crate::spelling::known_names;

/// The machine; `files` knows where the surfaces of its bodies lie.
pub(crate) fn machine(document: &document::Machine, files: &mut BodyFiles<'_>) -> Result<Machine, Fault> {
    let text = &document.chain;
    let at_chain = |message: String, help: Option<String>| Fault::new(message, help).at("chain");
    let code = StructuralCode::parse(text).map_err(|fault| at_chain(fault.to_string(), None))?;
    let gravity = document.gravity.as_ref().map_or(Ok([0.0, 0.0, -1.0]), |vector| {
        let help = || Some("down is [0, 0, -1]".to_string());
        unit(vector).ok_or_else(|| Fault::of_key("has no direction", help()).at("gravity"))
    })?;
    for (name, _) in &document.axis.0 {
        if !code.axes().any(|axis| axis == name) {
            let known: Vec<&str> = code.axes().map(String::as_str).collect();
            let message = format!("axis `{name}` is not in the chain `{text}`");
            let help = format!("add it to `chain` or remove its table; {}", known_names(name, &known));
            return Err(Fault::new(message, help).on_key().at(name).at("axis"));
        }
    }
    let axes = code.axes().map(|name| {
        let Some((_, table)) = document.axis.0.iter().find(|(called, _)| called == name) else {
            let message = format!("axis `{name}` of the chain `{text}` has no table");
            return Err(at_chain(message, Some(format!("add [axis.{name}] with its `direction` and `origin_mm`"))));
        };
        axis(name, table).within(name).within("axis")
    });
    let mut machine = Machine {
        name: document.name.clone().unwrap_or_else(|| text.clone()),
        workpiece_side: code.workpiece_side.len(),
        axes: axes.collect::<Result<_, Fault>>()?,
        rotation: document.rotation.unwrap_or_default(),
        gravity,
        flange: document.flange.as_ref().map(|flange| FixedPose {
            xyz_mm: flange.xyz_mm.0,
            rpy_deg: flange.rpy_deg.as_ref().map_or([0.0; 3], |angles| angles.0),
        }),
        bodies: Vec::new(),
    };
    machine.bodies = body::bodies(&machine, &document.body, files).within("body")?;
    Ok(machine)
}

fn axis(name: &str, document: &document::Axis) -> Result<Axis, Fault> {
    let of_letter = AxisKind::of_letter(name);
    if let (Some(letter), Some(stated)) = (of_letter, document.kind)
        && letter != stated
    {
        let help = "A B C are rotary and X Y Z U V W linear; give another axis another name, such as `J1`";
        let message = format!("axis `{name}` is {letter} by ISO 841, not {stated}");
        return Err(Fault::new(message, help).at("kind"));
    }
    let no_letter = |what: &str, help: &str| {
        Fault::new(format!("axis `{name}` is not an ISO 841 letter and has no `{what}`"), help)
    };
    let kind = document
        .kind
        .or(of_letter)
        .ok_or_else(|| no_letter("kind", "add `kind = \"rotary\"` or `kind = \"linear\"`"))?;
    let direction = match &document.direction {
        Some(vector) => unit(vector).ok_or_else(|| {
            let help = "a direction of any length above 0, such as [0, 0, 1]";
            Fault::new(format!("`direction` of axis `{name}` is zero"), help).at("direction")
        })?,
        None => Axis::direction_of_letter(name).ok_or_else(|| {
            let help = "add `direction`: the direction in R along or about which it moves, such as [0, 0, 1]";
            no_letter("direction", help)
        })?,
    };
    let origin_mm = document.origin_mm.as_ref().map_or([0.0; 3], |origin| origin.0);
    let (travel, joint) = (travel(name, kind, document)?, document.joint.clone());
    Ok(Axis { name: name.to_string(), kind, direction, origin_mm, travel, joint })
}

fn travel(name: &str, kind: AxisKind, document: &document::Axis) -> Result<Option<[f64; 2]>, Fault> {
    let (mm, deg) = (("travel_mm", &document.travel_mm), ("travel_deg", &document.travel_deg));
    let ((right, ends), (wrong, other)) = if kind == AxisKind::Linear { (mm, deg) } else { (deg, mm) };
    if other.is_some() {
        let message = format!("`{wrong}` for the {kind} axis `{name}`");
        return Err(Fault::new(message, format!("use `{right}`")).on_key().at(wrong));
    }
    let Some(ends) = ends else { return Ok(None) };
    match ends[..] {
        [least, greatest] if least < greatest => Ok(Some([least, greatest].map(|end| kind.to_internal(end)))),
        _ => {
            let message = format!("`{right}` of axis `{name}` is not a list of two numbers, minimum and maximum");
            Err(Fault::new(message, None).at(right))
        }
    }
}

/// The vector scaled to length 1; `None` for a zero vector.
fn unit(vector: &Vector) -> Option<[f64; 3]> {
    let largest = vector.0.iter().fold(0.0_f64, |largest, v| largest.max(v.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return None;
    }
    let scaled = vector.0.map(|v| v / largest);
    let norm = scaled.iter().map(|v| v * v).sum::<f64>().sqrt();
    Some(scaled.map(|v| v / norm))
}
