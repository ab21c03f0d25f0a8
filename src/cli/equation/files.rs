//! `abbe equation --all-tests` as code: a file for each test.

use abbe::codegen::check;
use abbe::codegen::print::Style;
use abbe::equation;
use abbe::model::session::Test;

use super::{EquationArguments, read};
use crate::cli::failure::Failure;
use crate::cli::folder;

/// A file of code for each test, in a new folder.
pub fn write(arguments: &EquationArguments) -> Result<(), Failure> {
    let form = &arguments.form;
    let Some(out) = &form.out else {
        return Err(Failure::Other(format!(
            "`--all-tests --as {}` writes a file for each test; name a new folder by --out",
            form.language.word
        )));
    };
    folder::check(out, arguments.folder.force)?;
    let (session, _) = read(&arguments.session)?;
    let style = Style { name_of_test: true, ..form.style.style(form.language)? };
    let file = |test: &Test| -> Result<_, Failure> {
        let (equation, source) = form.of_test(&session, test, arguments.source(&session, test)?, false)?;
        Ok((form.language.file_name(&equation), form.language.print(&check(&equation, &source)?, &style)?))
    };
    let files: Vec<(String, String)> = session.tests.iter().map(file).collect::<Result<_, Failure>>()?;
    equation::refuse_equal_names(&session, &files)?;
    folder::write(out, &files, arguments.folder.force, |_| Ok(()))
}
