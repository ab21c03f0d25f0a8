//! The nine panels of a mount: residuals across and up against azimuth, elevation and order; vectors on the sky, scatter,
//! distribution. They are those by which TPOINT judges a mount on two axes (P. T. Wallace, TPOINT, command `a9`), with
//! azimuth from north through east.

use abbe::identify::series::places::{Sighting, sightings};

use super::plots::SessionPlots;
use crate::report::figure::Figure;
use crate::report::figure::lines::{Axis, Lines, Mark, Series, Size};
use crate::report::figure::scale::{Scale, round_up, span, text};
use crate::report::number::quantity;

/// The residual before is drawn if its rms is at most this multiple of that after; otherwise nothing could be read of
/// that after.
const MAX_RATIO: f64 = 20.0;
/// Length of the longest vector on the map, degrees.
const LONGEST_DEG: f64 = 25.0;
/// Chords of a circle.
const CHORDS: usize = 60;

/// The residual of a model of a sighting.
type Of = fn(&Sighting) -> [f64; 2];

/// The panels; none unless every test observes directions.
pub fn panels(session: &SessionPlots<'_>) -> Vec<Figure> {
    let Some(stars) = sightings(session.problem, session.series) else { return Vec::new() };
    let panels = Panels::of(&stars, session);
    let coordinates = [("azimuth", "deg"), ("elevation", "deg"), ("order", "")];
    let against = [("across", 0), ("up", 1)]
        .into_iter()
        .flat_map(|(channel, number)| coordinates.map(|(name, unit)| panels.against(name, unit, channel, number)));
    against.chain([panels.map(), panels.scatter(), panels.distribution()]).collect()
}

/// Stars with the models that are drawn.
struct Panels<'s> {
    stars: &'s [Sighting],
    /// Label and class of each model, its residual, and its sky rms.
    models: Vec<(&'static str, Of, f64)>,
    unit: &'static str,
    /// What the first panel says for all: about the residual before if it is not drawn, and about excluded stars.
    remark: String,
}

