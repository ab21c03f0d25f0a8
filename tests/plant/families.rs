//! The families of effects that affect each kind of session, drawn at random or listed.

use super::component::{AxisName, Cartesian, Component, Freedom};
use super::effect::{Decay, Driver, Injected, Profile, Shape};
use super::kind::Kind;
use rand::{Rng, RngExt};

/// A family of effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Family {
    /// An error motion at orders 1 to 8, 17 or 36 of a rotary axis.
    Harmonic,
    /// An error motion as a power of the position of its own axis; scale error and bow of a linear axis.
    Polynomial,
    /// A periodic error whose period divides neither a turn nor the travel.
    Periodic,
    /// Lost motion, in any component.
    Backlash,
    /// A servo lag.
    Lag,
    /// A reversal spike: the axis sticks at reversal.
    ReversalSpike,
    /// A local feature.
    Local,
    /// Steps, as from a compensation table.
    Steps,
    /// A location error, a ball or the bar that drifts with time.
    Drift,
    /// A warm-up: the same with an exponential approach to a limit.
    Warmup,
    /// A bar with thermal expansion.
    Temperature,
    /// Compliance under the weight on the table.
    Gravity,
    /// A location error of C that depends on A.
    CrossAxis,
    /// Squareness of Y to X.
    Squareness,
    /// A ball that moves between two tests of one set-up.
    Remount,
    /// The gain error of the sensor.
    SensorGain,
    /// The delay of the sensor reading.
    TriggerDelay,
}

impl Family {
    /// The families that can affect a kind of session. The oracle decides whether a member is detectable.
    pub fn of(kind: Kind) -> Vec<Family> {
        use Family::*;
        let always = [Polynomial, Periodic, Backlash, ReversalSpike, Local, Steps, Drift, Warmup, Temperature, Remount];
        let special: &[Family] = match kind {
            Kind::Rotary => &[Harmonic, Gravity, CrossAxis],
            Kind::TiltedTable => &[Harmonic, Gravity, CrossAxis],
            // With a mount for each test no mount is shared between tests.
            Kind::Chapter4 | Kind::Chapter6 => &[Harmonic, Gravity],
            Kind::LinearCircles => &[Lag, Squareness],
            Kind::SquarenessCircles => &[Lag],
            Kind::EccentricCircles => &[Lag, Squareness, SensorGain, TriggerDelay],
            Kind::Simultaneous => &[Harmonic, Lag, Squareness],
        };
        always
            .into_iter()
            .filter(|family| kind != Kind::Chapter6 || *family != Remount)
            .chain(special.iter().copied())
            .collect()
    }
}

/// A random effect of a random family that can affect this kind of session, at unit amplitude.
pub fn random_effect(kind: Kind, random: &mut impl Rng) -> Injected {
    let families = Family::of(kind);
    let family = pick(&families, random);
    random_member(family, kind, random)
}

