//! The true effect of a draw: its readings alone, and whether another effect is the same under another name.

use abbe_identify::fit;
use abbe_identify::noise::{Noise as NoiseModel, NoiseSource};
use abbe_identify::problem::Problem;
use abbe_identify::quantity::Given;
use abbe_identify::simulate::{Simulation, simulate};
use abbe_model::Diagnostic;
use abbe_model::effect::Effect;
use abbe_model::session::Session;

use super::file::Noise;

/// Largest share of the χ² of the true effect that an equal effect of another name leaves: a cosine of 0.99.
const EQUAL: f64 = 0.02;
/// The true effect of a draw.
pub(super) struct DrawnEffect {
    /// Its identifier.
    pub id: String,
    /// Readings of the effect alone, without noise.
    alone: Session,
    noise_mm: f64,
    /// χ² that it leaves beside the parameters of the plan.
    chi_square: f64,
}

impl DrawnEffect {
    /// The last effect of a machine with its coefficients.
    pub fn of(
        plan: &Session,
        machine: &Session,
        id: String,
        coefficients: Vec<Given>,
        noise_mm: f64,
    ) -> Result<DrawnEffect, Diagnostic> {
        let alone = alone(plan, machine, coefficients)?;
        let chi_square = chi_square(&alone, noise_mm)?;
        Ok(DrawnEffect { id, alone, noise_mm, chi_square })
    }

    /// Whether an effect changes the readings as this one does, beside the parameters of the plan. An effect that cannot
    /// be fitted to it does not.
    pub fn is_equal(&self, effect: &Effect) -> bool {
        let mut with = self.alone.clone();
        with.effects.push(effect.clone());
        chi_square(&with, self.noise_mm).is_ok_and(|left| left <= EQUAL * self.chi_square)
    }
}

/// The readings of a plan on a machine with given coefficients and no other error, without noise.
pub(super) fn alone(plan: &Session, machine: &Session, given: Vec<Given>) -> Result<Session, Diagnostic> {
    let exact = Simulation { given, noise_mm: Some(0.0), ..Simulation::default() };
    let exact_machine = Session { resolution_mm: None, ..machine.clone() };
    let readings = simulate(&exact_machine, &exact)?.readings;
    Ok(Session { resolution_mm: None, ..plan.clone().with_readings(readings) })
}

/// The noise of a study in mm. It is not zero, so that χ² is finite.
pub(super) fn noise_mm(noise: &Noise) -> f64 {
    noise.um.0.max(1e-3) * 1e-3
}

/// χ² of the fit of a session. The model has no noise to estimate: it is stated.
pub(super) fn chi_square(session: &Session, noise_mm: f64) -> Result<f64, Diagnostic> {
    let problem = Problem::new(session, NoiseModel::white(noise_mm, NoiseSource::Stated), 1)?;
    Ok(fit::fit(&problem, None)?.chi_square)
}

#[cfg(test)]
mod tests {
    use abbe_files::ReadOptions;
    use abbe_trace::TraceOptions;
    use abbe_trace::screening::screened_effects;

    use super::*;

    /// A wave with a period of half a turn is the second harmonic. One of 0.9 times that period is not, and neither is
    /// the third harmonic.
    #[test]
    fn an_equal_effect_has_any_name() {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("sessions/hermle-c600u/measured/session.toml");
        let plan = abbe_files::session(&file, &ReadOptions::default()).unwrap();
        let library = screened_effects(&plan, &TraceOptions::default()).unwrap();
        let named = |id: &str| library.iter().find(|effect| effect.effect.id() == id).unwrap().effect.clone();
        let harmonic = named("EZC~C:h2");
        let mut machine = plan.clone();
        machine.effects.push(harmonic.clone());
        let given = [("EZC~C:h2.cos", 1.5), ("EZC~C:h2.sin", 0.5)].map(|(id, value)| Given {
            id: id.to_string(),
            value,
            unit: "um".to_string(),
        });
        let truth = DrawnEffect::of(&plan, &machine, harmonic.id(), given.to_vec(), 3e-4).unwrap();
        assert!(truth.chi_square > 100.0);
        let mut wave = named("EZC~C:periodic");
        wave.shape = wave.shape.with_number(0, std::f64::consts::PI);
        assert_ne!(wave.id(), truth.id);
        assert!(truth.is_equal(&harmonic) && truth.is_equal(&wave));
        wave.shape = wave.shape.with_number(0, 0.9 * std::f64::consts::PI);
        assert!(!truth.is_equal(&wave) && !truth.is_equal(&named("EZC~C:h3")));
    }
}
