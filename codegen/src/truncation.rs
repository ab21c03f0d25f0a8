//! Truncated forms: built from the normal form, arranged for printing, and put back into the arena for code.

use abbe_model::Diagnostic;
use abbe_model::scalar::Nominal;

use crate::collect::Collector;
use crate::first_order::{Column, FirstOrder};
use crate::form::{Form, PrintedFirstOrder};
use crate::normal_form::Ring;
use crate::polynomial::Polynomial;
use crate::program::Input;
use crate::run::Run;
use crate::symbol::{Arena, Binary, Operand, Symbol, Unary};
use crate::tree::{Tree, binary, product, sum};
use crate::variable::Variable;
use crate::vectors::NamedVector;

type FormResult = (Vec<Operand>, Form);

/// The context in which a form is written.
pub(crate) struct FormContext<'a, 'w> {
    pub(crate) arena: &'a Arena,
    /// The inputs of its programs.
    pub(crate) inputs: &'w [Input],
    pub(crate) parameters: &'w [Variable],
    /// Expressions that are kept as they are.
    pub(crate) whole: &'w [Operand],
    /// Positions that stay symbols although they do not change.
    pub(crate) held: &'w [Variable],
}

/// Bilinear form: coordinates up to second order in the errors; a length is their norm.
pub(crate) fn bilinear<'a>(
    run: &Run<'_, Symbol<'a>>,
    exact: &[Operand],
    vectors: &mut Vec<NamedVector>,
    written: &FormContext<'a, '_>,
) -> Result<FormResult, Diagnostic> {
    let &FormContext { arena, inputs, .. } = written;
    let mut ring = Ring::truncated(arena, 2)?;
    ring.keep(written.whole);
    ring.hold(written.held);
    let read_over = read_over(run, vectors);
    let requested: Vec<Operand> = match read_over.as_slice() {
        [] => exact.to_vec(),
        vectors => vectors.iter().flat_map(|vector| vector.components).collect(),
    };
    let groups = requested.iter().map(|group| ring.normal_form(*group)).collect::<Result<Vec<Polynomial>, _>>()?;
    let groups = ring.without_residue(&groups);
    let parameters = inputs.iter().filter(|input| matches!(input, Input::Plain(v) if v.is_small()));
    let complete = parameters.count() <= 12 && {
        let mut whole = Ring::exact(arena);
        whole.keep(written.whole);
        let forms: Result<Vec<Polynomial>, _> = requested.iter().map(|group| whole.normal_form(*group)).collect();
        forms.is_ok_and(|forms| whole.without_residue(&forms) == groups)
    };
    let collector = Collector { ring: &ring, inputs };
    let trees: Vec<Tree> = groups.iter().map(|group| collector.group(group)).collect();
    let operands = operands(arena, inputs);
    let symbols: Vec<Symbol<'a>> = trees.iter().map(|tree| tree.symbol(arena, &operands)).collect();
    *vectors = read_over;
    for (vector, symbols) in vectors.iter_mut().zip(symbols.chunks(3)) {
        vector.components = [symbols[0], symbols[1], symbols[2]].map(Symbol::operand);
    }
    let outputs = match run.reading_of_groups(&symbols) {
        Some(reading) => vec![reading.operand()],
        None => symbols.into_iter().map(Symbol::operand).collect(),
    };
    let form = Form::Groups { polynomials: groups, printed: trees, complete };
    Ok((outputs, form))
}

