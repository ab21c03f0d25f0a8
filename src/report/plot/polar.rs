//! The trace of a ball bar: the deviation, magnified, about a nominal circle.

use maud::{Markup, html};

use super::scale::{place, polyline, round_up, text};
use super::{Plot, legend};

/// Divisions on either side of the nominal circle.
pub const DIVISIONS: f64 = 4.0;

/// A trace to draw.
pub struct Trace<'t> {
    /// `forward`, `backward` or `plain`.
    pub class: &'t str,
    /// Its number among the stretches of its test, where the page can move it.
    pub number: Option<usize>,
    /// Angle, degrees, and deviation, µm.
    pub points: Vec<(f64, f64)>,
}

/// How large a polar plot is drawn.
#[derive(Clone, Copy)]
pub struct Round {
    /// Width and height of the square that the circles fill.
    pub side: f64,
    /// Whether start and end, legend and angles are drawn.
    pub full: bool,
}

impl Round {
    /// A plot of its own.
    pub const FULL: Round = Round {
        side: 400.0,
        full: true,
    };
    /// One of many.
    pub const SMALL: Round = Round {
        side: 190.0,
        full: false,
    };

    /// Distance of two circles.
    pub fn division(self) -> f64 {
        self.side * 0.042
    }

    /// Radius of the nominal circle.
    pub fn nominal(self) -> f64 {
        self.side * 0.22
    }

    /// Where a reading lies.
    fn at(self, angle_deg: f64, divisions: f64) -> (f64, f64) {
        let radius = (self.nominal() + divisions * self.division()).max(0.0);
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        (self.side / 2.0 + radius * cos, self.side / 2.0 - radius * sin)
    }
}

/// The round number of µm per division at which everything stays within the circles.
pub fn division_um<'p>(points: impl IntoIterator<Item = &'p (f64, f64)>) -> f64 {
    let most = points.into_iter().map(|(_, um)| um.abs()).fold(0.0, f64::max);
    round_up(most / DIVISIONS)
}

/// Circles, spokes, traces, signs.
pub fn drawing(round: Round, division_um: f64, traces: &[Trace<'_>]) -> Markup {
    let middle = round.side / 2.0;
    html! {
        @for k in (-4..=4).filter(|k| *k != 0) {
            circle class="grid" cx=(middle) cy=(middle) r=(place(round.nominal() + f64::from(k) * round.division())) {}
        }
        @for k in 0..8 {
            @let (x, y) = round.at(45.0 * f64::from(k), DIVISIONS);
            path class="grid" d=(polyline([(middle, middle), (x, y)])) {}
            @if round.full {
                @let (x, y) = round.at(45.0 * f64::from(k), DIVISIONS + 0.6);
                text class=(beside(k)) x=(place(x)) y=(place(y + 4.0)) { (45 * k) "°" }
            }
        }
        circle class="nominal" cx=(middle) cy=(middle) r=(place(round.nominal())) {}
        @for trace in traces {
            @let way = along_arcs(&trace.points).into_iter().map(|(angle, um)| round.at(angle, um / division_um));
            path class=(format!("run {}", trace.class)) data-run=[trace.number] d=(polyline(way)) {}
        }
        @if round.full {
            @for trace in traces {
                @let at = |point: &(f64, f64)| round.at(point.0, point.1 / division_um);
                @if let (Some(first), Some(last)) = (trace.points.first().map(at), trace.points.last().map(at)) {
                    circle class="start" data-run=[trace.number] cx=(place(first.0)) cy=(place(first.1)) r="4" {}
                    rect class="end" data-run=[trace.number] x=(place(last.0 - 3.0)) y=(place(last.1 - 3.0)) width="6" height="6" {}
                }
            }
        }
    }
}

/// Degrees between two points beyond which a straight line would cut the circle short.
const CHORD_DEG: f64 = 4.0;

/// Readings that lie far apart are joined along the arc, the deviation in proportion.
fn along_arcs(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut way: Vec<(f64, f64)> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let ((from, low), (to, high)) = (pair[0], pair[1]);
        let parts = ((to - from).abs() / CHORD_DEG).ceil().max(1.0);
        for k in 1..=parts as usize {
            let share = k as f64 / parts;
            way.push((from + share * (to - from), low + share * (high - low)));
        }
    }
    way
}

/// How the angle at a spoke is set, so that it stays out of the circles.
fn beside(spoke: i32) -> &'static str {
    match spoke {
        2 | 6 => "small soft middle",
        3..=5 => "small soft right",
        _ => "small soft",
    }
}

/// A trace plot of its own.
pub fn plot(
    name: String,
    title: String,
    caption: String,
    over: &str,
    traces: &[Trace<'_>],
    division: f64,
) -> Plot {
    let round = Round::FULL;
    let mut entries: Vec<(&str, String)> = Vec::new();
    for (class, words) in [
        ("forward", "forward"),
        ("backward", "backward"),
        ("plain", "readings"),
    ] {
        if traces.iter().any(|trace| trace.class == class) {
            entries.push((class, words.to_string()));
        }
    }
    entries.push(("nominal", "nominal".to_string()));
    entries.push(("key-start", "start".to_string()));
    entries.push(("key-end", "end".to_string()));
    let (keys, down) = legend(&entries, 10.0, round.side + 32.0, round.side - 20.0);
    let inner = html! {
        (drawing(round, division, traces))
        text x="10" y=(round.side + 12.0) { tspan class="division" { (text(division, division)) } " µm per division; angle of " (over) }
        (keys)
    };
    Plot::still(name, title, caption, [round.side, down + 10.0], inner)
}
