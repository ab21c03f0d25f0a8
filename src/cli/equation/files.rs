//! `abbe equation --all-tests` as code: a file for each test.

use abbe::codegen::check;
use abbe::codegen::print::Style;
use abbe::equation;
use abbe::model::Diagnostic;
use abbe::model::session::Test;

use super::{EquationArguments, read};
use crate::cli::folder;

/// A file of code for each test, in a new folder.
pub fn write(arguments: &EquationArguments) -> Result<(), Diagnostic> {
    let form = &arguments.form;
    let Some(out) = &form.out else {
        return Err(Diagnostic::other(format!(
            "`--all-tests --as {}` writes a file for each test; name a new folder by --out",
            form.language.word
        )));
    };
    folder::check(out, arguments.folder.force)?;
    let (session, _) = read(&arguments.session)?;
    let style = Style { name_of_test: true, ..form.style.style(form.language)? };
    let file = |test: &Test| -> Result<_, Diagnostic> {
        let (equation, source) = form.of_test(&session, test, arguments.source(&session, test)?, false)?;
        Ok((form.language.file_name(&equation), form.language.print(&check(&equation, &source)?, &style)?))
    };
    let files: Vec<(String, String)> = session.tests.iter().map(file).collect::<Result<_, Diagnostic>>()?;
    equation::refuse_equal_names(&session, &files)?;
    folder::write(out, &files, arguments.folder.force, |_| Ok(()))
}
