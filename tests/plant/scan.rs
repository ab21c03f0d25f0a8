//! Detectors that know more than a trace can: bounds for its power at the same rate of false claims.
//!
//! All know the noise and the outliers. The *matched* detector knows the effect too, and tests it alone. The *scan* searches
//! the catalogue and knows the positions, widths and time constants of the truth. The scan of the *library* does not: it
//! searches every shape of a trace on grids of these numbers, and so states what a search can find. The null distribution of
//! the best score comes from draws of white noise, and entries whose gain is within 2 σ of the best are named beside it.
//!
//! [`Scan::selective_p_value`] is the exact p-value of the first step of forward stepwise regression, given that this
//! entry was selected: the tail of a truncated χ distribution (Loftus and Taylor, *A significance test for forward
//! stepwise model selection*, 2014).

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::effect::Injected;
use super::families;
use super::naming::{EffectLabel, named};
use super::oracle::{Oracle, WEAK_U, orthonormal};
use super::recipe::{Row, SimulatedSession};
use super::whitening::whiten;

/// Draws of the null distribution of the scan, as a trace has.
const DRAWS: usize = 199;

/// Probability of a false claim.
const LEVEL: f64 = 0.01;

/// Gain of the best entry in excess of that of the truth up to which the truth is named beside it.
const NAMED_BESIDE: f64 = 4.0;

/// The whitened residual of a session and the responses of all entries, both orthogonal to the parameters.
pub struct Scan {
    residual: DVector<f64>,
    /// The entries; those of single columns have none.
    entries: Vec<Injected>,
    /// Orthonormal columns of each entry; none if it is not identifiable.
    responses: Vec<DMatrix<f64>>,
    /// The places of the entries with the name of each true effect, that effect itself the first if the scan knows it.
    truths: Vec<Vec<usize>>,
    parameter_space: DMatrix<f64>,
}

/// What a scan made of a session.
#[derive(Clone, Copy, Debug)]
pub struct Detected {
    /// Every true effect is named.
    pub named: bool,
    /// Number of claims.
    pub claims: usize,
}

/// −ln of the probability that noise has this gain.
fn score(gain: f64, freedom: usize) -> f64 {
    let tail = ChiSquared::new(freedom.max(1) as f64).unwrap().sf(gain);
    if tail > 0.0 { -tail.ln() } else { 0.5 * gain }
}

impl Scan {
    /// The scan of a session for the entries of the catalogue with the numbers of the true effects. A session without
    /// effects takes them from `like`.
    pub fn of(oracle: &Oracle, draw: &SimulatedSession, like: &[Injected]) -> Scan {
        let mut entries: Vec<Injected> = draw.truth.effects.clone();
        for other in like.iter().flat_map(|like| families::catalogue(oracle.plan.kind, like)) {
            if entries.iter().all(|entry| named(entry) != named(&other)) {
                entries.push(other);
            }
        }
        Scan::of_entries(oracle, draw, entries)
    }

    /// The scan of a session for all that a trace searches, with the numbers of shapes on grids.
    pub fn of_library(oracle: &Oracle, draw: &SimulatedSession) -> Scan {
        Scan::of_entries(oracle, draw, families::library(oracle.plan.kind))
    }