/// First-order form: the value without errors and a coefficient for each error.
pub(crate) fn first<'a>(
    run: &Run<'_, Symbol<'a>>,
    exact: &[Operand],
    vectors: &mut Vec<NamedVector>,
    written: &FormContext<'a, '_>,
) -> Result<FormResult, Diagnostic> {
    let &FormContext { arena, inputs, parameters, whole, held } = written;
    let mut ring = Ring::truncated(arena, 1)?;
    ring.keep(whole);
    ring.hold(held);
    let read_over = read_over(run, vectors);
    let form = match (read_over.as_slice(), run.subject.bar(), run.subject.probe()) {
        ([bar], Some(station), _) => {
            let unknowns = run.bar_parameters().map(|unknown| unknown.map(Symbol::operand));
            FirstOrder::of_length(&mut ring, bar.components, station.bar.operand(), unknowns, parameters)?
        }
        ([stylus, step], _, Some(probe)) => {
            let nominal = probe.radius.operand();
            let radius = run.probe_geometry().map_or(nominal, |geometry| geometry.radius.operand());
            match probe.direction {
                Some(_) => {
                    FirstOrder::of_stated_way(&mut ring, [stylus.components, step.components], radius, parameters)?
                }
                None => FirstOrder::of_way_to_the_axis(&mut ring, stylus.components, radius, parameters)?,
            }
        }
        _ => FirstOrder::of_coordinates(&mut ring, exact, parameters)?,
    };
    let collector = Collector { ring: &ring, inputs };
    let collect = |polynomials: &[Polynomial]| polynomials.iter().map(|p| collector.group(p)).collect();
    let laid_out = PrintedFirstOrder {
        nominal: match form.nominal.as_slice() {
            [square] => vec![collector.squares(square)],
            coordinates => collect(coordinates),
        },
        alternative_length: form
            .alternative_length
            .as_ref()
            .map(|length| (length.sign, collector.group(&length.offset))),
        coefficients: form.sensitivities.iter().map(|s| collect(&s.coefficients)).collect(),
        factors: form
            .sensitivities
            .iter()
            .map(|s| match &s.column {
                Column::Multiple { factor: (a, b), .. } => Some((collector.group(a), collector.group(b))),
                Column::Distinct | Column::Zero => None,
            })
            .collect(),
    };
    vectors.clear();
    let operands = operands(arena, inputs);
    let index = |parameter: &Variable| {
        let requested = Input::Plain(parameter.clone());
        inputs.iter().position(|input| *input == requested)
    };
    let terms = |coordinate: usize, over_length: bool| {
        let mut terms = Vec::new();
        for (sensitivity, coefficients) in form.sensitivities.iter().zip(&laid_out.coefficients) {
            let coefficient = &coefficients[coordinate];
            let seen = *coefficient != Tree::Number(0.0) && sensitivity.over_length == over_length;
            if let (true, Some(index)) = (seen, index(&sensitivity.parameter)) {
                terms.push((false, product(vec![coefficient.clone(), Tree::Input(index)])));
            }
        }
        sum(terms)
    };
    let output = |(coordinate, nominal): (usize, &Tree)| {
        let whole = if !read_over.is_empty() {
            let length = Tree::Unary(Unary::Sqrt, Box::new(nominal.clone()));
            let slope = binary(Binary::Div, terms(coordinate, true), length.clone());
            let whole = binary(Binary::Add, laid_out.without_errors(length), slope);
            binary(Binary::Add, whole, terms(coordinate, false))
        } else {
            binary(Binary::Add, nominal.clone(), terms(coordinate, false))
        };
        whole.symbol(arena, &operands).operand()
    };
    let outputs = laid_out.nominal.iter().enumerate().map(output).collect();
    Ok((outputs, Form::First(form, laid_out)))
}

/// The vectors of which a scalar reading is a function: the bar, or the stylus and the step of a probe.
fn read_over(run: &Run<'_, Symbol<'_>>, vectors: &[NamedVector]) -> Vec<NamedVector> {
    let last = if run.subject.bar().is_some() { 1 } else { 2 * usize::from(run.subject.probe().is_some()) };
    vectors[vectors.len() - last..].to_vec()
}

/// The operands of the program's inputs.
pub(crate) fn operands(arena: &Arena, inputs: &[Input]) -> Vec<Operand> {
    let operand = |input: &Input| {
        let symbol = match input {
            Input::Plain(variable) => arena.variable(variable.clone()),
            Input::Sine(variable) => Nominal::sin_cos(arena.variable(variable.clone())).0,
            Input::Cosine(variable) => Nominal::sin_cos(arena.variable(variable.clone())).1,
        };
        symbol.operand()
    };
    inputs.iter().map(operand).collect()
}
