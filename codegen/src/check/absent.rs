//! Parameters that an equation does not contain.

use abbe_model::Diagnostic;

use crate::check::agreement::Agreement;
use crate::equation::Equation;
use crate::form::Kind;
use crate::normal_form::Ring;
use crate::symbol::VariableId;
use crate::variable::Variable;

/// The parameters that the outputs do not contain. A derivative that is not zero at some point proves that its
/// parameter is contained; otherwise the normal form decides.
pub(crate) fn absent_parameters(equation: &Equation, agreement: &Agreement) -> Result<Vec<Variable>, Diagnostic> {
    let rounding = 1e-9;
    let derivatives = equation.parameters.iter().zip(&agreement.largest_derivatives);
    let unseen = derivatives.filter(|(_, largest)| **largest < rounding);
    let unseen: Vec<Variable> = unseen.map(|(parameter, _)| parameter.clone()).collect();
    let below: Vec<VariableId> = equation.arena.variables_of(&equation.outputs);
    let in_graph = |parameter: &Variable| below.iter().any(|id| equation.arena.variable_at(*id) == *parameter);
    let (doubtful, mut absent): (Vec<Variable>, Vec<Variable>) = unseen.into_iter().partition(in_graph);
    if !doubtful.is_empty() {
        let requested = match (equation.kind, equation.vectors.as_slice()) {
            (Kind::Length, [.., bar]) => bar.components.to_vec(),
            (Kind::Distance, [.., stylus, step]) => {
                let radius = equation.touch.iter().map(|touch| touch.radius);
                let vectors = stylus.components.into_iter().chain(step.components);
                vectors.chain(radius).collect()
            }
            _ => equation.outputs.clone(),
        };
        let mut ring = Ring::exact(&equation.arena);
        ring.keep(&equation.whole);
        let forms = requested.iter().map(|w| ring.normal_form(*w)).collect::<Result<Vec<_>, _>>()?;
        let forms = ring.without_residue(&forms);
        absent.extend(ring.absent(&forms, &doubtful).into_iter().cloned());
    }
    Ok(absent)
}
