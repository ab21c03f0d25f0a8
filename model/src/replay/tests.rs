//! Every operation of a replay against the same arithmetic on plain numbers, bit by bit.

use super::Replay;
use crate::expression::{Arena, Operand, Symbol};
use crate::scalar::Nominal;

/// Sums and differences of all kinds of terms over four blocks and four numbers, and what is joined in pairs.
fn calculation<N: Nominal>([w, x, y, z]: [N; 4], [r, s, t, u]: [N; 4]) -> Vec<N> {
    let mut all = vec![w, r, w + r, w - r, r - w, w * r, r * w, w / r, r / w, w * x, w / x, -w, w.sqrt(), r * s - t];
    // The functions give every use a product of its own, so that it can be fused.
    let terms: [fn([N; 4], [N; 4]) -> N; 8] = [
        |[w, ..], _| w,
        |_, [r, ..]| r,
        |[w, x, ..], _| w * x,
        |[w, ..], [r, ..]| r * w,
        |[_, _, y, _], _| y,
        |_, [_, s, ..]| s,
        |[_, _, y, z], _| y * z,
        |[_, x, ..], [_, s, ..]| x * s,
    ];
    let (blocks, numbers) = ([w, x, y, z], [r, s, t, u]);
    for a in terms {
        for b in terms {
            // A factor of its own, in which the two products of a pair differ from those of the others.
            let shifted = blocks.map(|block| block + N::constant(all.len() as f64));
            all.push(a(shifted, numbers) + b(shifted, numbers));
            let shifted = blocks.map(|block| block - N::constant(all.len() as f64));
            all.push(a(shifted, numbers) - b(shifted, numbers));
        }
    }
    // Pairs, each over factors of its own: the components of a turned vector in all orders and signs, and combinations
    // of the same two blocks.
    let pairs: [fn([N; 4], [N; 4]) -> [N; 2]; 8] = [
        |[w, x, y, z], _| [w * y - x * z, w * z + x * y],
        |[w, x, y, z], _| [z * x + w * y, x * y - w * z],
        |[w, x, y, z], _| [y * w - z * x, x * y + z * w],
        |[w, x, y, z], _| [w * x + y * z, z * x - y * w],
        |[w, x, ..], [r, s, t, u]| [r * w + s * x, t * w - u * x],
        |[w, x, ..], [r, s, t, u]| [w * r - s * x, x * t + w * u],
        |[w, x, ..], [r, s, t, _]| [s * x - r * w, x * s - t * w],
        |[w, ..], [r, s, t, u]| [r * w + s * (-w), t * w - u * (-w)],
    ];
    for pair in pairs {
        all.extend(pair(blocks.map(|block| block + N::constant(-0.5 - all.len() as f64)), numbers));
    }
    all
}

#[test]
fn every_operation_is_that_of_plain_numbers() {
    let rows = 300;
    let column = |k: usize| -> Vec<f64> { (0..rows).map(|i| 2.0 + ((7 * i + 13 * k) as f64 * 0.37).sin()).collect() };
    let columns: [Vec<f64>; 4] = std::array::from_fn(column);
    let numbers = [1.7, 0.3, 2.9, 1.1];
    let arena: Arena<usize> = Arena::new();
    let symbols = |first: usize| std::array::from_fn(|k| arena.variable(first + k));
    let outputs: Vec<Operand> =
        calculation::<Symbol<'_, usize>>(symbols(0), symbols(4)).into_iter().map(Symbol::operand).collect();
    let replay = Replay::new(&arena, &outputs, |variable| *variable < 4);
    let mut found = vec![vec![f64::NAN; rows]; outputs.len()];
    replay.run(
        rows,
        |variable| numbers[*variable - 4],
        |variable| &columns[*variable],
        |output, start, values| found[output][start..start + values.len()].copy_from_slice(values),
    );
    for row in 0..rows {
        let expected = calculation([0, 1, 2, 3].map(|k: usize| columns[k][row]), numbers);
        for (output, expected) in expected.into_iter().enumerate() {
            let found = found[output][row];
            assert!(found == expected || found.is_nan() && expected.is_nan(), "{output}: {found} {expected}");
        }
    }
    let joined = replay.steps.iter().filter(|step| step.second.is_some()).count();
    assert!(joined >= 7, "{joined} pairs");
}
