//! Diagnosis of a circular test of two linear axes: the contribution of each classical fault to the radial deviation.
//!
//! Values have the signs of the error motions `E` of ISO 230-1, along R. For example, the backlash of X has the sign of
//! the effect `EXX~X:backlash`, whatever the counting direction of X. Faults that follow from a difference or a sum
//! over both axes (scale mismatch, servo mismatch, third-order positioning) refer to the axes' positive directions.
//! They are positive if an axis travels too far or lags.
//!
//! One least-squares fit estimates all terms of [`super::terms`], the radius and the centre. Radius and centre absorb
//! the set-up. The width of reversal spikes and the pitch of cyclic errors are searched. These faults are added only if
//! chance gives as large a gain in fewer than one of a thousand circles. The share of a fault is the range of its own
//! `δL` over the sum of all ranges.
//!
//! The uncertainties follow from the noise, or from the residual if that is larger. If neighbouring residuals have the
//! correlation r, the uncertainties are enlarged by √((1 + r)/(1 − r)).

use abbe_model::chain::Machine;

use super::fault::{Fault, columns, variance_and_enlargement};
use super::path::{MovingAxes, Path};
use super::results::{CircularTest, Diagnosis};
use super::search::{cyclic, is_separable, is_third_order, spikes, third_order};
use super::terms::PathRows;
use crate::noise::outliers;
use crate::numerics::regression::Regression;
use crate::results::ParameterResult;

/// Least arc for a diagnosis.
const MIN_ARC_DEG: f64 = 180.0;
/// Arc of a full circle.
const FULL_CIRCLE_DEG: f64 = 360.0;

/// The decomposition of one circle.
struct Decomposition {
    names: [String; 2],
    rows: PathRows,
    faults: Vec<Fault>,
    regression: Regression,
}

impl Decomposition {
    /// Decomposes a path. The error holds the reason in words if the path is a circle of linear axes.
    fn of(machine: &Machine, path: &Path) -> Result<Decomposition, Option<String>> {
        let MovingAxes::Linear { axes, radius_mm, radial } = path.moves else {
            return Err(None);
        };
        let arc_deg = path.arc().to_degrees();
        if !radial {
            return Err(Some("no diagnosis: the bar does not lie in the plane of the circle".into()));
        }
        if arc_deg < MIN_ARC_DEG * 0.99 {
            return Err(Some(format!("no diagnosis: an arc of {arc_deg:.0}° is too short for it")));
        }
        let names = axes.map(|axis| machine.axes[axis].name.clone());
        let rows = PathRows::of(path);
        let mut faults = standard(path, &rows, &names, radius_mm);
        let Some(mut regression) = solve(&rows, &faults) else {
            return Err(Some("no diagnosis: the faults are not separable with these readings".into()));
        };
        // Third-order errors are in the model during the search for spikes and cyclic errors, and remain if they are
        // significant. On a partial circle they are nearly collinear with scale mismatch and straightness.
        if arc_deg > FULL_CIRCLE_DEG * 0.99 {
            let found = third_order(&rows, &names);
            add_faults(&rows, &mut faults, &mut regression, found);
        }
        let found = spikes(path, &rows, &names, &faults, &regression);
        add_faults(&rows, &mut faults, &mut regression, found);
        let found = cyclic(&rows, &names, &faults, &regression);
        add_faults(&rows, &mut faults, &mut regression, found);
        let stays = |fault: &Fault| !is_third_order(fault) || is_separable(&rows, &faults, fault, &regression);
        let kept: Vec<bool> = faults.iter().map(stays).collect();
        if kept.contains(&false) {
            let mut kept = kept.into_iter();
            faults.retain(|_| kept.next().unwrap_or(true));
            if let Some(without) = solve(&rows, &faults) {
                regression = without;
            }
        }
        Ok(Decomposition { names, rows, faults, regression })
    }
}

/// The outliers of a circle: single readings with a large residual of the diagnosis; `None` if there is no diagnosis.
pub(super) fn reject_outliers(machine: &Machine, path: &Path) -> Option<Vec<bool>> {
    let model = Decomposition::of(machine, path).ok()?;
    let residual = &model.regression.residual;
    let mut left_out = path.left_out.clone();
    for i in outliers::alone(residual) {
        left_out[model.rows.row[i]] = true;
    }
    Some(left_out)
}

/// Adds the diagnosis and its limitations to a result.
pub(super) fn add(machine: &Machine, path: &Path, noise_mm: f64, result: &mut CircularTest) {
    match Decomposition::of(machine, path) {
        Ok(model) => {
            let sigma = scatter(&model.rows, &model.regression, noise_mm);
            report(&model.rows, &model.faults, &model.regression, sigma, result);
            limits(path, &model.regression, sigma, &model.names, result);
            if model.faults.iter().any(is_third_order) {
                result.not_identifiable.push(format!(
                    "the third-order errors of {} and {} are confounded: the value is that of their combination",
                    model.names[0], model.names[1]
                ));
            }
        }
        Err(why) => result.not_identifiable.extend(why),
    }
}

/// Adds those of the given faults that are separable from the others.
fn add_faults(rows: &PathRows, faults: &mut Vec<Fault>, regression: &mut Regression, found: Vec<Fault>) {
    if found.is_empty() {
        return;
    }
    let kept = faults.len();
    faults.extend(found);
    match solve(rows, faults) {
        Some(better) => *regression = better,
        None => faults.truncate(kept),
    }
}

fn solve(rows: &PathRows, faults: &[Fault]) -> Option<Regression> {
    Regression::solve(&columns(rows, faults), &rows.y)
}

