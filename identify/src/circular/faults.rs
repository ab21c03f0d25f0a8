//! The contribution of each classical fault of two linear axes to the radius of a circle.
//!
//! Notation: `u₁ = cos θ`, `u₂ = sin θ`, `dᵢ` the direction of travel of axis i, `s` that of the path, `v` the feed.
//! The radius changes by `δL = u₁·δ₁ + u₂·δ₂`. `δᵢ` is the deviation of the tool along the positive direction of axis
//! i.
//!
//! ```text
//! scale mismatch   δᵢ = mᵢ·qᵢ                 ½(m₁ − m₂)·R·cos 2θ
//! squareness       δ₁ = −γ·q₂                 −½γ·R·sin 2θ            the angle between the positive axes is 90° + γ
//! servo mismatch   δᵢ = −τᵢ·q̇ᵢ                ½s·v·(τ₁ − τ₂)·sin 2θ   positive: the first axis lags more
//! backlash         δᵢ = −½Bᵢ·dᵢ               −½Bᵢ·dᵢ·uᵢ              Bᵢ = mean + slope·uᵢ: one value at each end
//! lateral play     δⱼ = −½Pᵢ·dᵢ               −½Pᵢ·dᵢ·uⱼ
//! straightness     δⱼ = κᵢ·qᵢ²                κᵢR²·uᵢ²·uⱼ             κᵢR²: sagitta over the diameter
//! third order      δᵢ = cᵢ·(qᵢ/R)³            ⅛(c₁ + c₂)·cos 4θ           beside radius and scale, which absorb the other terms
//!                  δⱼ = kᵢ·(qᵢ/R)³            ⅛(k₁ − k₂)·sin 4θ           beside squareness
//! reversal spike   δL = H·exp(−φ/w)           φ: angle of the path since the reversal of axis i
//! cyclic error     δᵢ = A·cos(2πqᵢ/p + …)     uᵢ·…
//! ```

use std::f64::consts::TAU;

use abbe_model::chain::Machine;

use super::path::Path;
use super::rows::Row;

/// A value of a fault.
pub(super) enum FaultFigure {
    /// The sum of its coefficients times these factors, and the unit of the sum.
    Sum(Vec<f64>, &'static str),
    /// The amplitude of a cosine and a sine, by the column of the cosine.
    Amplitude(usize),
    /// A parameter found by search, and its unit.
    Searched(f64, &'static str),
}

/// A fault as columns of a regression, and the values that follow from its coefficients.
pub(super) struct Fault {
    pub fault: &'static str,
    pub axes: String,
    pub columns: Vec<Vec<f64>>,
    /// The values, by name.
    pub figures: Vec<(String, FaultFigure)>,
}

/// A column of the regression, mm for a coefficient of 1 mm.
type Term<'a> = &'a dyn Fn(&Row) -> f64;

impl Fault {
    fn new(fault: &'static str, axes: &str, rows: &[Row], terms: &[Term<'_>]) -> Fault {
        let columns = terms.iter().map(|term| rows.iter().map(term).collect()).collect();
        Fault { fault, axes: axes.to_string(), columns, figures: Vec::new() }
    }

    fn with(mut self, name: impl Into<String>, figure: FaultFigure) -> Fault {
        self.figures.push((name.into(), figure));
        self
    }

    /// With a sum of its coefficients, mm, times these factors.
    fn sum(self, name: impl Into<String>, factors: &[f64], unit: &'static str) -> Fault {
        self.with(name, FaultFigure::Sum(factors.to_vec(), unit))
    }

    /// With a value at the positive and one at the negative end of the travel, µm for a coefficient of 1 mm.
    fn ends(self, positive: [f64; 2], negative: [f64; 2]) -> Fault {
        let [plus, minus] = ["+", "-"].map(|end| format!("{}{end}", self.axes));
        self.sum(plus, &positive, "um").sum(minus, &negative, "um")
    }
}

/// Radius and centre, which absorb the set-up.
pub(super) fn set_up(rows: &[Row]) -> [Vec<f64>; 3] {
    let column = |term: Term<'_>| rows.iter().map(term).collect();
    [column(&|_| 1.0), column(&|row| row.u[0]), column(&|row| row.u[1])]
}

/// The faults that every diagnosis contains, of a path of these axes and this radius.
///
/// A deviation `δ` of the path (tool relative to workpiece) along the positive direction of an axis is an error motion of
/// `±δ` along R: `direction` is the sign of that direction, `sides` is −1 for axes on opposite sides of the bed.
pub(super) fn standard(machine: &Machine, path: &Path, rows: &[Row], axes: [usize; 2], radius_mm: f64) -> Vec<Fault> {
    let names = axes.map(|axis| &machine.axes[axis].name[..]);
    let direction = axes.map(|axis| machine.axes[axis].principal().map_or(1.0, |(_, sign)| sign));
    let [first, second] = axes.map(|axis| axis < machine.workpiece_side);
    let sides = if first == second { 1.0 } else { -1.0 };
    let plane = names.concat();
    let ppm = 1e6 / radius_mm;
    let mut faults = vec![
        Fault::new("scale mismatch", &plane, rows, &[&|row| 0.5 * (row.u[0].powi(2) - row.u[1].powi(2))])
            .sum("ratio", &[ppm], "um/m")
            .sum("over_diameter", &[2e3], "um"),
        Fault::new("squareness", &plane, rows, &[&|row| -row.u[0] * row.u[1]]).sum(
            "angle",
            &[sides * direction[0] * direction[1] * ppm],
            "um/m",
        ),
    ];
    let both = path.both_directions();
    if both {
        let fault = Fault::new("servo mismatch", &plane, rows, &[&|row| row.s * row.u[0] * row.u[1]]);
        faults.push(match path.feed_mm_s {
            Some(feed) => fault.sum("delay", &[1e3 / feed], "ms"),
            None => fault.sum("lag", &[1e3], "um"),
        });
    }
    for (axis, name) in names.into_iter().enumerate() {
        let other = 1 - axis;
        let (own, across) = (1e3 * direction[axis], 1e3 * sides * direction[other]);
        let lost = |row: &Row| -0.5 * row.d[axis] * row.u[axis];
        let slope = |row: &Row| -0.5 * row.d[axis] * row.u[axis].powi(2);
        faults.push(Fault::new("backlash", name, rows, &[&lost, &slope]).ends([own, own], [own, -own]));
        let bow = |row: &Row| row.u[axis].powi(2) * row.u[other];
        faults.push(Fault::new("straightness", name, rows, &[&bow]).sum("sagitta", &[across], "um"));
        if both {
            let lateral = |row: &Row| -0.5 * row.d[axis] * row.u[other];
            faults.push(Fault::new("lateral play", name, rows, &[&lateral]).sum("play", &[across], "um"));
        }
    }
    faults
}

/// Errors that grow with the third power of the position. Beside radius, centre and scale they contribute `cos 4θ` and
/// `sin 4θ`, with which a cyclic error of few periods is confounded.
pub(super) fn third_order(rows: &[Row], names: &[String; 2]) -> Vec<Fault> {
    // cos 2θ = u₁² − u₂², sin 2θ = 2u₁u₂.
    let double = |row: &Row| (row.u[0] * row.u[0] - row.u[1] * row.u[1], 2.0 * row.u[0] * row.u[1]);
    let cos = |row: &Row| {
        let (cos, sin) = double(row);
        0.125 * (cos * cos - sin * sin)
    };
    let sin = |row: &Row| {
        let (cos, sin) = double(row);
        0.25 * cos * sin
    };
    let fault = |k: usize, term: Term<'_>, figure: &str| {
        Fault::new(THIRD_ORDER[k], &names.concat(), rows, &[term]).sum(figure, &[1e3], "um")
    };
    vec![fault(0, &cos, "sum"), fault(1, &sin, "difference")]
}

