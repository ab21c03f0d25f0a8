//! The places of a map.

use abbe::apply::volumetric;
use abbe::model::Diagnostic;
use abbe::model::axis::AxisKind;
use abbe::model::chain::Machine;

use crate::cli::values;

/// Positions of each axis, mm or rad.
pub fn grid(machine: &Machine, places: usize, axes: &[String]) -> Result<Vec<Vec<f64>>, Diagnostic> {
    values::count("--places", "places", places, volumetric::MAX_POINTS)?;
    let mut wanted: Vec<Option<(char, f64)>> = vec![None; machine.axes.len()];
    for text in axes {
        let fault = || {
            Diagnostic::other(format!(
                "--axis {text}: write where the axis stands, `A=30`, or its number of places, `X:11`"
            ))
        };
        let sign = if text.contains('=') { '=' } else { ':' };
        let (name, number) = text.split_once(sign).ok_or_else(fault)?;
        let number: f64 = number.trim().parse().map_err(|_| fault())?;
        if number.is_nan() || (sign == ':' && (number < 1.0 || number.fract() != 0.0)) {
            return Err(fault());
        }
        if sign == '=' {
            values::POSITION.check(&format!("--axis {}=", name.trim()), number)?;
        } else if number > volumetric::MAX_POINTS as f64 {
            return Err(Diagnostic::other(format!("--axis {text}: {} places are the most", volumetric::MAX_POINTS)));
        }
        let Some(axis) = machine.axis_index(name.trim()) else {
            let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            return Err(Diagnostic::other(format!(
                "--axis {text}: the machine has no axis `{}`; its axes are {}",
                name.trim(),
                names.join(", ")
            )));
        };
        wanted[axis] = Some((sign, number));
    }
    let along = |axis: usize| -> Result<Vec<f64>, Diagnostic> {
        let body = &machine.axes[axis];
        let count = match wanted[axis] {
            Some(('=', at)) => return Ok(vec![body.kind.to_internal(at)]),
            Some((_, count)) => count as usize,
            None => places,
        };
        let [least, greatest] = match (body.travel, body.kind) {
            (Some(travel), _) => travel,
            (None, AxisKind::Rotary) => [-std::f64::consts::PI, std::f64::consts::PI],
            (None, AxisKind::Linear) => {
                return Err(Diagnostic::other(format!(
                    "axis `{}` states no travel: add `travel_mm` to the machine, or `--axis {}=0`",
                    body.name, body.name
                )));
            }
        };
        Ok(match count {
            1 => vec![0.5 * (least + greatest)],
            _ => (0..count).map(|k| least + (greatest - least) * k as f64 / (count - 1) as f64).collect(),
        })
    };
    (0..machine.axes.len()).map(along).collect()
}
