//! The values of a page are those of the chain.

use super::*;

/// Prints an equation in three languages and reads it back.
fn read_back<S: Source>(machine: &Machine, source: &S, errors: &[ErrorName], options: &Options) {
    let equation = Equation::of(machine, source, errors, options).expect("an equation");
    let checked = check(&equation, source).expect("agreement with dual numbers");
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    let mut values: Vec<(Variable, f64)> = Vec::new();
    let mut names: BTreeMap<String, f64> = BTreeMap::new();
    let mut units: BTreeMap<String, (String, &'static str)> = BTreeMap::new();
    for input in equation.inputs() {
        let (Input::Plain(variable) | Input::Sine(variable) | Input::Cosine(variable)) = &input;
        if !values.iter().any(|(known, _)| known == variable) {
            let value = match variable {
                Variable::Length(name) => source.length_mm(name).unwrap_or(100.0) * random.random_range(0.9..1.1),
                Variable::Position { .. } if variable.is_angle() => random.random_range(-1.2..1.2),
                Variable::Position { .. } => random.random_range(-3.0..3.0),
                Variable::Driver(quantity) if quantity.part == DriverPart::Direction => -1.0,
                Variable::Driver(_) => random.random_range(0.1..2.0),
                // Small, so that a touching probe meets its artefact.
                small if small.is_angle() => random.random_range(-1e-3..1e-3),
                _ => random.random_range(-0.1..0.1),
            };
            values.push((variable.clone(), value));
        }
        let value = values.iter().find(|(known, _)| known == variable).expect("a value").1;
        let own = canonical(&variable.text(options.symbols));
        let of_axis = |letter: &str| match variable {
            Variable::Position { .. } if options.arrangement != Arrangement::Frames => format!("{letter}{own}"),
            Variable::Position { axis, .. } => format!("{letter}{}", axis.to_lowercase()),
            _ => own.clone(),
        };
        match &input {
            Input::Plain(_) => {
                names.insert(own.clone(), value);
                units.insert(own, (variable.meaning(), variable.unit()));
            }
            Input::Sine(_) | Input::Cosine(_) => {
                let is_sine = matches!(input, Input::Sine(_));
                let name = of_axis(if is_sine { "s" } else { "c" });
                // Sine and cosine of something else than an axis are functions of it.
                names.entry(own).or_insert(value);
                if matches!(variable, Variable::Position { .. }) {
                    names.insert(name.clone(), if is_sine { value.sin() } else { value.cos() });
                    units.insert(name, ("sine and cosine of the ".to_string() + &variable.meaning(), "1"));
                }
            }
        }
    }
    let value = |zero: bool| {
        move |values: &[(Variable, f64)], variable: &Variable| {
            let value = values.iter().find(|(known, _)| known == variable).map_or(f64::NAN, |(_, value)| *value);
            if zero && variable.is_small() { 0.0 } else { value }
        }
    };
    let wanted = evaluate_f64(&equation.arena, &equation.outputs, |v| value(false)(&values, v)).expect("numbers");
    let slopes: Vec<Vec<f64>> = equation
        .arena_gradients()
        .iter()
        .map(|row| evaluate_f64(&equation.arena, row, |v| value(true)(&values, v)).expect("numbers"))
        .collect();
    let outputs: Vec<String> = match equation.kind {
        Kind::Length => vec!["L".into()],
        Kind::Distance => vec!["d".into()],
        Kind::Coordinates => ["mx", "my", "mz"].map(String::from).to_vec(),
        Kind::Volumetric => ["Δx", "Δy", "Δz"].map(String::from).to_vec(),
    };
    let style = Style { nomenclature: true, ..Style::default() };
    for language in ["text", "latex", "typst"] {
        let page = abbe_codegen::language(language).and_then(|own| own.print(&checked, &style)).expect("a page");
        let what = |row: &str| format!("{language}, {:?} {:?}: {row}\n{page}", options.order, equation.kind);
        let (mut known, mut used) = (names.clone(), BTreeSet::new());
        let (mut lefts, mut read, mut found_slopes) = (BTreeSet::new(), BTreeMap::new(), 0);
        for (left, right, remark) in statements(&page, language) {
            let tokens = tokens(&right);
            let mut reader = Reader { tokens: &tokens, names: &known, used: &mut used };
            let value = reader.sum();
            assert!(reader.tokens.is_empty(), "{}", what(&format!("{left} = {right}: {:?}", reader.tokens)));
            if left.contains('∂') || left.contains("partial") {
                let parts: Vec<&str> = left.split(if left.contains('∂') { "∂" } else { "partial" }).collect();
                let (of, by) = (canonical(parts[1]), canonical(parts[2]));
                let output = outputs.iter().position(|output| *output == of).expect("an output");
                let mut parameters = equation.parameters.iter();
                let parameter = parameters.position(|own| canonical(&own.text(options.symbols)) == by);
                let wanted = slopes[output][parameter.unwrap_or_else(|| panic!("{}", what(&by)))];
                assert!((value - wanted).abs() < 1e-9 * (1.0 + wanted.abs()), "{} {value} {wanted}", what(&left));
                let all_zero = slopes.iter().all(|row| row[parameter.expect("it")].abs() < 1e-9);
                // A step may be zero here and not elsewhere.
                let is_effect = matches!(equation.parameters[parameter.expect("it")], Variable::Coefficient(_));
                let not_observable = remark.contains("not observable");
                assert!(not_observable == all_zero || is_effect && !not_observable, "{}", what(&left));
                found_slopes += 1;
                continue;
            }
            let is_square = left.ends_with('²') || left.ends_with("^2");
            let name = canonical(left.trim_end_matches("^2"));
            let value = if is_square { value.sqrt() } else { value };
            assert!(lefts.insert(name.clone()), "{}", what(&left));
            if outputs.contains(&name) {
                read.insert(name, value);
            } else {
                known.insert(name, value);
            }
        }
        for (output, wanted) in outputs.iter().zip(&wanted) {
            // Lengths are differences of large numbers; a coordinate that is always zero may be left out.
            let found = read.get(output).copied().unwrap_or(0.0);
            assert!((found - wanted).abs() < 1e-9 * (1.0 + wanted.abs()), "{} {found} {wanted}", what(output));
        }
        let single = options.arrangement == Arrangement::Single;
        assert_eq!(found_slopes > 0, options.order == Order::First && !single, "{}", what("derivatives"));
        check_symbols(&page, language, &units, &used, &lefts);
    }
}

/// A word of a table without the escapes of its language.
fn plain(text: &str) -> String {
    let text = text.replace("$^\\circ$", "°").replace("$\\mu$", "µ").replace("$\\theta$", "θ").replace("$-$", "−");
    text.replace("\\textasciitilde{}", "~").replace(['$', '\\'], "")
}

/// The table has every name of the page once, with meaning and unit, and in LaTeX breaks where a column is full.
fn check_symbols(
    page: &str,
    language: &str,
    units: &BTreeMap<String, (String, &'static str)>,
    used: &BTreeSet<String>,
    lefts: &BTreeSet<String>,
) {
    let tables = symbols(page, language);
    let mut listed: BTreeMap<String, (String, String)> = BTreeMap::new();
    for (names, meaning, unit) in tables.iter().flatten() {
        assert!(!meaning.is_empty(), "{names:?}\n{page}");
        for name in names {
            let twice = listed.insert(name.clone(), (meaning.clone(), unit.clone()));
            assert!(twice.is_none(), "{language}: {name} twice\n{page}");
        }
    }
    for name in used.iter().filter(|name| units.contains_key(*name)) {
        let (_, unit) = &units[name];
        let (_, listed) = listed.get(name).unwrap_or_else(|| panic!("{language}: {name} is not listed\n{page}"));
        assert_eq!(plain(listed), *unit, "{language}: {name}\n{page}");
    }
    if language == "text" {
        return;
    }
    for name in lefts {
        let (meaning, unit) = listed.get(name).unwrap_or_else(|| panic!("{language}: {name} is not listed\n{page}"));
        let unit = plain(unit);
        let is_direction = name.starts_with('u');
        let wanted: &[&str] = match name.as_str() {
            "S" | "a" | "b" | "c" => &["mm²"],
            _ if is_direction => &["1"],
            _ if units.contains_key(name) => continue,
            _ => &["mm", "rad", "1"],
        };
        assert!(wanted.contains(&unit.as_str()), "{language}: {name} in {unit}, {meaning}\n{page}");
    }
    for name in listed.keys() {
        let small_or_used = units.contains_key(name) || lefts.contains(name) || used.contains(name);
        assert!(small_or_used, "{language}: {name} is listed and not printed\n{page}");
    }
    if language == "latex" {
        let width = page.split("\\arraybackslash}p{").nth(1).and_then(|rest| rest.split("pt}").next());
        let width: usize = width.expect("a width").parse().expect("points");
        // Five points a character; 34 lines fit a column.
        let lines = |row: &(Vec<String>, String, String)| 1 + plain(&row.1).chars().count() * 5 / width;
        let heights: Vec<usize> = tables.iter().map(|table| table.iter().map(lines).sum()).collect();
        for (height, next) in heights.iter().zip(&tables[1..]) {
            assert!(height + lines(&next[0]) > 34, "{heights:?}");
        }
        // The first row of a table may be added.
        for (height, table) in heights.iter().zip(&tables) {
            assert!(*height <= 34 + lines(&table[0]), "{heights:?}");
        }
    }
}

/// The derivatives at zero errors, which first-order pages print.
trait Gradients {
    fn arena_gradients(&self) -> Vec<Vec<abbe_codegen::Operand>>;
}

impl Gradients for Equation {
    fn arena_gradients(&self) -> Vec<Vec<abbe_codegen::Operand>> {
        let parameters: Vec<abbe_codegen::Operand> =
            self.parameters.iter().map(|parameter| self.arena.variable(parameter.clone()).operand()).collect();
        self.exact.iter().map(|output| self.arena.gradient(*output, &parameters)).collect()
    }
}

#[test]
fn pages_of_a_bar_have_the_values_of_the_chain() {
    for rotation in [Rotation::Exact, Rotation::SmallAngle] {
        for order in [Order::Exact, Order::Bilinear, Order::First] {
            for symbols in [Symbols::Literature, Symbols::Iso] {
                for extended in [false, true] {
                    let options = Options {
                        order,
                        symbols,
                        rotation: Some(rotation),
                        unknowns: (0..8).collect(),
                        ..Options::default()
                    };
                    read_back(&hermle(rotation), &Chapter5 { extended }, &eight(), &options);
                }
            }
        }
        for arrangement in [Arrangement::Single, Arrangement::Groups] {
            let options =
                Options { arrangement, rotation: Some(rotation), unknowns: (0..8).collect(), ..Options::default() };
            read_back(&hermle(rotation), &Chapter5 { extended: true }, &eight(), &options);
        }
    }
}

#[test]
fn pages_of_every_topology_have_the_values_of_the_chain() {
    for code in CODES {
        let machine = machine(code);
        let errors = all_errors(&machine);
        let motions: Vec<ErrorName> = errors.iter().filter(|name| name.kind == ErrorKind::Motion).cloned().collect();
        read_back(&machine, &AnyBar, &errors, &Options::default());
        let first = Options { order: Order::First, ..Options::default() };
        read_back(&machine, &AnyBar, &errors, &first);
        read_back(&machine, &ToolPoint, &motions, &first);
    }
}

#[test]
fn pages_of_every_shape_of_an_effect_have_the_values_of_the_chain() {
    let machine = Machine::from_code("w C b X t").expect("a code");
    for order in [Order::Exact, Order::Bilinear, Order::First] {
        let options = Options { order, effects: every_shape(), ..Options::default() };
        read_back(&machine, &Bar, &eight()[4..], &options);
    }
}

#[test]
fn pages_of_a_probe_have_the_values_of_the_chain() {
    for stated in [false, true] {
        for order in [Order::Exact, Order::Bilinear, Order::First] {
            let touch = Touch { stated };
            let machine = touch.machine();
            let options = Options { order, rotation: Some(Rotation::SmallAngle), ..Options::default() };
            read_back(&machine, &touch, &errors(&machine), &options);
        }
    }
}