/// Names of the third-order faults.
const THIRD_ORDER: [&str; 2] = ["third-order positioning", "third-order straightness"];

/// Whether a fault is a third-order fault.
pub(super) fn is_third_order(fault: &Fault) -> bool {
    THIRD_ORDER.contains(&fault.fault)
}

/// Reversal spikes of an axis with a width in radians of the path: `exp(−φ/w)` after each reversal at the positive and at
/// the negative end.
pub(super) fn spike(rows: &[Row], axis: usize, name: &str, width: f64) -> Fault {
    let after = |end: f64| {
        move |row: &Row| match row.since[axis] {
            Some((since, at)) if at == end => (-since / width).exp(),
            _ => 0.0,
        }
    };
    Fault::new("reversal spike", name, rows, &[&after(1.0), &after(-1.0)])
        .ends([1e3, 0.0], [0.0, 1e3])
        .with("width", FaultFigure::Searched(width.to_degrees(), "deg"))
}

/// A cyclic error of an axis with a pitch, which is the same in both directions.
pub(super) fn cyclic(rows: &[Row], axis: usize, name: &str, pitch_mm: f64) -> Fault {
    let phase = |row: &Row| TAU * row.q[axis] / pitch_mm;
    let cos = |row: &Row| row.u[axis] * phase(row).cos();
    let sin = |row: &Row| row.u[axis] * phase(row).sin();
    Fault::new("cyclic error", name, rows, &[&cos, &sin])
}

/// A cyclic error with an amplitude for each direction of travel.
pub(super) fn cyclic_by_direction(rows: &[Row], axis: usize, name: &str, pitch_mm: f64) -> Fault {
    let both = cyclic(rows, axis, name, pitch_mm);
    let mut fault = Fault { columns: Vec::new(), ..both };
    for (direction, name) in [(1.0, "forward"), (-1.0, "backward")] {
        if rows.iter().any(|row| row.d[axis] == direction) {
            fault.figures.push((name.to_string(), FaultFigure::Amplitude(fault.columns.len())));
            let part = |(value, row): (&f64, &Row)| if row.d[axis] == direction { *value } else { 0.0 };
            fault.columns.extend(both.columns.iter().map(|column| column.iter().zip(rows).map(part).collect()));
        }
    }
    fault.with("pitch", FaultFigure::Searched(pitch_mm, "mm"))
}
