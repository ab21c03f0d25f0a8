//! The permitted variations of candidate tests: bars, radii, heights, positions, feeds, ranges.

use abbe_model::driver::DriverPart;
use abbe_model::effect::{Component, Effect};

/// The permitted variations. Lengths in mm, times in min.
#[derive(Clone, Debug)]
pub struct TestVariations {
    /// Bars of the kit, nominal lengths.
    pub bars_mm: Vec<f64>,
    /// Distances of the ball from the axis about which it is mounted.
    pub radii_mm: Vec<f64>,
    /// Heights of the ball along that axis, in both directions except below the table.
    pub heights_mm: Vec<f64>,
    /// Positions of the other rotary axis.
    pub standing_deg: Vec<f64>,
    /// Feeds as multiples of that of the session's tests. Several if an effect depends on the feed (see
    /// [`TestVariations::for_effects`]).
    pub feeds: Vec<f64>,
    /// Shares of the sweep range, about its middle.
    pub ranges: Vec<f64>,
    /// Directions of travel: `true` for both, `false` for one.
    pub both_directions: Vec<bool>,
    /// Whether linear axes may follow the swept axis.
    pub follow: bool,
    /// Whether a test may use the spindle ball of the last test without a new mount.
    pub keep_spindle_ball: bool,
    /// Travel of a bar's sensor in either direction.
    pub reach_mm: f64,
    /// Time to mount a ball.
    pub setup_min: f64,
    /// Time to prepare a test: bar, position, feed-in.
    pub test_min: f64,
    /// Only every n-th position is evaluated, and its information counts n times.
    pub thin: usize,
}

impl Default for TestVariations {
    /// A kit of 50, 100, 150 and 300 mm. A new mount takes five minutes, the preparation of a test one minute.
    fn default() -> Self {
        TestVariations {
            bars_mm: vec![50.0, 100.0, 150.0, 300.0],
            radii_mm: vec![50.0, 75.0, 100.0, 150.0],
            heights_mm: vec![0.0, 50.0, 100.0, 200.0],
            standing_deg: vec![0.0, 90.0, -90.0, 180.0],
            feeds: vec![1.0],
            ranges: vec![1.0],
            both_directions: vec![true],
            follow: true,
            keep_spindle_ball: true,
            reach_mm: super::analysis::BAR_TRAVEL_MM,
            setup_min: 5.0,
            test_min: 1.0,
            thin: 1,
        }
    }
}

impl TestVariations {
    /// The same variations with a second feed, if one of the effects depends on speed or time.
    pub fn for_effects<'e>(mut self, effects: impl IntoIterator<Item = &'e Effect>) -> TestVariations {
        let depends = |effect: &Effect| {
            effect.shape.uses() == DriverPart::Rate
                || effect.driver.kind().changes_with_feed()
                || effect.component == Component::TriggerDelay
        };
        if self.feeds.len() == 1 && effects.into_iter().any(depends) {
            self.feeds.push(SECOND_FEED);
        }
        self
    }

    /// Fewer variations and every fourth position: enough to name a test with a result, not to optimise it.
    pub fn short() -> TestVariations {
        TestVariations {
            radii_mm: vec![50.0, 100.0, 150.0],
            heights_mm: vec![0.0, 100.0],
            standing_deg: vec![0.0],
            keep_spindle_ball: false,
            thin: 4,
            ..TestVariations::default()
        }
    }
}

/// The second feed, as a multiple of the first.
const SECOND_FEED: f64 = 3.0;
