//! Checks of readings that instruments share, and the medians that they rest on.

use super::channel::Channel;
use super::kind::{Checked, Fault};
use crate::median::median;
use crate::unit::Unit;

/// The sensor range is one to two millimetres for a ball bar and a few for an R-test. A larger deviation is not an
/// error of the machine, mm.
pub(super) const MAX_MM: f64 = 5.0;

/// A typical angle that a sensor reads about its zero is smaller, rad: ten times the rotation errors of a poor machine.
const MAX_RAD: f64 = 2e-3;

/// Checks that the values of channels stay near their median, 5 mm or 2 mrad, except the first `skipped` channels.
///
/// # Errors
/// If those of a channel do not.
pub(super) fn check_small(channels: &[Channel], checked: &Checked<'_>, skipped: usize) -> Result<(), Fault> {
    let readings = checked.readings;
    for (place, channel) in channels.iter().enumerate().skip(skipped) {
        let read = readings.observed.iter().skip(place).step_by(channels.len()).copied();
        let mut values: Vec<f64> = read.filter(|value| !value.is_nan()).collect();
        let away = median_absolute_deviation(&mut values);
        let (most, limit, shown) = match channel.is_angle() {
            true => (MAX_RAD, "2 mrad (412″)", format!("{:.1}″", Unit::Arcsecond.to_display(away))),
            false => (MAX_MM, "5 mm", format!("{away:.3} mm")),
        };
        if away > most {
            return Err((
                format!(
                    "test \"{}\": the readings of `{}` differ from their median by {shown} (median of {} readings); the \
                     limit is {limit}",
                    checked.test,
                    channel.name,
                    values.len()
                ),
                "is the column in another unit than its name says, or is it a position and no deviation?".into(),
            ));
        }
    }
    Ok(())
}

/// The median absolute deviation from the median.
pub(super) fn median_absolute_deviation(values: &mut [f64]) -> f64 {
    let middle = median(values);
    median(&mut values.iter().map(|value| (value - middle).abs()).collect::<Vec<_>>())
}

/// Deviations that scatter by less are below what an interferometer or a ball bar resolves, mm.
const MIN_SCATTER_MM: f64 = 5e-5;

/// The doubt about deviations whose scatter no instrument resolves, as where a column in mm has a name in µm.
pub(super) fn doubt_on_scatter(deviations: &mut [f64]) -> Option<String> {
    let scatter = median_absolute_deviation(deviations);
    (scatter > 0.0 && scatter < MIN_SCATTER_MM).then(|| {
        format!(
            "the deviations scatter by {:.2} nm about their median, less than such an instrument resolves: is the column in \
             mm, and its name in µm?",
            scatter * 1e6
        )
    })
}

/// Deviations of one axis that scatter by more are rare: a scale that is wrong by 1 mm per metre does so on four metres, mm.
const MAX_SCATTER_MM: f64 = 1.0;

/// The doubt about displacements whose scatter no axis has, as where a column in µm has a name in mm.
pub(super) fn doubt_on_displacements(deviations: &mut [f64]) -> Option<String> {
    let scatter = median_absolute_deviation(deviations);
    if scatter <= MAX_SCATTER_MM {
        return doubt_on_scatter(deviations);
    }
    Some(format!(
        "the displacement differs from the travel by {scatter:.2} mm (median, about its own median), which is rare for an axis: \
         is the column in µm, and its name in mm?"
    ))
}
