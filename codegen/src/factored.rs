//! Coordinate groups of a bar as products of the matrices of the chain, multiplied from the balls outwards and never
//! expanded: the form of the literature.
//!
//! An axis maps a point by `p ↦ t + M·p`. A ball at `(0, R, H − Z)` in the frame of its table is `R` and `H` along the
//! axes of that frame, and the offset `−Z`. With the axes A, then C, one coordinate is
//!
//! ```text
//! t_A + M_A·(t_C + M_C·(0, 0, −Z)) + R·M_A·M_C·(0, 1, 0) + H·M_A·M_C·(0, 0, 1)
//! ```
//!
//! A factor is written in the order number, lengths, errors, cosines, sines, sums; the terms in parentheses in
//! increasing order in the errors. The normal form then proves that the groups equal the chain.

use std::cmp::Reverse;

use abbe_model::Diagnostic;
use abbe_model::frames::Point;
use abbe_model::scalar::Scalar;
use num_rational::BigRational;
use num_traits::{One, Signed};

use crate::collect::{Collector, number_of};
use crate::error;
use crate::form::Arrangement;
use crate::normal_form::Ring;
use crate::polynomial::{Atom, Monomial, Polynomial};
use crate::run::Run;
use crate::symbol::{Operand, Symbol};
use crate::tree::{Tree, product, sum};
use crate::truncation::{FormContext, operands};

/// Largest number of symbols of the three groups together; Eq. 3.20 of Jiang (2014) has 89.
const MAX_SYMBOLS: usize = 1000;

/// A signed product: a coefficient, powers of atoms, and sums in parentheses.
#[derive(Clone)]
struct Term {
    coefficient: BigRational,
    monomial: Monomial,
    sums: Vec<Sum>,
}

type Sum = Vec<Term>;

/// An axis as `p ↦ t + M·p`, in normal form.
struct Affine {
    offset: [Polynomial; 3],
    matrix: [[Polynomial; 3]; 3],
}

/// The three coordinates of the vector from the spindle ball to the workpiece ball.
///
/// # Errors
/// If the subject is no bar, if the groups are too long for a reader, or if the normal form does not prove them.
pub(crate) fn groups<'a>(
    run: &Run<'_, Symbol<'a>>,
    bar: [Operand; 3],
    arrangement: Arrangement,
    written: &FormContext<'a, '_>,
) -> Result<Vec<Tree>, Diagnostic> {
    let &FormContext { arena, inputs, whole, held, .. } = written;
    let form = arrangement.word();
    let Some(station) = run.subject.bar() else {
        return Err(error::no_form(
            form,
            "exists for the length of a ball bar only; use the form frames, or the bilinear order",
        ));
    };
    let mut ring = Ring::exact(arena);
    ring.keep(whole);
    ring.hold(held);
    let machine = run.machine;
    let unknown = |slot: usize| run.unknown(slot);
    let sides = [(&station.workpiece_ball, 0), (&station.spindle_ball, 3)];
    let mut offsets: [Sum; 3] = Default::default();
    let mut lengths: Vec<(bool, Term, [Sum; 3])> = Vec::new();
    for (minus, (ball, first)) in [false, true].into_iter().zip(sides) {
        let axes = machine.carriers(ball.frame);
        let affine = axes.map(|axis| affine(run, &mut ring, axis)).collect::<Result<Vec<_>, _>>()?;
        let [main, mut rest] = split(&mut ring, ball.displaced(first, &unknown))?;
        for axis in &affine {
            rest = moved(&ring, axis, &rest, true);
        }
        for (offset, rest) in offsets.iter_mut().zip(rest) {
            offset.extend(rest.into_iter().map(|term| signed(term, minus)));
        }
        for (coordinate, length) in
            main.into_iter().enumerate().filter_map(|(c, sum)| Some((c, sum.into_iter().next()?)))
        {
            let mut unit: [Sum; 3] = Default::default();
            unit[coordinate] = terms(&ring, &Polynomial::constant(1.0));
            for axis in &affine {
                unit = moved(&ring, axis, &unit, false);
            }
            lengths.push((minus, length, unit));
        }
    }
    let collector = Collector { ring: &ring, inputs };
    lengths.sort_by_key(|(_, length, _)| collector.name(&length.monomial));
    let group = |coordinate: usize| {
        let mut group = offsets[coordinate].clone();
        for (minus, length, along) in &lengths {
            let along = times(&ring, std::slice::from_ref(length), &along[coordinate]);
            group.extend(along.into_iter().map(|term| signed(term, *minus)));
        }
        as_tree(&collector, &group)
    };
    let groups: Vec<Tree> = (0..3).map(group).collect();
    let symbols: usize = groups.iter().map(Tree::leaves).sum();
    if symbols > MAX_SYMBOLS {
        let why = format!(
            "has {symbols} symbols, more than the limit of {MAX_SYMBOLS}; use the form frames, or name fewer errors"
        );
        return Err(error::no_form(form, why));
    }
    let operands = operands(arena, inputs);
    for (group, coordinate) in groups.iter().zip(bar) {
        if !ring.equal_to_rounding(group.symbol(arena, &operands).operand(), coordinate)? {
            let why = "is not proved equal to the chain by the normal form; use the form frames".to_string();
            return Err(error::no_form(form, why));
        }
    }
    Ok(groups)
}

