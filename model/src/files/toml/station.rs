//! Reader of the instrument of a test: the keys of its set-up, with the location of each in the file. The instruments
//! state them.

use std::ops::Range;

use super::Context;
use super::quantity::MICROMETRE;
use crate::error::ModelError;
use crate::files::toml::document::{Table, Value};
use crate::instrument::InstrumentKind;
use crate::instrument::set_up::{SetUp, SetUpReader, Written};
use crate::session::Prior;
use crate::session::limits;
use crate::words;

/// Reads the instrument's keys of a test.
pub(super) fn set_up(context: &Context<'_>, table: &mut Table<'_>) -> Result<SetUp, ModelError> {
    let own = context.instrument.entry();
    for kind in InstrumentKind::ALL {
        for key in kind.entry().keys.iter().filter(|key| !own.keys.iter().any(|known| known.name == key.name)) {
            if let Some(value) = table.take(key.name) {
                let message =
                    format!("`{}` belongs to a {}; this session's instrument is a {}", key.name, kind.word(), own.word);
                return Err(value.source.error(value.key_span.clone(), message, None));
            }
        }
    }
    (own.read)(&mut Keys { context, table, places: Vec::new() })
}

/// The keys of a test.
struct Keys<'c, 't, 'a> {
    context: &'c Context<'c>,
    table: &'t mut Table<'a>,
    /// Where the values of keys that were read stand.
    places: Vec<(&'static str, Range<usize>)>,
}

impl<'a> Keys<'_, '_, 'a> {
    fn take(&mut self, key: &'static str) -> Option<Value<'a>> {
        let value = self.table.take(key)?;
        self.places.push((key, value.span.clone()));
        Some(value)
    }

    fn written(&self, value: &Value<'_>) -> Result<Written, ModelError> {
        let (length, mm) = self.context.length(value)?;
        Ok(Written { length, mm })
    }

    fn three_lengths(&self, value: Value<'_>) -> Result<[Written; 3], ModelError> {
        let mut point = [const { Written::number(0.0) }; 3];
        for (coordinate, item) in point.iter_mut().zip(&value.three("a list of three lengths")?) {
            *coordinate = self.written(item)?;
        }
        Ok(point)
    }
}

impl SetUpReader for Keys<'_, '_, '_> {
    fn positive_length(&mut self, key: &'static str, what: &str) -> Result<Written, ModelError> {
        let value = self.table.require(key, what)?;
        let length = self.written(&value)?;
        match limits::not_positive(key, length.mm) {
            Some(fault) => Err(value.error(fault, None)),
            None => Ok(length),
        }
    }

    fn point(&mut self, key: &'static str, what: &str) -> Result<[Written; 3], ModelError> {
        let value = self.table.require(key, what)?;
        self.three_lengths(value)
    }

    fn stated_point(&mut self, key: &'static str) -> Result<Option<[Written; 3]>, ModelError> {
        self.take(key).map(|value| self.three_lengths(value)).transpose()
    }

    fn direction(&mut self, key: &'static str) -> Result<Option<[f64; 3]>, ModelError> {
        self.take(key).map(unit_vector).transpose()
    }

    fn three_directions(&mut self, key: &'static str) -> Result<Option<[[f64; 3]; 3]>, ModelError> {
        let Some(value) = self.take(key) else {
            return Ok(None);
        };
        let mut rows = [[0.0; 3]; 3];
        for (row, item) in rows.iter_mut().zip(value.three("a list of three directions")?) {
            *row = unit_vector(item)?;
        }
        Ok(Some(rows))
    }

    fn three_angles(&mut self, key: &'static str, what: &str) -> Result<Option<[f64; 3]>, ModelError> {
        let Some(value) = self.take(key) else {
            return Ok(None);
        };
        let mut radians = [0.0; 3];
        for (angle, item) in radians.iter_mut().zip(&value.three(what)?) {
            *angle = item.number()?.to_radians();
        }
        Ok(Some(radians))
    }

    fn choice(&mut self, key: &'static str, what: &str, words: &[&str]) -> Result<usize, ModelError> {
        let value = self.table.require(key, what)?;
        let text = value.text()?;
        words.iter().position(|word| *word == text).ok_or_else(|| value.unexpected(what))
    }

    fn text(&mut self, key: &'static str) -> Result<Option<String>, ModelError> {
        self.take(key).map(|value| value.text()).transpose()
    }

    fn priors(&mut self, key: &'static str, count: usize) -> Result<Vec<Prior>, ModelError> {
        priors(self.take(key), count)
    }

    fn angle_priors(&mut self, key: &'static str) -> Result<Vec<Prior>, ModelError> {
        const ARCSECOND: f64 = std::f64::consts::PI / (180.0 * 3600.0);
        let in_mm = priors(self.take(key), 3)?.into_iter();
        Ok(in_mm
            .map(|prior| match prior {
                Prior::Gaussian(u) => Prior::Gaussian(u / MICROMETRE * ARCSECOND),
                other => other,
            })
            .collect())
    }

    fn not_both(&mut self, first: &'static str, second: &'static str, help: &str) -> Result<(), ModelError> {
        match self.table.key_span(second).filter(|_| self.table.key_span(first).is_some()) {
            Some(span) => {
                let message = format!("both `{first}` and `{second}`");
                Err(self.table.source.error(span, message, Some(help.into())))
            }
            None => Ok(()),
        }
    }

    fn fault(&self, key: &'static str, message: String, help: &str) -> ModelError {
        let place = self.places.iter().rev().find(|(known, _)| *known == key);
        let span = place.map_or_else(|| self.table.span.clone(), |(_, span)| span.clone());
        self.table.source.error(span, message, Some(help.into()))
    }
}

/// A direction of three numbers, normalised to unit length.
fn unit_vector(value: Value<'_>) -> Result<[f64; 3], ModelError> {
    let (source, span, key) = (value.source, value.span.clone(), value.key.clone());
    let items = value.three("a direction as three numbers")?;
    let mut vector = [0.0; 3];
    for (component, item) in vector.iter_mut().zip(&items) {
        *component = item.number()?;
    }
    let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length < 1e-9 {
        return Err(source.error(span, format!("`{key}` is zero"), None));
    }
    Ok(vector.map(|x| x / length))
}

/// `…_u_um`: a number for all coordinates or a list with one for each. Absent or 0 is known, `inf` is no prior.
fn priors(value: Option<Value<'_>>, count: usize) -> Result<Vec<Prior>, ModelError> {
    let Some(value) = value else {
        return Ok(vec![Prior::Known; count]);
    };
    if !value.is_list() {
        return Ok(vec![prior(&value)?; count]);
    }
    if count == 1 {
        return Err(value.unexpected("a number"));
    }
    let items = value.three("a number or a list of three")?;
    items.iter().map(prior).collect()
}

fn prior(value: &Value<'_>) -> Result<Prior, ModelError> {
    let u = value.number_or_inf("a number or `inf`")?;
    if u < 0.0 {
        let message = format!("`{}` is {}; an uncertainty cannot be negative", value.key, words::number(u));
        let help = "0 means exactly known, `inf` means unknown";
        return Err(value.error(message, Some(help.into())));
    }
    if let Some(fault) = limits::too_small_um(u) {
        let help = "0 means exactly known";
        return Err(value.error(format!("`{}` is {fault}", value.key), Some(help.into())));
    }
    Ok(if u == 0.0 {
        Prior::Known
    } else if u.is_infinite() {
        Prior::Free
    } else {
        Prior::Gaussian(u * MICROMETRE)
    })
}