impl<'s> Panels<'s> {
    fn of(stars: &'s [Sighting], session: &SessionPlots<'_>) -> Panels<'s> {
        let all: [(&'static str, Of); 2] = [("before", |star| star.before), ("after", |star| star.after)];
        let mut models: Vec<(&'static str, Of, f64)> = all
            .map(|(name, of)| {
                let squares: f64 = stars.iter().map(|star| of(star).iter().map(|v| v * v).sum::<f64>()).sum();
                (name, of, (squares / stars.len() as f64).sqrt())
            })
            .into();
        let unit = session.series.unit.name();
        let mut remark = String::new();
        let (before, after) = (models[0].2, models[1].2);
        if before > MAX_RATIO * after {
            let rms = quantity(&format!("{before:.0}"), unit);
            remark = format!(" The residual before, rms {rms}, is off the scale.");
        }
        if !session.has_change() || !remark.is_empty() {
            models.remove(0);
        }
        let rejected = session.problem.rejected.iter().flatten().filter(|rejected| **rejected).count();
        if rejected > 0 {
            remark.push_str(" Outliers are not shown in these panels.");
        }
        Panels { stars, models, unit, remark }
    }

    /// The largest residual of one channel or of both that is drawn.
    fn largest(&self) -> f64 {
        let of = |(_, of, _): &(&str, Of, f64)| self.stars.iter().flat_map(of).map(f64::abs).fold(0.0, f64::max);
        self.models.iter().map(of).fold(0.0, f64::max)
    }

    /// A scale for residuals of both signs, one for all panels.
    fn residuals(&self) -> Scale {
        Scale::rounded([-self.largest(), self.largest()], 6)
    }

    /// One channel against azimuth, elevation, or the order of the observations.
    fn against(&self, name: &str, unit: &str, channel: &str, number: usize) -> Figure {
        let at = |(k, star): (usize, &Sighting)| match name {
            "azimuth" => star.azimuth_deg,
            "elevation" => star.elevation_deg,
            _ => k as f64 + 1.0,
        };
        let series: Vec<Series> = self
            .models
            .iter()
            .map(|(model, of, _)| {
                let points = self.stars.iter().enumerate().map(|(k, star)| (at((k, star)), of(star)[number]));
                Series::new(*model, model, Mark::Dots, points.collect())
            })
            .collect();
        let x = match name {
            "azimuth" => Scale { step: 90.0, ..Scale::over([0.0, 360.0], 4) },
            "elevation" => {
                let [low, high] = span(self.stars.iter().map(|star| star.elevation_deg));
                let step = 15.0;
                Scale { step, ..Scale::over([(low / step).floor() * step, (high / step).ceil() * step], 6) }
            }
            _ => Scale::over([0.0, self.stars.len() as f64 + 1.0], 6),
        };
        let x_name = if unit.is_empty() { "observation, in the order of the files" } else { name };
        let lines = Lines::new(Axis::new(x_name, unit, x), Axis::new(channel, self.unit, self.residuals()), series);
        let title = format!("Residual {channel} against {name}");
        let caption = match (name, number) {
            ("azimuth", 0) => format!("Across: azimuth times the cosine of the elevation.{}", self.remark),
            _ => String::new(),
        };
        Figure::new(format!("sky-{channel}-over-{name}"), title, caption, lines.sized(Size::SMALL))
    }

    /// The residual as a vector at each star, on a map with the zenith at the centre.
    fn map(&self) -> Figure {
        const CIRCLES: [f64; 3] = [30.0, 60.0, 90.0];
        let length = |[a, b]: [f64; 2]| a.hypot(b);
        let of = |(_, of, _): &(&str, Of, f64)| self.stars.iter().map(|star| length(of(star))).fold(0.0, f64::max);
        let largest = self.models.iter().map(of).fold(0.0, f64::max);
        // A vector of a round size is the key; the longest one is LONGEST_DEG long.
        let round = round_up(largest / 2.0);
        let factor = LONGEST_DEG / largest.max(f64::MIN_POSITIVE);
        let mut series: Vec<Series> =
            CIRCLES.iter().map(|radius| Series::new("", "grid", Mark::Line, circle(*radius))).collect();
        series.extend(self.models.iter().map(|(model, of, _)| {
            let vectors = self.stars.iter().flat_map(|star| {
                let [east, north] = star.on_map();
                let [to_east, to_north] = star.shift_on_map(of(star));
                [(east, north), (east + factor * to_east, north + factor * to_north)]
            });
            Series::new(*model, model, Mark::Vectors, vectors.collect())
        }));
        let stars = self.stars.iter().map(|star| star.on_map().into()).collect();
        series.push(Series::new("", "c5", Mark::Dots, stars));
        let key = [(-92.0, -92.0), (-92.0 + factor * round, -92.0)];
        series.push(Series::new(quantity(&text(round, round), self.unit), "nominal", Mark::Vectors, key.into()));
        let scale = Scale { step: 30.0, ..Scale::over([-98.0, 98.0], 6) };
        let [x, y] = ["east", "north"].map(|to| Axis::new(format!("zenith distance to the {to}"), "deg", scale));
        let caption = "Residual at each star; the zenith is at the centre.";
        let lines = Lines::new(x, y, series).sized(Size::SQUARE);
        Figure::new("sky-map", "Residuals on the sky", caption, lines)
    }

    /// Across against up, with the circles of the rms.
    fn scatter(&self) -> Figure {
        let mut series = Vec::new();
        for (model, of, rms) in &self.models {
            series.push(Series::new(
                *model,
                model,
                Mark::Dots,
                self.stars.iter().map(|star| of(star).into()).collect(),
            ));
            let rms_words = format!("rms {}", quantity(&format!("{rms:.2}"), self.unit));
            series.push(Series::new(rms_words, model, Mark::Line, circle(*rms)));
        }
        let [x, y] = ["across", "up"].map(|channel| Axis::new(channel, self.unit, self.residuals()));
        let lines = Lines::new(x, y, series).sized(Size::SQUARE);
        Figure::new("sky-scatter", "Scatter of the residuals", "The circles have the sky rms as radius.", lines)
    }

    /// The share of stars with a residual of at most a size.
    fn distribution(&self) -> Figure {
        let share = |k: usize| 100.0 * k as f64 / self.stars.len() as f64;
        let mut largest = 0.0_f64;
        let mut series = Vec::new();
        for (model, of, _) in &self.models {
            let mut sizes: Vec<f64> = self.stars.iter().map(|star| of(star)[0].hypot(of(star)[1])).collect();
            sizes.sort_by(f64::total_cmp);
            largest = largest.max(sizes.last().copied().unwrap_or(0.0));
            let steps = sizes.iter().enumerate().flat_map(|(k, size)| [(*size, share(k)), (*size, share(k + 1))]);
            series.push(Series::new(*model, model, Mark::Line, std::iter::once((0.0, 0.0)).chain(steps).collect()));
        }
        let x = Axis::new("size of the residual", self.unit, Scale::rounded([0.0, largest], 5));
        let y = Axis::new("share of stars", "%", Scale { step: 25.0, ..Scale::over([0.0, 100.0], 4) });
        let lines = Lines::new(x, y, series).sized(Size::SQUARE);
        let caption = "Share of stars whose residual is at most so long.";
        Figure::new("sky-distribution", "Distribution of the residuals", caption, lines)
    }
}

/// A circle about zero.
fn circle(radius: f64) -> Vec<(f64, f64)> {
    let angle = |k: usize| std::f64::consts::TAU * k as f64 / CHORDS as f64;
    (0..=CHORDS).map(|k| (radius * angle(k).cos(), radius * angle(k).sin())).collect()
}