/// The matrix and the offset of an axis: the images of the origin and of the unit vectors.
fn affine<'a>(run: &Run<'_, Symbol<'a>>, ring: &mut Ring<'a>, axis: usize) -> Result<Affine, Diagnostic> {
    let mut image = |unit: Option<usize>| -> Result<[Polynomial; 3], Diagnostic> {
        let point = std::array::from_fn(|i| Symbol::constant(f64::from(u8::from(unit == Some(i)))));
        let [x, y, z] = run.machine.push(axis, &run.state, &run.errors, Point(point)).0;
        Ok([ring.normal_form(x.operand())?, ring.normal_form(y.operand())?, ring.normal_form(z.operand())?])
    };
    let offset = image(None)?;
    let columns = [image(Some(0))?, image(Some(1))?, image(Some(2))?];
    let matrix = std::array::from_fn(|row| std::array::from_fn(|column: usize| &columns[column][row] - &offset[row]));
    Ok(Affine { offset, matrix })
}

/// Splits the coordinates of a ball: one length along each axis of its frame, and everything else. Of a sum such as
/// `H − Z` the first positive length belongs to the ball and the rest offsets the frame.
fn split<'a>(ring: &mut Ring<'a>, ball: Point<Symbol<'a>>) -> Result<[[Sum; 3]; 2], Diagnostic> {
    let (mut main, mut rest): ([Sum; 3], [Sum; 3]) = Default::default();
    for (coordinate, symbol) in ball.0.into_iter().enumerate() {
        let form = ring.normal_form(symbol.operand())?;
        let mut all = terms(ring, &form);
        let nominal = |term: &Term| degree(ring, &term.monomial) == 0;
        let first = all.iter().position(|term| nominal(term) && term.coefficient.is_positive());
        if let Some(first) = first.or_else(|| all.iter().position(nominal)) {
            main[coordinate].push(all.remove(first));
        }
        rest[coordinate] = all;
    }
    Ok([main, rest])
}

/// `M·v`, and `t + M·v` for a point. Columns of lower order in the errors come first.
fn moved(ring: &Ring<'_>, axis: &Affine, vector: &[Sum; 3], point: bool) -> [Sum; 3] {
    std::array::from_fn(|row| {
        let entries = axis.matrix[row].each_ref().map(|entry| terms(ring, entry));
        let mut columns = [0, 1, 2];
        columns.sort_by_key(|column| lowest(ring, &entries[*column]));
        let mut moved = if point { terms(ring, &axis.offset[row]) } else { Sum::new() };
        for column in columns {
            moved.extend(times(ring, &entries[column], &vector[column]));
        }
        moved
    })
}

/// The product of two sums, of which no sum is expanded except by ±1.
fn times(ring: &Ring<'_>, a: &[Term], b: &[Term]) -> Sum {
    if a.is_empty() || b.is_empty() {
        return Sum::new();
    }
    if let ([one], several) | (several, [one]) = (a, b)
        && one.coefficient.abs().is_one()
        && one.monomial.powers().is_empty()
        && one.sums.is_empty()
    {
        return several.iter().map(|term| signed(term.clone(), one.coefficient.is_negative())).collect();
    }
    let (a, b) = (factor(ring, a), factor(ring, b));
    vec![Term {
        coefficient: a.coefficient * b.coefficient,
        monomial: a.monomial.times(&b.monomial),
        sums: [a.sums, b.sums].concat(),
    }]
}

