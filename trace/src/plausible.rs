//! Mechanical plausibility of an effect as an explanation, as a prior cost.
//!
//! Readings that do not separate explanations leave the choice to what is known of machines. The cost is `−ln` of the
//! prior probability relative to an error motion of the axis that turns or travels:
//!
//! | effect | cost |
//! |---|---|
//! | an error motion of an axis that follows its own position, or that follows no position | 0 |
//! | a ball, the bar, an instrument that follows the position of an axis | 2 |
//! | an error motion of an axis that follows the position of another axis | 2 |
//! | a location error of one axis, such as a squareness, that follows the position of another axis | 4 |
//!
//! The bearing of an axis makes its error motions. That one axis moves another needs a load that shifts, or a guideway
//! that bends; the squareness of two guideways has no mechanism that follows the angle of a table.

use abbe_model::component::ErrorKind;
use abbe_model::driver::Driver;
use abbe_model::effect::{Component, Effect};

/// The bearing of an axis moves, or the whole machine does.
const OWN: f64 = 0.0;
/// Something follows an axis that is not its own: e⁻², 1 in 7.
const OTHER: f64 = 2.0;
/// A location error follows another axis: e⁻⁴, 1 in 55.
const LOCATION_OF_OTHER: f64 = 4.0;

/// The prior cost of an effect: `−ln` of its relative prior probability.
pub(super) fn prior_cost(effect: &Effect) -> f64 {
    let Driver::Axis(driver) = &effect.driver else { return OWN };
    match &effect.component {
        Component::Axis(name) if name.axis == *driver => OWN,
        Component::Axis(name) if name.kind == ErrorKind::Location => LOCATION_OF_OTHER,
        Component::Axis(_) | Component::Instrument { .. } => OTHER,
        Component::TriggerDelay | Component::Reading(_) => OWN,
    }
}

#[cfg(test)]
mod tests {
    use abbe_model::effect::Shape;
    use abbe_model::effect::shape::Harmonic;

    use super::*;

    #[test]
    fn a_squareness_that_follows_another_axis_is_the_least_plausible() {
        let cost = |component: &str, driver: &str| {
            let component = Component::parse(component).unwrap();
            let shape = Shape::Harmonic(Harmonic { order: 1.0 });
            prior_cost(&Effect::new(component, Driver::parse(driver), shape))
        };
        assert_eq!([cost("EZC", "C"), cost("EA0C", "C"), cost("EZC", "time")], [OWN; 3]);
        assert_eq!([cost("EZZ", "C"), cost("workpiece_ball.z", "C")], [OTHER; 2]);
        assert_eq!([cost("EA0Z", "C"), cost("EZ0A", "C")], [LOCATION_OF_OTHER; 2]);
    }
}
