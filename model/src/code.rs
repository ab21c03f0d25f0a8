//! Structural codes: the order of bodies from workpiece to tool, `b` the bed.
//!
//! `w C A b Y X Z t` (spaced, any axis names) and `[wCAbYXZt]` (compact, one letter per axis) are equivalent.

use crate::Diagnostic;
use crate::words::{MAX_QUOTED, cut, shortened};

/// Largest number of axes in a chain.
pub const MAX_AXES: usize = 64;

/// The axes of a structural code, in the order of the code.
///
/// ```
/// use abbe_model::code::StructuralCode;
///
/// let code = StructuralCode::parse("[wCAbYXZt]")?;
/// assert_eq!((code.workpiece_side.len(), code.tool_side.len()), (2, 3));
/// assert_eq!(code.spaced(), "w C A b Y X Z t");
/// assert!(StructuralCode::parse("wCAYXZt").unwrap_err().to_string().contains("0 beds"));
/// # Ok::<(), abbe_model::Diagnostic>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StructuralCode {
    /// Axes between workpiece and bed, from the workpiece to the bed.
    pub workpiece_side: Vec<String>,
    /// Axes between bed and tool, from the bed to the tool.
    pub tool_side: Vec<String>,
}

/// What is wrong with a structural code.
pub fn structural_code(code: &str, found: &str) -> Diagnostic {
    let (code, found) = (cut(code, MAX_QUOTED), shortened(found));
    let form = "a code goes from workpiece over bed to tool, as in `w C A b Y X Z t`";
    Diagnostic::session(format!("structural code `{code}`: {found}; {form}"), None)
}

impl StructuralCode {
    /// Parses either form.
    ///
    /// # Errors
    /// The message names what is missing: `w` at the start, `t` at the end, exactly one `b`, each axis once.
    pub fn parse(text: &str) -> Result<StructuralCode, Diagnostic> {
        let fault = |found: String| structural_code(text, &found);
        let inner = text.trim().trim_start_matches('[').trim_end_matches(']').trim();
        let bodies: Vec<String> = if inner.contains(char::is_whitespace) {
            inner.split_whitespace().map(str::to_string).collect()
        } else {
            inner.chars().map(String::from).collect()
        };
        if bodies.first().map(String::as_str) != Some("w") {
            return Err(fault("it does not start with the workpiece `w`".into()));
        }
        if bodies.len() < 2 || bodies.last().map(String::as_str) != Some("t") {
            return Err(fault("it does not end with the tool `t`".into()));
        }
        let between = &bodies[1..bodies.len() - 1];
        let beds = between.iter().filter(|body| *body == "b").count();
        if beds != 1 {
            return Err(fault(format!("it contains {beds} beds `b`; exactly one is needed")));
        }
        if between.len() > MAX_AXES {
            return Err(fault(format!("{} bodies; the limit is {MAX_AXES} axes", between.len())));
        }
        for (index, body) in between.iter().enumerate() {
            let named = body.chars().next().is_some_and(char::is_alphabetic) && body.chars().all(char::is_alphanumeric);
            if !named || body == "w" || body == "t" {
                return Err(fault(format!("`{body}` is not an axis name")));
            }
            if between[..index].contains(body) {
                return Err(fault(format!("`{body}` occurs twice")));
            }
        }
        let bed = between.iter().position(|body| body == "b").unwrap_or(0);
        Ok(StructuralCode { workpiece_side: between[..bed].to_vec(), tool_side: between[bed + 1..].to_vec() })
    }

    /// The axes from workpiece to tool.
    pub fn axes(&self) -> impl Iterator<Item = &String> {
        self.workpiece_side.iter().chain(&self.tool_side)
    }

    /// The spaced form.
    pub fn spaced(&self) -> String {
        let mut bodies = vec!["w"];
        bodies.extend(self.workpiece_side.iter().map(String::as_str));
        bodies.push("b");
        bodies.extend(self.tool_side.iter().map(String::as_str));
        bodies.push("t");
        bodies.join(" ")
    }
}