/// The faults that every diagnosis contains.
fn standard(path: &Path, rows: &PathRows, names: &[String; 2], radius_mm: f64) -> Vec<Fault> {
    let plane = names.concat();
    let ppm = 1e6 / radius_mm;
    let mut faults = vec![
        Fault::new("scale mismatch", plane.clone(), vec![rows.scale()])
            .figure("ratio", &[(0, 1.0)], ppm, "um/m")
            .figure("over_diameter", &[(0, 2.0)], 1e3, "um"),
        Fault::new("squareness", plane.clone(), vec![rows.squareness()]).figure(
            "angle",
            &[(0, path.signs.squareness())],
            ppm,
            "um/m",
        ),
    ];
    if let (true, Some(feed)) = (path.both_directions(), path.feed_mm_s) {
        faults.push(Fault::new("servo mismatch", plane, vec![rows.servo()]).figure(
            "delay",
            &[(0, 1.0)],
            1e3 / feed,
            "ms",
        ));
    } else if path.both_directions() {
        faults.push(Fault::new("servo mismatch", plane, vec![rows.servo()]).figure("lag", &[(0, 1.0)], 1e3, "um"));
    }
    for axis in 0..2 {
        let name = &names[axis];
        let (own, across) = (path.signs.error(axis, axis), path.signs.error(axis, 1 - axis));
        faults.push(
            Fault::new("backlash", name.clone(), rows.backlash(axis).to_vec())
                .figure(format!("{name}+"), &[(0, own), (1, own)], 1e3, "um")
                .figure(format!("{name}-"), &[(0, own), (1, -own)], 1e3, "um"),
        );
        faults.push(Fault::new("straightness", name.clone(), vec![rows.straightness(axis)]).figure(
            "sagitta",
            &[(0, across)],
            1e3,
            "um",
        ));
        if path.both_directions() {
            faults.push(Fault::new("lateral play", name.clone(), vec![rows.lateral(axis)]).figure(
                "play",
                &[(0, across)],
                1e3,
                "um",
            ));
        }
    }
    faults
}

/// The standard deviation for the uncertainties, mm.
fn scatter(rows: &PathRows, regression: &Regression, noise_mm: f64) -> f64 {
    let (variance, enlargement) = variance_and_enlargement(rows, regression);
    (variance.max(noise_mm * noise_mm) * enlargement).sqrt()
}

fn report(rows: &PathRows, faults: &[Fault], regression: &Regression, sigma: f64, result: &mut CircularTest) {
    let mut first = rows.setup().len();
    for fault in faults {
        let mut values: Vec<ParameterResult> = fault
            .figures
            .iter()
            .map(|figure| {
                let weights: Vec<(usize, f64)> =
                    figure.weights.iter().map(|(j, w)| (first + j, w * figure.per_mm)).collect();
                let value = weights.iter().map(|(j, w)| regression.beta[*j] * w).sum();
                ParameterResult::new(&figure.name, value, regression.u(&weights, sigma), figure.unit)
            })
            .collect();
        for (name, column) in &fault.amplitudes {
            let (j, k) = (first + column, first + column + 1);
            let (a, b) = (regression.beta[j], regression.beta[k]);
            let amplitude = a.hypot(b);
            let along = [(j, a / amplitude * 1e3), (k, b / amplitude * 1e3)];
            let u = regression.u(&along, sigma);
            values.push(ParameterResult::new(name, amplitude * 1e3, u, "um"));
        }
        values.extend(fault.searched.iter().cloned());
        let own = (0..rows.count()).map(|i| {
            let terms = fault.columns.iter().enumerate();
            terms.map(|(j, column)| column[i] * regression.beta[first + j]).sum::<f64>()
        });
        let (least, most) = own.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        for value in &mut values {
            value.meaning = format!("{} of {}: {}", fault.fault, fault.axes, value.id);
        }
        result.diagnosis.push(Diagnosis {
            fault: fault.fault.to_string(),
            axes: fault.axes.clone(),
            values,
            circularity_um: (most - least) * 1e3,
            share_percent: 0.0,
        });
        first += fault.columns.len();
    }
    let total: f64 = result.diagnosis.iter().map(|fault| fault.circularity_um).sum();
    for fault in &mut result.diagnosis {
        fault.share_percent = if total > 0.0 { 100.0 * fault.circularity_um / total } else { 0.0 };
    }
    result.diagnosis.sort_by(|a, b| b.circularity_um.total_cmp(&a.circularity_um));
    result.diagnosis_rms_um = Some((regression.sum_of_squares() / rows.count() as f64).sqrt() * 1e3);
}

/// States the limitations: confounded faults and missing data.
fn limits(path: &Path, regression: &Regression, sigma: f64, names: &[String; 2], result: &mut CircularTest) {
    let (radius_um, u) = (regression.beta[0] * 1e3, regression.u(&[(0, 1e3)], sigma));
    result.not_identifiable.push(format!(
        "the mean radius deviates by {radius_um:.2} µm (u {u:.2}): it combines the bar length, the mean scale of {} and {}, and the mean lag of both axes \
         (proportional to the square of the feed)",
        names[0], names[1]
    ));
    if !path.both_directions() {
        let why =
            "one direction only: servo mismatch is confounded with squareness, and lateral play with radius and scale";
        result.not_identifiable.push(why.into());
    } else if path.feed_mm_s.is_none() {
        let why = "no time in the data: servo mismatch is given as a lag in µm at this feed, not in ms";
        result.not_identifiable.push(why.into());
    }
    result.not_identifiable.push(
        "straightness is confounded with a positioning error of the other axis that grows with the square".into(),
    );
}
