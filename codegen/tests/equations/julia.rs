//! Printed Julia: run by Julia where it is installed, and everywhere evaluated by a small reader of the grammar that it
//! uses.

use std::collections::HashMap;
use std::fmt::Write;
use std::process::Command;

use abbe_codegen::print::Layout;

use crate::programs::{Printed, all, check_all, laid_out, points, sizes};
use crate::tools;
use crate::topologies::{Case, disagreement};

/// Both methods of value and gradient, by Julia 1.9 or later.
#[test]
fn julia() {
    let probe = ["-e", "VERSION >= v\"1.9\" || exit(1)"];
    let Some(julia) = test_needs::first(&["julia"], &probe) else {
        test_needs::skip_in_ci_too("julia::julia", "no Julia 1.9 or later");
        return;
    };
    let folder = tools::folder("julia");
    let all = all("julia");
    let mut main = String::from(
        "numbers(line) = parse.(Float64, split(line))\nshow_row(x...) = println(join(repr.(Float64.(vcat(vec.(x)...))), \" \"))\n",
    );
    for printed in &all {
        let (name, function) = (&printed.name, printed.function);
        let [lengths, axes, ..] = sizes(printed);
        tools::write(&folder.join(format!("{name}.jl")), &printed.text);
        tools::write(&folder.join(format!("{name}.txt")), &points(printed));
        let _ = write!(
            main,
            "module {name}
include(\"{name}.jl\")
end
let rows = numbers.(readlines(\"{name}.txt\"))
    parts(row) = (row[1:{lengths}], row[{lengths} + 1:{lengths} + {axes}], row[{lengths} + {axes} + 1:end])
    all_axes = hcat((parts(row)[2] for row in rows)...)
    for row in rows
        v, g = {name}.{function}_gradient(parts(row)...)
        v == {name}.{function}(parts(row)...) || error(\"value\")
        show_row([v;], g)
    end
    println(\"columns\")
    for (i, row) in enumerate(rows)
        l, _, e = parts(row)
        v, g = {name}.{function}_gradient(l, all_axes, e)
        v == {name}.{function}(l, all_axes, e) || error(\"values\")
        show_row([selectdim(v, ndims(v), i);], selectdim(g, ndims(g), i))
    end
    println(\"next\")
end\n"
        );
    }
    tools::write(&folder.join("main.jl"), &main);
    let arguments = ["--startup-file=no", "main.jl"];
    check_all(&all, &tools::run(Command::new(julia).current_dir(&folder).args(arguments)));
    let _ = std::fs::remove_dir_all(&folder);
}

/// The method for one reading has the value and the derivatives of dual numbers when it is read by the rules of Julia.
#[test]
fn read_by_the_rules_of_julia() {
    for printed in all("julia") {
        let found: Vec<Vec<f64>> = printed.cases.iter().map(|case| evaluate(&printed, &case.arguments)).collect();
        let worst = disagreement(&printed.cases, &found, true);
        assert!(worst <= 1e-12, "{}: {worst:e}", printed.name);
    }
}

/// As above for the functions with named arguments.
#[test]
fn named_read_by_the_rules_of_julia() {
    for printed in laid_out("julia", Layout::Named) {
        let found: Vec<Vec<f64>> = printed.cases.iter().map(|case| evaluate_named(&printed, case)).collect();
        let worst = disagreement(&printed.cases, &found, true);
        assert!(worst <= 1e-12, "{}: {worst:e}", printed.name);
    }
}

/// Value and derivatives by the kernel of `…_gradient` with named arguments.
fn evaluate_named(printed: &Printed, case: &Case) -> Vec<f64> {
    let arguments = printed.named(case);
    let list = |text: &str, start: &str| -> Vec<String> {
        let (_, rest) = text.split_once(start).expect("a list");
        let (list, _) = rest.split_once(')').expect("its end");
        list.split(", ").map(|item| item.split(" = ").next().unwrap_or_default().to_string()).collect()
    };
    let (_, text) = printed.text.split_once(&format!("function {}_gradient(; ", printed.function)).expect("it");
    let names: Vec<String> = arguments.iter().map(|(name, _)| name.clone()).collect();
    assert_eq!(list(&format!("({text}"), "("), names);
    assert_eq!(list(text, "function kernel("), names);
    assert_eq!(list(text, "return kernel.("), names);
    let (_, body) = text.split_once("function kernel(").expect("the kernel");
    let (steps, result) = body.split_once("        return (; value = ").expect("its result");
    let mut names: HashMap<String, Vec<f64>> = arguments.into_iter().map(|(name, value)| (name, vec![value])).collect();
    for line in steps.lines().skip(1) {
        let (name, value) = line.trim().split_once(" = ").expect("an assignment");
        let value = Reader { rest: value, names: &names }.whole();
        assert!(names.insert(name.to_string(), vec![value]).is_none(), "{name} is assigned twice");
    }
    let (values, gradient) = result.split_once(", gradient = ").expect("a gradient");
    let mut read = |text: &str| Reader { rest: text, names: &names }.whole();
    let values = if printed.cases[0].values.len() > 1 { &values[1..values.len() - 1] } else { values };
    let mut found: Vec<f64> = values.split(", ").map(&mut read).collect();
    let slopes = gradient.lines().filter_map(|line| line.trim().strip_suffix(',')?.split_once(" = "));
    found.extend(slopes.map(|(_, slope)| read(slope)));
    found
}

/// Value and derivatives by the method of `…_gradient` for one reading.
fn evaluate(printed: &Printed, arguments: &[Vec<f64>; 3]) -> Vec<f64> {
    let head = format!(
        "function {}_gradient(lengths::AbstractVector, axes::AbstractVector, errors::AbstractVector)\n",
        printed.function
    );
    let (_, body) = printed.text.split_once(&head).expect("the method");
    let (body, _) = body.split_once("\nend\n").expect("its end");
    let (assignments, returned) = body.split_once("    return ").expect("its result");
    let (steps, gradient) = assignments.split_once("    gradient = ").expect("the gradient");
    let mut names: HashMap<String, Vec<f64>> = ["lengths", "axes", "errors"]
        .iter()
        .zip(arguments)
        .map(|(name, values)| ((*name).to_string(), values.clone()))
        .collect();
    for line in steps.lines() {
        let (name, value) = line.trim().split_once(" = ").expect("an assignment");
        let value = Reader { rest: value, names: &names }.whole();
        assert!(names.insert(name.to_string(), vec![value]).is_none(), "{name} is assigned twice");
    }
    let mut read = |text: &str| Reader { rest: text, names: &names }.whole();
    let values = returned.strip_suffix(", gradient").expect("value and gradient");
    let values = values.trim_start_matches('[').trim_end_matches(']').split(", ");
    let mut found: Vec<f64> = values.map(&mut read).collect();
    let elements = gradient.lines().skip(1).filter_map(|line| line.trim().strip_suffix(','));
    found.extend(elements.map(&mut read));
    found
}

/// A reader of expressions by the precedence of Julia's operators.
struct Reader<'t> {
    rest: &'t str,
    names: &'t HashMap<String, Vec<f64>>,
}

impl Reader<'_> {
    fn whole(mut self) -> f64 {
        let value = self.comparison();
        assert_eq!(self.rest, "", "nothing follows the expression");
        value
    }

    fn take(&mut self, token: &str) -> bool {
        let after = self.rest.strip_prefix(token);
        self.rest = after.unwrap_or(self.rest);
        after.is_some()
    }

    fn comparison(&mut self) -> f64 {
        let left = self.sum();
        if self.take(" >= ") {
            return f64::from(u8::from(left >= self.sum()));
        }
        left
    }

    fn sum(&mut self) -> f64 {
        let mut sum = self.product();
        loop {
            if self.take(" + ") {
                sum += self.product();
            } else if self.take(" - ") {
                sum -= self.product();
            } else {
                return sum;
            }
        }
    }

    fn product(&mut self) -> f64 {
        let mut product = self.factor();
        loop {
            if self.take(" * ") {
                product *= self.factor();
            } else if self.take(" / ") {
                product /= self.factor();
            } else {
                return product;
            }
        }
    }

    fn factor(&mut self) -> f64 {
        if self.take("-") {
            return -self.factor();
        }
        if self.take("(") {
            let inside = self.comparison();
            assert!(self.take(")"), "a parenthesis is open before {}", self.rest);
            return inside;
        }
        let word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
        let end = self.rest.find(|c: char| !word(c)).unwrap_or(self.rest.len());
        let (mut text, mut rest) = self.rest.split_at(end);
        if text.starts_with(|c: char| c.is_ascii_digit()) {
            // The sign of an exponent belongs to the number.
            if text.ends_with('e') && rest.starts_with('-') {
                let digits = rest[1..].find(|c: char| !c.is_ascii_digit()).map_or(rest.len(), |end| end + 1);
                (text, rest) = self.rest.split_at(end + digits);
            }
            self.rest = rest;
            return text.parse().expect("a number");
        }
        self.rest = rest;
        if self.take("(") {
            return self.call(text);
        }
        let values = &self.names[text];
        if self.take("[") {
            let (index, rest) = self.rest.split_once(']').expect("an index");
            self.rest = rest;
            return values[index.parse::<usize>().expect("a number") - 1];
        }
        values[0]
    }

    fn call(&mut self, function: &str) -> f64 {
        let x = self.comparison();
        let value = match function {
            "sin" => x.sin(),
            "cos" => x.cos(),
            "sqrt" => x.sqrt(),
            "exp" => x.exp(),
            "floor" => x.floor(),
            "sign" if x == 0.0 => 0.0,
            "sign" => x.signum(),
            "round" => {
                assert!(self.take(", RoundNearestTiesAway"), "Julia rounds ties to even by default");
                x.round()
            }
            "ifelse" => {
                assert!(self.take(", "), "an argument is missing");
                let yes = self.comparison();
                assert!(self.take(", "), "an argument is missing");
                let no = self.comparison();
                if x == 1.0 { yes } else { no }
            }
            other => panic!("no function of Julia is called {other}"),
        };
        assert!(self.take(")"), "a call is open before {}", self.rest);
        value
    }
}
