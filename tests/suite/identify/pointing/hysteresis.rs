//! Hysteresis of the drives of a mount: `trace` on stars of rotation matrices in random order, with an axis that lags behind
//! by the direction of its last move, and without it.

use abbe::trace::result::{EffectResult, TraceResult};
use abbe::trace::{TraceOptions, trace};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

use super::{observed, simulated};

/// Noise of a coordinate of a star, arcsec.
const NOISE: f64 = 0.5;
/// Lost motion, arcsec.
const LOST: f64 = 3.0;
const STARS: usize = 80;

/// A night of stars in random order. `lost` is the lost motion of azimuth and elevation.
fn night(seed: u64, lost: [f64; 2]) -> TraceResult {
    let mut generator = Pcg64::seed_from_u64(seed);
    let mut at: [f64; 2] = [0.0, 50.0];
    let stars: Vec<[f64; 4]> = (0..STARS)
        .map(|_| {
            let next = [360.0 * generator.random::<f64>(), 20.0 + 65.0 * generator.random::<f64>()];
            let behind = [0, 1].map(|axis| next[axis] - (next[axis] - at[axis]).signum() * lost[axis] / 2.0 / 3600.0);
            at = next;
            let [azimuth, elevation] = observed(behind, [2e-4, -1.5e-4, 3e-4, 1e-4, -2.5e-4, 1.2e-4]);
            let mut noise = || NOISE / 3600.0 * generator.sample::<f64, _>(StandardNormal);
            [next[0], next[1], azimuth + noise() / elevation.to_radians().cos(), elevation + noise()]
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let session = simulated(folder.path(), &stars, "noise_arcsec = 0.5\n");
    trace(&session, &TraceOptions::default(), &|_| true).unwrap().result
}

fn id(effect: &EffectResult) -> String {
    format!("{}~{}:{}", effect.name.component, effect.name.driver, effect.name.shape)
}

fn ids(result: &TraceResult) -> Vec<String> {
    result.effects.iter().map(id).collect()
}

#[test]
fn the_hysteresis_of_a_drive_is_found_and_none_is_claimed_without_it() {
    const NIGHTS: u64 = 20;
    for (axis, lost, name) in [(0, [LOST, 0.0], "ECAZ~AZ:backlash"), (1, [0.0, LOST], "EBEL~EL:backlash")] {
        let (mut found, mut alone, mut inside) = (0, 0, 0);
        for seed in 0..NIGHTS {
            let result = night(seed, lost);
            let effect = result.effects.iter().find(|effect| id(effect) == name);
            found += u64::from(effect.is_some());
            alone += u64::from(effect.is_some() && result.effects.len() == 1);
            if let Some(value) = effect.map(|effect| &effect.parameters[0]) {
                inside += u64::from((value.value.abs() - LOST).abs() < 2.0 * value.u);
            } else {
                println!("axis {axis}, night {seed}: {:?}", ids(&result));
            }
        }
        println!("{name}: found on {found} of {NIGHTS} nights, alone on {alone}, within 2 u on {inside}");
        assert!(found >= 19 && alone >= 17 && inside >= 16, "{name}: {found} {alone} {inside}");
    }
    let claims: Vec<TraceResult> = (100..100 + NIGHTS).map(|seed| night(seed, [0.0; 2])).collect();
    let claimed: Vec<Vec<String>> = claims.iter().map(ids).filter(|ids| !ids.is_empty()).collect();
    println!("without hysteresis: {claimed:?} of {NIGHTS} nights");
    assert!(claimed.len() <= 1, "{claimed:?}");
}