/// A random member of a family, at unit amplitude.
pub fn random_member(family: Family, kind: Kind, random: &mut impl Rng) -> Injected {
    let axis = pick(&kind.moving_axes(), random);
    let own = Driver::Axis(axis);
    let motion = Component::Motion(pick(&Freedom::ALL, random), axis);
    let thermal = pick(&thermal_components(kind), random);
    let phase_deg = 360.0 * random.random::<f64>();
    let effect = |component, driver, shape| Injected::new(component, driver, shape, 1.0);
    match family {
        Family::Harmonic => {
            let rotary: Vec<AxisName> = kind.moving_axes().into_iter().filter(|axis| axis.is_rotary()).collect();
            let axis = pick(&rotary, random);
            let order = pick(&[1, 2, 3, 4, 5, 6, 7, 8, 17, 36], random);
            let component = Component::Motion(pick(&Freedom::ALL, random), axis);
            effect(component, Driver::Axis(axis), Shape::Harmonic { order, phase_deg })
        }
        Family::Polynomial => effect(motion, own, Shape::Polynomial { degree: pick(&[1, 2, 3], random) }),
        Family::Periodic => {
            let period = period(kind, axis) * (1.0 + random.random::<f64>());
            effect(motion, own, Shape::Periodic { period, phase_deg })
        }
        Family::Backlash => effect(motion, own, Shape::Backlash),
        Family::Lag => effect(Component::Motion(axis.own_freedom(), axis), own, Shape::Lag),
        Family::ReversalSpike => {
            let decay = if random.random() {
                Decay::Time(0.3 + 0.7 * random.random::<f64>())
            } else {
                Decay::Way(2.0 + 6.0 * random.random::<f64>())
            };
            effect(motion, own, Shape::ReversalSpike { decay })
        }
        Family::Local => {
            let [low, high] = range(kind, axis);
            let centre = low + (high - low) * (0.15 + 0.7 * random.random::<f64>());
            let width = (high - low) * (0.03 + 0.05 * random.random::<f64>());
            let profile = pick(&[Profile::Gaussian, Profile::RaisedCosine], random);
            effect(motion, own, Shape::Local { centre, width, profile })
        }
        Family::Steps => {
            let [low, high] = range(kind, axis);
            let count = pick(&[3, 4, 5], random);
            let at = (0..count)
                .map(|k| low + (high - low) * (f64::from(k) + 0.2 + 0.6 * random.random::<f64>()) / f64::from(count))
                .collect();
            let heights = (0..count).map(|_| pick(&[-1.0, 1.0], random) * (0.5 + random.random::<f64>())).collect();
            effect(motion, own, Shape::Steps { at, heights })
        }
        Family::Drift => effect(thermal, Driver::Time, Shape::Drift),
        Family::Warmup => {
            let tau_s = if kind.moving_axes()[0].is_rotary() { 300.0 } else { 60.0 };
            effect(thermal, Driver::Time, Shape::Warmup { tau_s: tau_s * (0.5 + random.random::<f64>()) })
        }
        Family::Temperature => effect(Component::Bar, Driver::Temperature, Shape::Polynomial { degree: 1 }),
        Family::Gravity => {
            let freedom = pick(&[Freedom::Y, Freedom::Z, Freedom::A, Freedom::B, Freedom::C], random);
            let component = Component::Motion(freedom, AxisName::A);
            effect(component, Driver::Gravity, Shape::Polynomial { degree: 1 })
        }
        Family::CrossAxis => {
            let freedom = pick(&[Freedom::X, Freedom::Y, Freedom::A, Freedom::B], random);
            let component = Component::Location(freedom, AxisName::C);
            let shape = if random.random() {
                Shape::Polynomial { degree: pick(&[1, 2], random) }
            } else {
                Shape::Harmonic { order: pick(&[1, 2], random), phase_deg }
            };
            effect(component, Driver::Axis(AxisName::A), shape)
        }
        Family::Squareness => effect(Component::Location(Freedom::C, AxisName::Y), Driver::Nothing, Shape::Constant),
        Family::Remount => {
            let tests = kind.tests(10.0);
            let shared: Vec<usize> = (0..tests.len() - 1).filter(|k| tests[*k].setup == tests[k + 1].setup).collect();
            let after_test = pick(&shared, random);
            let letter = Cartesian(pick(&[0, 1, 2], random));
            let component = pick(&[Component::WorkpieceBall(letter), Component::SpindleBall(letter)], random);
            effect(component, Driver::Time, Shape::Remount { after_test })
        }
        Family::SensorGain => effect(Component::Sensor, Driver::Nothing, Shape::Constant),
        Family::TriggerDelay => effect(Component::Trigger, Driver::Nothing, Shape::Constant),
    }
}