    fn of_entries(oracle: &Oracle, draw: &SimulatedSession, entries: Vec<Injected>) -> Scan {
        let rows: Vec<Row> = draw.rows.iter().copied().filter(|row| !row.outlier).collect();
        let instants: Vec<usize> = rows.iter().map(|row| row.instant).collect();
        let unknowns = &oracle.plan.unknowns;
        let whitened = |columns: DMatrix<f64>| {
            let whitened = whiten(&oracle.plan, oracle.noise, &instants, columns);
            whitened.insert_rows(rows.len(), unknowns.len(), 0.0)
        };
        let mut base = whitened(oracle.base.select_rows(&instants));
        let u = |k: usize| unknowns[k].prior_u_um.unwrap_or(WEAK_U);
        (0..unknowns.len()).for_each(|k| base[(rows.len() + k, k)] = 1.0 / u(k));
        let parameter_space = base.qr().q();

        let fit = oracle.fit(draw, &[]);
        let residual = oracle.residuals_um(&rows, &fit.values, &[]);
        let mut residual =
            whitened(DMatrix::from_column_slice(rows.len(), 1, residual.as_slice())).column(0).into_owned();
        (0..unknowns.len()).for_each(|k| residual[rows.len() + k] = -fit.values[k] / u(k));
        residual -= &parameter_space * parameter_space.tr_mul(&residual);

        let names: Vec<EffectLabel> = entries.iter().map(named).collect();
        let places = |truth: &Injected| (0..names.len()).filter(|k| names[*k] == named(truth)).collect();
        let truths = draw.truth.effects.iter().map(places).collect();
        let responses = entries.iter().map(|entry| {
            let columns = whitened(oracle.columns(entry).select_rows(&instants));
            let lengths: Vec<f64> = columns.column_iter().map(|column| column.norm()).collect();
            let mut projected = columns;
            for _ in 0..2 {
                projected -= &parameter_space * parameter_space.tr_mul(&projected);
            }
            orthonormal(projected.nrows(), projected.column_iter().zip(lengths))
        });
        let responses = responses.collect();
        Scan { residual, entries, responses, truths, parameter_space }
    }

    /// The same readings with every column of an entry as an entry, without those that are another one up to its sign:
    /// what a stepwise regression of single columns searches.
    pub fn of_columns(&self) -> Scan {
        const SAME: f64 = 1e-6;
        let mut columns: Vec<DVector<f64>> = Vec::new();
        for column in self.responses.iter().flat_map(|q| q.column_iter().map(|column| column.into_owned())) {
            if columns.iter().all(|other| other.dot(&column).abs() < 1.0 - SAME) {
                columns.push(column);
            }
        }
        let responses = columns.iter().map(|column| DMatrix::from_column_slice(column.len(), 1, column.as_slice()));
        Scan {
            residual: self.residual.clone(),
            entries: Vec::new(),
            responses: responses.collect(),
            truths: Vec::new(),
            parameter_space: self.parameter_space.clone(),
        }
    }

    /// The residual and then the columns of all entries, a line for each row, for another program.
    pub fn csv(&self) -> String {
        let mut text = String::new();
        for row in 0..self.residual.len() {
            text += &format!("{:?}", self.residual[row]);
            for value in self.responses.iter().flat_map(|q| q.row(row).iter().copied().collect::<Vec<f64>>()) {
                text += &format!(",{value:?}");
            }
            text.push('\n');
        }
        text
    }

    /// Gain and freedom of each entry.
    fn gains(&self, residual: &DVector<f64>) -> Vec<(f64, usize)> {
        self.responses.iter().map(|q| (q.tr_mul(residual).norm_squared(), q.ncols())).collect()
    }

