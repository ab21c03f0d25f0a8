//! Properties of random calculations: recorded, folded, differentiated and evaluated over columns, they agree with
//! plain and dual numbers.

use abbe_model::expression::{Arena, Operand, Symbol};
use abbe_model::replay::Replay;
use abbe_model::scalar::{Nominal, Scalar};
use num_dual::Dual64;
use proptest::collection::vec;
use proptest::prelude::*;

use super::machines::cases;

/// Numbers that folding treats differently.
const CONSTANTS: [f64; 8] = [0.0, 1.0, -1.0, 2.0, 0.5, -0.25, 3.0, 0.7];
const VARIABLES: usize = 3;
const ROWS: usize = 300;

/// A sequence of operations, each on two earlier values: constants, variables and results.
fn calculated<S: Scalar>(operations: &[(u8, u16, u16)], variables: [S; VARIABLES]) -> Vec<S> {
    let mut places: Vec<S> = CONSTANTS.map(S::constant).into();
    places.extend(variables);
    for (operation, a, b) in operations {
        // Recent values more often than old ones, so that expressions grow.
        let of = |place: &u16| {
            let near = usize::from(*place) % places.len().min(24);
            places[if place.is_multiple_of(2) { places.len() - 1 - near } else { near % places.len() }]
        };
        let (x, y) = (of(a), of(b));
        // Values stay bounded, and roots and quotients stay away from their singularities.
        let positive = S::constant(1.0) + y * y;
        places.push(match operation % 8 {
            0 => x + y,
            1 => x - y,
            2 | 3 => x * y / (S::constant(1.0) + x * x).sqrt(),
            4 => x / positive,
            5 => (positive + x * x).sqrt(),
            6 => x.sin_cos().0 - y.sin_cos().1,
            _ => -x,
        });
    }
    places.split_off(CONSTANTS.len() + VARIABLES)
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * (1.0 + a.abs().max(b.abs()))
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn a_replay_is_the_calculation_and_its_gradient_that_of_dual_numbers(
        operations in vec((any::<u8>(), any::<u16>(), any::<u16>()), 1..40),
        values in vec(-3.0..3.0_f64, VARIABLES),
    ) {
        let arena = Arena::new();
        let variables: [Symbol<'_, usize>; VARIABLES] = std::array::from_fn(|number| arena.variable(number));
        let outputs: Vec<Operand> = calculated(&operations, variables).iter().map(|symbol| symbol.operand()).collect();
        let by = variables.map(|variable| variable.operand());
        let gradient = arena.gradient(outputs[outputs.len() - 1], &by);
        let all: Vec<Operand> = outputs.iter().copied().chain(gradient).collect();
        // The first variable varies between rows, over more than two blocks and not a whole number of them.
        let replay = Replay::new(&arena, &all, |number| *number == 0);
        let column: Vec<f64> = (0..ROWS).map(|row| values[0] + 0.01 * row as f64).collect();
        let mut found = vec![vec![f64::NAN; ROWS]; all.len()];
        replay.run(ROWS, |number| values[*number], |_| &column, |output, start, block| {
            found[output][start..start + block.len()].copy_from_slice(block);
        });
        for row in [0, 1, 127, 128, 255, 256, ROWS - 1] {
            let at = [column[row], values[1], values[2]];
            for (output, value) in calculated(&operations, at).iter().enumerate() {
                prop_assert!(close(found[output][row], *value), "{output}: {} {value}", found[output][row]);
            }
            for seeded in 0..VARIABLES {
                let dual: [Dual64; VARIABLES] =
                    std::array::from_fn(|i| Dual64::new(at[i], f64::from(u8::from(i == seeded))));
                let Some(last) = calculated(&operations, dual).pop() else { continue };
                let slope = found[outputs.len() + seeded][row];
                prop_assert!(close(slope, last.eps), "by {seeded}: {slope} {}", last.eps);
            }
        }
    }

    #[test]
    fn limits_apply_on_both_sides(value in -3.0..3.0_f64, limit in -3.0..3.0_f64) {
        prop_assert_eq!(Nominal::at_most(value, limit), value.min(limit));
        prop_assert_eq!(Nominal::at_least(value, limit), value.max(limit));
        // Symbols have no order, so their minimum and maximum consist of steps.
        let arena = Arena::new();
        let variable: Symbol<'_, ()> = arena.variable(());
        let outputs = [variable.at_most(limit), variable.at_least(limit)].map(|symbol| symbol.operand());
        let mut found = [f64::NAN; 2];
        let column = [value];
        let replay = Replay::new(&arena, &outputs, |()| true);
        replay.run(1, |()| value, |()| &column, |output, _, block| found[output] = block[0]);
        prop_assert!((found[0] - value.min(limit)).abs() < 1e-14, "{}", found[0]);
        prop_assert!((found[1] - value.max(limit)).abs() < 1e-14, "{}", found[1]);
    }
}
