//! The result of a fit: goodness of fit, both propagations of uncertainty, all figures for a spreadsheet.

use abbe::identify::circular::CircularTest;
use abbe::identify::noise::NoiseSource;
use abbe::identify::results::{
    CrossValidation, FitMonteCarlo, FitResult, Goodness, GoodnessVerdict, ParameterResult, Verdict,
};
use abbe::identify::tolerance::Conformity;
use abbe::model::words::counted;

use super::cross_validation;
use super::number::{fixed, micrometres, places, unit};
use super::table::{Cell, Column, Table, cells, numbers, words};

/// Whether the residual agrees with the noise.
pub fn agreement(goodness: Goodness, degrees_of_freedom: usize) -> String {
    let figures = format!("χ²/ν = {:.2}, ν = {degrees_of_freedom}", goodness.chi_square_ratio);
    match goodness.verdict {
        GoodnessVerdict::NotJudged => {
            "cannot be judged: no noise is stated and no reading repeats, so the residual is taken for noise"
                .to_string()
        }
        GoodnessVerdict::Exceeds => format!("the residual exceeds the noise ({figures}): the model lacks an effect"),
        GoodnessVerdict::Structured => {
            format!(
                "the residual is no larger than the noise ({figures}), but it has structure: the model lacks an effect"
            )
        }
        GoodnessVerdict::NoiseOverstated => {
            format!("the residual is smaller than the noise ({figures}): the noise is overstated")
        }
        GoodnessVerdict::Agrees => format!("the residual agrees with the noise ({figures})"),
    }
}

/// What the estimates of a model are not good for; `None` if they may be quoted.
pub fn reservation(goodness: Goodness) -> Option<&'static str> {
    (!goodness.quotable).then_some(
        "not to be quoted: the model lacks an effect, and u does not cover the bias that it causes in the estimates",
    )
}

/// `identifiable` of `count` parameters, and the rank.
pub fn rank(identifiable: usize, count: usize, rank: usize) -> String {
    format!("{identifiable} of {} identifiable (numerical rank {rank})", counted(count, "parameter"))
}

/// The noise and its source in words. A residual is not called noise.
pub fn noise(noise_um: f64, source: NoiseSource) -> String {
    let figure = micrometres(noise_um);
    match source {
        NoiseSource::Residual => format!("residual of the declared model {figure} (no noise stated, no repeats)"),
        other => format!("noise {figure} ({other})"),
    }
}

/// Both propagations side by side, with the quoted interval, of the parameters that are to be shown.
pub fn propagations(drawn: &FitMonteCarlo, is_shown: impl Fn(&str) -> bool) -> Table {
    let rows = drawn.parameters.iter().filter(|parameter| is_shown(&parameter.id)).map(|parameter| {
        let [value, gum_u] = Cell::estimate(parameter.value, parameter.gum_u);
        let u = Cell::fixed(parameter.u, places(parameter.u));
        let (quoted, source) = match parameter.verdict {
            Verdict::Agree => (&parameter.gum_interval, "GUM"),
            Verdict::Differ => (&parameter.symmetric_interval, "Monte Carlo"),
            Verdict::Undecided => (&parameter.symmetric_interval, "Monte Carlo (too few runs to compare)"),
        };
        let [low, high] = [quoted.low, quoted.high].map(|end| fixed(end, places(parameter.u)));
        cells![&parameter.id, value, gum_u, u, format!("{low} to {high}"), unit(&parameter.unit), source]
    });
    let interval = numbers(format!("{} %", drawn.coverage_probability * 100.0));
    let mut columns = ["parameter", ">value", ">u GUM", ">u MC", "unit", "quoted"].map(Column::from).to_vec();
    columns.insert(4, interval);
    Table::new(columns, rows)
        .titled("Estimates with standard uncertainty u by GUM and by Monte Carlo, and the quoted coverage interval")
}

