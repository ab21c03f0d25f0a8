//! Prints the reading of a ball-bar test as an equation, to first order in two location errors.

use abbe::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let session = read_session("sessions/hermle-c600u/chapter5.toml")?;
    let test = session.tests.iter().find(|test| test.name == "C150").ok_or("no test C150")?;
    let source = SessionTest::new(&session, test)?;

    let errors: Vec<ErrorName> = ["EX0C", "EY0C"].iter().filter_map(|name| ErrorName::parse(name)).collect();
    let options = EquationOptions { order: Order::First, ..EquationOptions::default() };
    let equation = Equation::of(&session.machine, &source, &errors, &options)?;
    // Only an equation that equals the kinematic chain can be printed.
    let checked = check(&equation, &source)?;
    println!("{}", language("text")?.print(&checked, &Style::default())?);
    Ok(())
}
