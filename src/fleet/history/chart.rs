//! Control charts of a parameter with limits from its standard uncertainties: Shewhart, and EWMA after Lucas and
//! Saccucci (1990, Technometrics 32, 1).
//!
//! The reference is the weighted mean of the first sessions; its uncertainty enlarges the limits. After a step that
//! was found it is that of the next sessions: the charts watch the machine as it is now.

/// Limit of the Shewhart chart, standard deviations.
pub const SHEWHART_LIMIT: f64 = 3.0;
/// Weight of the present session in the moving average.
pub const EWMA_WEIGHT: f64 = 0.2;
/// Limit of the moving average, standard deviations: an average run of 500 sessions to a false alarm (Lucas and
/// Saccucci 1990, Table 3).
pub const EWMA_LIMIT: f64 = 2.962;
/// Share of an uncertainty below which a deviation is rounding.
const ROUNDING: f64 = 1e-6;
/// Sessions of the reference, or half of all if they are fewer.
const REFERENCE: usize = 6;

/// A session in both charts, in standard deviations of each chart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChartPoint {
    /// Deviation of the session from the reference.
    pub shewhart: f64,
    /// Exponentially weighted moving average of the deviations.
    pub ewma: f64,
}

impl ChartPoint {
    /// Whether one of the charts is beyond its limit.
    pub fn is_out(&self) -> bool {
        self.shewhart.abs() > SHEWHART_LIMIT || self.ewma.abs() > EWMA_LIMIT
    }
}

/// Both charts of a series.
#[derive(Clone, Debug)]
pub struct Charts {
    /// The reference value after the last step.
    pub reference: f64,
    /// The sessions. The average of those of the reference is zero.
    pub points: Vec<ChartPoint>,
}

impl Charts {
    /// The charts of values with their standard uncertainties, which start again at each step.
    pub fn of(values: &[f64], u: &[f64], steps: &[usize]) -> Charts {
        let ends = steps.iter().copied().chain([values.len()]);
        let mut charts = Charts { reference: 0.0, points: Vec::with_capacity(values.len()) };
        for end in ends {
            let start = charts.points.len();
            if let Some((values, u)) = values.get(start..end).zip(u.get(start..end)).filter(|(own, _)| !own.is_empty())
            {
                let part = Charts::between_steps(values, u);
                charts.reference = part.reference;
                charts.points.extend(part.points);
            }
        }
        charts
    }

    fn between_steps(values: &[f64], u: &[f64]) -> Charts {
        let count = REFERENCE.min(values.len() / 2).max(1).min(values.len());
        let weight: f64 = u[..count].iter().map(|u| u.powi(-2)).sum();
        let reference = values[..count].iter().zip(u).map(|(value, u)| value / (u * u)).sum::<f64>() / weight;
        let variance = 1.0 / weight;
        // The reference contains these sessions: the variance of a deviation from it is the difference.
        let beside = |value: f64, u: f64| {
            let deviation = (u * u - variance).max(0.0).sqrt();
            if deviation > ROUNDING * u { (value - reference) / deviation } else { 0.0 }
        };
        let of_reference = values[..count].iter().zip(u);
        let mut points: Vec<ChartPoint> =
            of_reference.map(|(value, u)| ChartPoint { shewhart: beside(*value, *u), ewma: 0.0 }).collect();
        // The average, the variance of its independent part, and its share of the error of the reference.
        let (mut average, mut own, mut shared) = (0.0, 0.0, 0.0);
        for (value, u) in values.iter().zip(u).skip(count) {
            let deviation = (u * u + variance).sqrt();
            let shewhart = (value - reference) / deviation;
            let keep = 1.0 - EWMA_WEIGHT;
            average = keep * average + EWMA_WEIGHT * shewhart;
            own = keep * keep * own + (EWMA_WEIGHT * u / deviation).powi(2);
            shared = keep * shared + EWMA_WEIGHT / deviation;
            points.push(ChartPoint { shewhart, ewma: average / (own + variance * shared * shared).sqrt() });
        }
        Charts { reference, points }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With a reference that is exactly known, the first averages have the closed form λ z₁ / (λ) and their standard
    /// deviation is that of Lucas and Saccucci: √(λ/(2 − λ)·(1 − (1 − λ)²ⁱ)).
    #[test]
    fn the_average_has_its_closed_form() {
        let (mut values, mut u) = (vec![0.0; 6], vec![1e-9; 6]);
        values.extend([1.0, -2.0, 0.5, 4.0, 0.0, 1.5]);
        u.extend([1.0; 6]);
        let charts = Charts::of(&values, &u, &[]);
        let mut average = 0.0;
        for (i, value) in values[6..].iter().enumerate() {
            average = 0.8 * average + 0.2 * value;
            let sigma = (0.2 / 1.8 * (1.0 - 0.8_f64.powi(2 * (i as i32 + 1)))).sqrt();
            assert!((charts.points[6 + i].ewma - average / sigma).abs() < 1e-6);
            assert!((charts.points[6 + i].shewhart - value).abs() < 1e-6);
        }
        assert!(charts.points[9].is_out() && !charts.points[6].is_out());
    }

    /// After a step the charts are those of the later sessions alone.
    #[test]
    fn the_charts_start_again_at_a_step() {
        let later = [0.3, -0.2, 0.5, 0.1, 0.0, 0.4, -0.6, 0.2];
        let values: Vec<f64> = [0.0; 8].into_iter().chain(later.map(|value| value + 20.0)).collect();
        let charts = Charts::of(&values, &[1.0; 16], &[8]);
        assert!(charts.points.iter().all(|point| !point.is_out()));
        assert_eq!(charts.points[8..], Charts::of(&values[8..], &[1.0; 8], &[]).points);
        assert!(Charts::of(&values, &[1.0; 16], &[]).points[15].is_out());
    }
}