/// The parameters whose propagations agree.
pub fn agreement_of_propagations(drawn: &FitMonteCarlo) -> String {
    let count = |verdict: Verdict| drawn.parameters.iter().filter(|p| p.verdict == verdict).count();
    format!(
        "Monte Carlo, {}, seed {}: {} of {} agree with the GUM within the tolerance of JCGM 101, 8.1; {} differ",
        counted(drawn.runs, "run"),
        drawn.seed,
        count(Verdict::Agree),
        counted(drawn.parameters.len(), "parameter"),
        count(Verdict::Differ)
    )
}

/// Every figure of a result with all its digits, one row per figure.
pub struct Figures(Table);

impl Default for Figures {
    fn default() -> Figures {
        let headings = ["section", "id", "meaning", "value", "u", "unit"];
        Figures(Table::new(headings.map(words), []))
    }
}

impl Figures {
    /// The figures of a fit.
    pub fn of_fit(result: &FitResult) -> Table {
        let mut figures = Figures::default();
        figures.figure("residual", "rms", "", result.rms_um, "um");
        figures.held_out("residual", result.heldout_rms_um, &result.cross_validation);
        figures.parameters("parameters", &result.parameters);
        result.circular.iter().for_each(|test| figures.circular(test));
        figures.conformity(result.conformity.as_ref());
        figures.0
    }

    /// The deciding held-out error, and those by what is held out.
    pub fn held_out(&mut self, section: &str, rms_um: f64, model: &CrossValidation) {
        self.figure(section, "held out", "", rms_um, "um");
        for figure in cross_validation::figures(model) {
            self.figure(section, figure.name, "", figure.rms_um, "um");
        }
    }

    /// The table.
    pub fn table(self) -> Table {
        self.0
    }

    /// A row that is no number.
    pub fn statement(&mut self, section: &str, id: &str, meaning: &str) {
        self.0.rows.push(cells![section, id, meaning, "", "", ""]);
    }

    /// A figure without uncertainty.
    pub fn figure(&mut self, section: &str, id: &str, meaning: &str, value: f64, unit: &str) {
        self.0.rows.push(cells![section, id, meaning, Cell::exact(value), "", unit]);
    }

    /// Parameters with their uncertainties.
    pub fn parameters(&mut self, section: &str, parameters: &[ParameterResult]) {
        self.0.rows.extend(
            parameters
                .iter()
                .map(|p| cells![section, &p.id, &p.meaning, Cell::exact(p.value), Cell::exact(p.u), &p.unit]),
        );
    }

    /// The decision about each item; its value is the probability that it is within its limits.
    pub fn conformity(&mut self, conformity: Option<&Conformity>) {
        for item in conformity.iter().flat_map(|conformity| &conformity.items) {
            let probability = item.conformance_probability.map_or("".into(), Cell::exact);
            self.0.rows.push(cells!["conformity", &item.id, item.decision.word(), probability, "", ""]);
        }
    }

    fn circular(&mut self, test: &CircularTest) {
        let section = format!("circle {}", test.test);
        for direction in &test.directions {
            let of = |figure: &str| format!("{figure}({}{})", test.axes, direction.direction);
            for (id, meaning, value) in [
                (of("G"), "circular deviation", direction.circular_deviation_um),
                (of("Fmax"), "radial deviation, greatest", direction.radial_deviation_max_um),
                (of("Fmin"), "radial deviation, least", direction.radial_deviation_min_um),
            ] {
                self.figure(&section, &id, meaning, value, "um");
            }
        }
        for (id, meaning, value) in [
            ("G(b)", "bidirectional circular deviation", test.bidirectional_circular_deviation_um),
            ("D", "mean bidirectional radial deviation", test.mean_bidirectional_radial_deviation_um),
            ("H", "circular hysteresis", test.hysteresis_um),
        ] {
            if let Some(value) = value {
                self.figure(&section, id, meaning, value, "um");
            }
        }
        for fault in &test.diagnosis {
            let meaning = format!("{} of {}, {:.1} % of the path", fault.fault, fault.axes, fault.share_percent);
            self.0.rows.extend(fault.values.iter().map(|value| {
                let u = if value.u > 0.0 { Cell::exact(value.u) } else { "".into() };
                let id = format!("{} {}", fault.fault, value.id);
                cells![&section, id, &meaning, Cell::exact(value.value), u, &value.unit]
            }));
        }
    }
}