    fn best(gains: &[(f64, usize)]) -> Option<(usize, f64)> {
        let scores = gains.iter().enumerate().filter(|(_, (_, freedom))| *freedom > 0);
        scores.map(|(k, (gain, freedom))| (k, score(*gain, *freedom))).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The entry with the best score and those named beside it.
    pub fn named(&self) -> Vec<&Injected> {
        let gains = self.gains(&self.residual);
        let Some((best, _)) = Scan::best(&gains) else { return Vec::new() };
        let is_named = |k: &usize| gains[*k].1 > 0 && gains[best].0 - gains[*k].0 <= NAMED_BESIDE;
        (0..self.entries.len()).filter(is_named).map(|k| &self.entries[k]).collect()
    }

    /// Adds an entry to the model.
    fn project_out(&mut self, entry: usize) {
        let q = self.responses[entry].clone();
        self.residual -= &q * q.tr_mul(&self.residual);
        for response in &mut self.responses {
            let rest = &*response - &q * q.tr_mul(response);
            *response = orthonormal(rest.nrows(), rest.column_iter().map(|column| (column, 1.0)));
        }
    }

    /// Whether every true effect is significant for the detector that knows it and the others.
    pub fn matches(&self) -> bool {
        (0..self.truths.len()).all(|truth| {
            let mut others = Scan {
                residual: self.residual.clone(),
                entries: Vec::new(),
                responses: self.truths.iter().map(|places| self.responses[places[0]].clone()).collect(),
                truths: Vec::new(),
                parameter_space: DMatrix::zeros(0, 0),
            };
            (0..self.truths.len()).filter(|k| *k != truth).for_each(|k| others.project_out(k));
            let (gain, freedom) = others.gains(&others.residual)[truth];
            freedom > 0 && score(gain, freedom) >= -LEVEL.ln()
        })
    }

    /// What the scan makes of the session.
    pub fn detect(mut self, seed: u64) -> Detected {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let (mut claims, mut named) = (0, vec![false; self.truths.len()]);
        // One claim more than there are effects shows whether the scan goes on.
        while claims <= self.truths.len() {
            let gains = self.gains(&self.residual);
            let Some((best, found)) = Scan::best(&gains) else { break };
            let above = self.null_best(&mut random).into_iter().filter(|score| *score >= found).count();
            if (above + 1) as f64 > LEVEL * (DRAWS + 1) as f64 {
                break;
            }
            claims += 1;
            for (named, places) in named.iter_mut().zip(&self.truths) {
                *named |= self.is_beside(&gains, best, places);
            }
            self.project_out(best);
        }
        Detected { named: named.iter().all(|named| *named), claims }
    }

    /// Whether one of some entries is the best or is named beside it.
    fn is_beside(&self, gains: &[(f64, usize)], best: usize, places: &[usize]) -> bool {
        places.iter().any(|k| gains[best].0 - gains[*k].0 <= NAMED_BESIDE && gains[*k].1 > 0)
    }

    /// The best scores of draws of white noise.
    fn null_best(&self, random: &mut Pcg64Mcg) -> Vec<f64> {
        let noise = DMatrix::from_fn(self.residual.len(), DRAWS, |_, _| StandardNormal.sample(random));
        let noise = &noise - &self.parameter_space * self.parameter_space.tr_mul(&noise);
        let mut best = vec![0.0_f64; DRAWS];
        for q in self.responses.iter().filter(|q| q.ncols() > 0) {
            let along = q.tr_mul(&noise);
            for (best, along) in best.iter_mut().zip(along.column_iter()) {
                *best = best.max(score(along.norm_squared(), q.ncols()));
            }
        }
        best
    }

    /// The probability of a larger norm of the response to the best entry, given that this entry is the best and given
    /// the residual beside its direction, in a session without an effect. The second value is whether the truth is named.
    pub fn selective_p_value(&self) -> (f64, bool) {
        const STEP: f64 = 0.005;
        let gains = self.gains(&self.residual);
        let Some((best, _)) = Scan::best(&gains) else { return (1.0, false) };
        let (gain, freedom) = gains[best];
        let length = gain.sqrt();
        let q = &self.responses[best];
        let direction = q * q.tr_mul(&self.residual) / length;
        let rest = &self.residual - &direction * length;
        let coordinates: Vec<(DVector<f64>, DVector<f64>)> =
            self.responses.iter().map(|q| (q.tr_mul(&rest), q.tr_mul(&direction))).collect();
        // ln of the density of χ, without its constant, relative to that at the found length.
        let density = |t: f64| ((freedom as f64 - 1.0) * (t / length).ln() - 0.5 * (t * t - gain)).exp();
        let selected = |t: f64| {
            let own = score(t * t, freedom);
            coordinates.iter().enumerate().all(|(k, (rest, along))| {
                k == best || along.is_empty() || score((rest + along * t).norm_squared(), along.len()) <= own
            })
        };
        let (mut total, mut above) = (0.0, 0.0);
        for k in 0..((length + 8.0) / STEP) as usize {
            let t = (k as f64 + 0.5) * STEP;
            let weight = density(t);
            // Beyond these lengths the density does not count.
            if weight < 1e-9 && t > length || !selected(t) {
                continue;
            }
            total += weight;
            above += if t > length { weight } else { 0.0 };
        }
        let named = self.truths.iter().all(|places| self.is_beside(&gains, best, places));
        (if total > 0.0 { above / total } else { 1.0 }, named)
    }
}