/// An effect that no entry of the library describes, at unit amplitude: a harmonic whose amplitude varies with time, a
/// chirp along a turn (which only a nonparametric curve describes), or plateaus whose levels differ between tests.
pub fn outside_library(kind: Kind, random: &mut impl Rng) -> Injected {
    let axis = *kind.moving_axes().last().unwrap_or(&AxisName::C);
    let freedom = if axis.is_rotary() { Freedom::X } else { axis.own_freedom() };
    let component = Component::Motion(freedom, axis);
    let [low, high] = range(kind, axis);
    let shape = match random.random_range(0..3) {
        0 if axis.is_rotary() => {
            Shape::Modulated { order: random.random_range(4..8), period_s: 150.0 + 150.0 * random.random::<f64>() }
        }
        1 if axis.is_rotary() => Shape::Chirp { cycles: 8.3 + 5.0 * random.random::<f64>() },
        _ => Shape::Plateaus {
            edges: (1..8).map(|k| low + (high - low) * (f64::from(k) + 0.4 * random.random::<f64>()) / 8.4).collect(),
            levels: (0..8).map(|_| 2.0 * random.random::<f64>() - 1.0).collect(),
            sharpness: 25.0 / (high - low),
        },
    };
    Injected::new(component, Driver::Axis(axis), shape, 1.0)
}

/// All effects of the plant that can be confounded with `like` in a kind of session, at unit amplitude: all components
/// of all moving axes with harmonics, polynomials, backlash and lag; location errors, balls and bar that drift, warm up
/// or are remounted; constants; and, if the shape of `like` has positions or periods, that shape in every other
/// component.
pub fn catalogue(kind: Kind, like: &Injected) -> Vec<Injected> {
    let mut entries = Vec::new();
    let mut shapes = vec![Shape::Backlash, Shape::Lag];
    shapes.extend((1..=4).map(|degree| Shape::Polynomial { degree }));
    let orders: Vec<u32> = (1..=12).chain([17, 36]).collect();
    let has_places = !matches!(
        like.shape,
        Shape::Constant | Shape::Polynomial { .. } | Shape::Harmonic { .. } | Shape::Backlash | Shape::Lag
    );
    let driven_by_axis = matches!(like.driver, Driver::Axis(_));
    if has_places && driven_by_axis {
        shapes.push(like.shape.clone());
    }
    let mut add = |component, driver, shape: &Shape| {
        entries.push(Injected::new(component, driver, shape.clone(), 1.0));
    };
    for axis in kind.moving_axes() {
        for component in Freedom::ALL.map(|freedom| Component::Motion(freedom, axis)) {
            shapes.iter().for_each(|shape| add(component, Driver::Axis(axis), shape));
            if axis.is_rotary() {
                for order in &orders {
                    add(component, Driver::Axis(axis), &Shape::Harmonic { order: *order, phase_deg: 0.0 });
                }
            }
        }
    }
    let mut slow = vec![Shape::Drift];
    if has_places && like.driver == Driver::Time && like.shape != Shape::Drift {
        slow.push(like.shape.clone());
    } else {
        slow.push(Shape::Warmup { tau_s: 300.0 });
    }
    for component in thermal_components(kind) {
        slow.iter().for_each(|shape| add(component, Driver::Time, shape));
        add(component, Driver::Temperature, &Shape::Polynomial { degree: 1 });
        add(component, Driver::Nothing, &Shape::Constant);
    }
    for component in Freedom::ALL.map(|freedom| Component::Motion(freedom, AxisName::A)) {
        add(component, Driver::Gravity, &Shape::Polynomial { degree: 1 });
    }
    for component in Freedom::ALL.map(|freedom| Component::Location(freedom, AxisName::C)) {
        for degree in 1..=2 {
            add(component, Driver::Axis(AxisName::A), &Shape::Polynomial { degree });
            add(component, Driver::Axis(AxisName::A), &Shape::Harmonic { order: degree, phase_deg: 0.0 });
        }
    }
    for component in [Component::Sensor, Component::Trigger] {
        add(component, Driver::Nothing, &Shape::Constant);
    }
    entries
}