/// A sum as a factor. Most of its terms are positive, the first one is, and they are sorted by their order in the
/// errors.
fn factor(ring: &Ring<'_>, sum: &[Term]) -> Term {
    if let [one] = sum {
        return one.clone();
    }
    let negative = sum.iter().filter(|term| term.coefficient.is_negative()).count();
    let tie = 2 * negative == sum.len();
    let minus = 2 * negative > sum.len() || tie && sum[0].coefficient.is_negative();
    let mut inner: Sum = sum.iter().map(|term| signed(term.clone(), minus)).collect();
    inner.sort_by_key(|term| degree(ring, &term.monomial) + term.sums.iter().map(|s| lowest(ring, s)).sum::<u32>());
    if let Some(first) = inner.iter().position(|term| term.coefficient.is_positive()) {
        let first = inner.remove(first);
        inner.insert(0, first);
    }
    let one = Term { coefficient: BigRational::one(), monomial: Monomial::one(), sums: vec![inner] };
    signed(one, minus)
}

fn signed(mut term: Term, minus: bool) -> Term {
    if minus {
        term.coefficient = -term.coefficient;
    }
    term
}

/// The terms of a polynomial: by order in the errors, cosines before sines.
fn terms(ring: &Ring<'_>, polynomial: &Polynomial) -> Sum {
    let term = |(monomial, coefficient): (&Monomial, &BigRational)| Term {
        coefficient: coefficient.clone(),
        monomial: monomial.clone(),
        sums: Vec::new(),
    };
    let mut terms: Sum = polynomial.terms().map(term).collect();
    let sines = |term: &Term| term.monomial.degree(|atom| matches!(atom, Atom::Sin(_)));
    terms.sort_by_key(|term| (degree(ring, &term.monomial), sines(term)));
    terms
}

/// Order in the errors; the cosine of an error has order zero.
fn degree(ring: &Ring<'_>, monomial: &Monomial) -> u32 {
    monomial.degree(|atom| ring.is_small(atom) && !matches!(atom, Atom::Cos(_)))
}

fn lowest(ring: &Ring<'_>, sum: &[Term]) -> u32 {
    sum.iter().map(|term| degree(ring, &term.monomial)).min().unwrap_or(0)
}

fn as_tree(collector: &Collector<'_, '_>, terms: &[Term]) -> Tree {
    let tree = |term: &Term| {
        let (number, rest) = number_of(&term.monomial, &term.coefficient);
        let mut atoms: Vec<&(Atom, u32)> = rest.powers().iter().collect();
        atoms.sort_by_key(|(atom, _)| class(collector, *atom));
        let mut factors = Vec::new();
        if number != 1.0 || atoms.is_empty() && term.sums.is_empty() {
            factors.push(Tree::Number(number));
        }
        factors.extend(atoms.into_iter().flat_map(|power| collector.powers(&Monomial(vec![*power]))));
        factors.extend(term.sums.iter().map(|inner| as_tree(collector, inner)));
        (term.coefficient.is_negative(), product(factors))
    };
    sum(terms.iter().map(tree).collect())
}

/// Place of an atom in a product: lengths, errors, cosines, sines; of two axes the outer one first.
fn class(collector: &Collector<'_, '_>, atom: Atom) -> (u8, Reverse<usize>, usize) {
    let index =
        |id| collector.inputs.iter().position(|input| input.variable() == collector.ring.variable(id)).unwrap_or(0);
    match atom {
        _ if collector.ring.is_small(atom) => match atom {
            Atom::Variable(id) | Atom::Cos(id) | Atom::Sin(id) => (1, Reverse(0), index(id)),
            Atom::Root(_) | Atom::Function(_) => (1, Reverse(0), 0),
        },
        Atom::Cos(id) => (2, Reverse(index(id)), 0),
        Atom::Sin(id) => (3, Reverse(index(id)), 0),
        Atom::Variable(id) => (0, Reverse(0), index(id)),
        Atom::Root(_) | Atom::Function(_) => (0, Reverse(0), usize::MAX),
    }
}