/// All effects that a trace searches in a kind of session, at unit amplitude, with the numbers of shapes on grids on which
/// little of a gain is lost: periods a quarter of a cycle over the travel apart, local features half a width apart in three
/// widths, single steps, decays of reversal spikes, time constants.
pub fn library(kind: Kind) -> Vec<Injected> {
    let mut entries = catalogue(kind, &Injected::new(Component::Bar, Driver::Nothing, Shape::Constant, 1.0));
    entries.retain(|entry| !matches!(entry.shape, Shape::Warmup { .. }));
    let mut add = |component, driver, shape| entries.push(Injected::new(component, driver, shape, 1.0));
    for axis in kind.moving_axes() {
        let [low, high] = range(kind, axis);
        let span = high - low;
        let mut shapes = Vec::new();
        let most = (4.0 * span / period(kind, axis)) as usize;
        let period = |quarters: usize| 4.0 * span / quarters as f64;
        shapes.extend((4..=most).map(|quarters| Shape::Periodic { period: period(quarters), phase_deg: 0.0 }));
        for width in [0.03, 0.05, 0.08].map(|share| share * span) {
            let count = (2.0 * span / width) as usize;
            let centre = |k: usize| low + span * (k as f64 + 0.5) / count as f64;
            let profile = Profile::RaisedCosine;
            shapes.extend((0..count).map(|k| Shape::Local { centre: centre(k), width: 1.8 * width, profile }));
        }
        let at = |k: u32| low + span * f64::from(k) / 40.0;
        shapes.extend((1..40).map(|k| Shape::Steps { at: vec![at(k)], heights: vec![1.0] }));
        let decays = [Decay::Time(0.4), Decay::Time(0.8), Decay::Way(2.5), Decay::Way(4.0), Decay::Way(6.5)];
        shapes.extend(decays.map(|decay| Shape::ReversalSpike { decay }));
        for component in Freedom::ALL.map(|freedom| Component::Motion(freedom, axis)) {
            shapes.iter().for_each(|shape| add(component, Driver::Axis(axis), shape.clone()));
        }
    }
    for component in thermal_components(kind) {
        for tau_s in [30.0, 60.0, 120.0, 240.0, 480.0, 960.0] {
            add(component, Driver::Time, Shape::Warmup { tau_s });
        }
        if !matches!(component, Component::Location(..) | Component::Bar) {
            for after_test in 0..kind.tests(10.0).len() - 1 {
                add(component, Driver::Time, Shape::Remount { after_test });
            }
        }
    }
    entries
}

/// Components that can drift: location errors of the moving axes (and squareness of Y), both balls, the bar.
pub fn thermal_components(kind: Kind) -> Vec<Component> {
    let mut components = vec![Component::Bar];
    for i in 0..3 {
        components.push(Component::WorkpieceBall(Cartesian(i)));
        components.push(Component::SpindleBall(Cartesian(i)));
    }
    for axis in kind.moving_axes() {
        if axis.is_rotary() {
            components.extend(Freedom::ALL.map(|freedom| Component::Location(freedom, axis)));
        }
    }
    if kind.moving_axes().contains(&AxisName::Y) {
        components.push(Component::Location(Freedom::C, AxisName::Y));
    }
    components
}

/// The travel of an axis, mm or degree.
fn range(kind: Kind, axis: AxisName) -> [f64; 2] {
    match (axis, kind) {
        (AxisName::C, _) => [0.0, 360.0],
        (AxisName::A, _) => [-20.0, 70.0],
        _ => [-100.0, 100.0],
    }
}

/// The shortest period of a periodic error, mm or degree, that 1,500 readings resolve.
fn period(kind: Kind, axis: AxisName) -> f64 {
    match (axis, kind) {
        (AxisName::A | AxisName::C, _) => 9.7,
        (_, Kind::Simultaneous) => 47.0,
        _ => 8.3,
    }
}

fn pick<T: Clone>(from: &[T], random: &mut impl Rng) -> T {
    from[random.random_range(0..from.len())].clone()
}
