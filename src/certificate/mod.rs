//! Digital calibration certificates: the estimates of a fit, with what the laboratory states, as the XML of PTB's schema.
//!
//! The laboratory, the customer and the persons stand in a file of their own, `certificate.toml` ([`Certificate`]); machine,
//! dates and figures come from the session and its fit. Schema: DCC 3.1.2 with D-SI 2.1.0 (<https://ptb.de/dcc>).

mod write;

use abbe_files::Source;
use abbe_files::read::lowered;
use abbe_identify::error;
use abbe_identify::fit::FitResult;
use abbe_identify::problem::Problem;
use abbe_model::Diagnostic;
use abbe_model::calendar;
use abbe_model::document::fault::{Fault, Within};
use abbe_model::parameter_id::ParameterId;
use abbe_model::session::Session;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The administrative data of a certificate: what no measurement tells.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Certificate {
    /// Number, dates and place.
    pub certificate: Head,
    /// What is calibrated; by default the machine of the session with the `serial_number` of `[about]`.
    #[serde(default)]
    pub item: Item,
    /// The calibration laboratory.
    pub laboratory: Organisation,
    /// The customer.
    pub customer: Organisation,
    /// The persons who are responsible for the certificate.
    pub person: Vec<Person>,
    /// The measuring equipment.
    #[serde(default)]
    pub equipment: Vec<Equipment>,
    /// The conditions during the measurement.
    #[serde(default)]
    pub conditions: Conditions,
}

/// Number, dates and place of a certificate.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename = "certificate_head", deny_unknown_fields)]
pub struct Head {
    /// The number of the certificate, which no other has.
    pub id: String,
    /// Country, two letters of ISO 3166-1: `DE`.
    pub country: String,
    /// Language of the texts of the certificate that the laboratory states, two letters of ISO 639-1; default `en`.
    pub language: Option<String>,
    /// First day of the measurement, `2026-11-23`; by default the `date` of `[about]` in the session.
    pub begin: Option<String>,
    /// Last day of the measurement; by default the first.
    pub end: Option<String>,
    /// Where the measurement was made.
    #[serde(default)]
    pub place: Place,
}

/// Where a measurement is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename = "certificate_place", rename_all = "kebab-case")]
pub enum Place {
    /// At the customer's.
    #[default]
    Customer,
    /// In the laboratory.
    Laboratory,
    /// At a branch of the laboratory.
    LaboratoryBranch,
    /// At a branch of the customer.
    CustomerBranch,
    /// At another place.
    Elsewhere,
}

/// What is calibrated.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename = "certificate_item", deny_unknown_fields)]
pub struct Item {
    /// Name; by default that of the machine.
    pub name: Option<String>,
    /// Manufacturer.
    pub manufacturer: Option<String>,
    /// Model.
    pub model: Option<String>,
    /// Serial number.
    pub serial_number: Option<String>,
}

/// A measuring device.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename = "certificate_equipment", deny_unknown_fields)]
pub struct Equipment {
    /// Name.
    pub name: String,
    /// Manufacturer.
    pub manufacturer: Option<String>,
    /// Model.
    pub model: Option<String>,
    /// Serial number.
    pub serial_number: Option<String>,
    /// Number of its own certificate.
    pub certificate: Option<String>,
}

/// An organisation and where it is.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename = "certificate_organisation", deny_unknown_fields)]
pub struct Organisation {
    /// Name.
    pub name: String,
    /// Street with number.
    pub street: Option<String>,
    /// Postal code.
    pub post_code: Option<String>,
    /// City.
    pub city: String,
    /// Country, two letters of ISO 3166-1.
    pub country: Option<String>,
    /// Address for electronic mail.
    pub email: String,
    /// Telephone.
    pub phone: Option<String>,
    /// Code of the accreditation, of a laboratory.
    pub code: Option<String>,
}

/// A person who is responsible for a certificate.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename = "certificate_person", deny_unknown_fields)]
pub struct Person {
    /// Name.
    pub name: String,
    /// Task.
    pub role: Option<String>,
    /// Whether the person signs.
    #[serde(default)]
    pub signs: bool,
}

/// The conditions during a measurement.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename = "certificate_conditions", deny_unknown_fields)]
pub struct Conditions {
    /// Lowest and highest temperature of the air, °C.
    #[schemars(extend("minItems" = 2, "maxItems" = 2))]
    pub temperature_c: Option<Vec<f64>>,
}

/// An example of the file, for messages and the manual.
pub const EXAMPLE: &str = r#"[certificate]
id = "2026-0042"
country = "DE"
begin = "2026-11-23"

[item]
manufacturer = "Hermle"
model = "C 600 U"
serial_number = "17-331"

[laboratory]
name = "Example Metrology"
street = "Main Street 1"
post_code = "70173"
city = "Stuttgart"
country = "DE"
email = "laboratory@example.org"

[customer]
name = "Example Aerospace"
city = "Ulm"
email = "quality@example.com"

[[person]]
name = "A. Example"
role = "head of the laboratory"
signs = true

[[equipment]]
name = "ball bar"
serial_number = "B 1234"
certificate = "2026-0007"

[conditions]
temperature_c = [19.6, 20.3]
"#;

/// The administrative data of a file.
///
/// # Errors
/// With file, line and key: a key that is unknown or absent, an empty text, a country or language that is no code of two
/// letters, a day that is none, an end before its begin.
pub fn read(source: &Source) -> Result<Certificate, Diagnostic> {
    lowered(source, |certificate: &Certificate| {
        check(certificate)?;
        Ok(certificate.clone())
    })
}

/// Refuses what the schema of certificates does not permit.
fn check(certificate: &Certificate) -> Result<(), Fault> {
    let head = &certificate.certificate;
    let of_head = |fault: Fault| fault.at("certificate");
    code("country", Some(&head.country), char::is_ascii_uppercase).map_err(of_head)?;
    code("language", head.language.as_ref(), char::is_ascii_lowercase).map_err(of_head)?;
    for (key, day) in [("begin", &head.begin), ("end", &head.end)] {
        if day.as_deref().is_some_and(|text| self::day(text).is_none()) {
            return Err(of_head(Fault::unexpected("a day: \"2026-11-23\"").at(key)));
        }
    }
    for (key, own) in [("laboratory", &certificate.laboratory), ("customer", &certificate.customer)] {
        code("country", own.country.as_ref(), char::is_ascii_uppercase).within(key)?;
    }
    texts(&serde_json::to_value(certificate).map_err(|fault| fault.to_string())?)?;
    if certificate.person.is_empty() {
        return Err(Fault::missing("person", "who is responsible for the certificate: `[[person]]` with `name`"));
    }
    match certificate.conditions.temperature_c.as_deref() {
        None => Ok(()),
        Some([low, high]) if low.is_finite() && high.is_finite() && low <= high => Ok(()),
        Some(_) => Err(Fault::unexpected("the lowest and the highest temperature: [19.6, 20.3]")
            .at("temperature_c")
            .at("conditions")),
    }
}

/// Refuses texts that are empty, have blanks at an end or characters that XML does not permit.
fn texts(of: &Value) -> Result<(), Fault> {
    match of {
        Value::String(text) if !is_text(text) => {
            Err(Fault::unexpected("a text without blanks at its ends and without control characters"))
        }
        Value::Array(items) => (0..).zip(items).try_for_each(|(number, item)| texts(item).within_item(number)),
        Value::Object(table) => table.iter().try_for_each(|(key, value)| texts(value).within(key)),
        _ => Ok(()),
    }
}

/// Whether a text is one that a certificate may have: not empty, without blanks at its ends, and of characters that XML 1.0
/// permits in a line.
fn is_text(text: &str) -> bool {
    let is_permitted = |letter: char| !letter.is_control() && !matches!(letter, '\u{fffe}' | '\u{ffff}');
    !text.is_empty() && text.trim() == text && text.chars().all(is_permitted)
}

/// Refuses what is no code of two letters.
fn code(key: &str, text: Option<&String>, is_letter: fn(&char) -> bool) -> Result<(), Fault> {
    if text.is_none_or(|text| text.len() == 2 && text.chars().all(|letter| is_letter(&letter))) {
        return Ok(());
    }
    let example =
        if key == "language" { "two small letters of ISO 639-1: \"en\"" } else { "two capitals of ISO 3166-1: \"DE\"" };
    Err(Fault::unexpected(example).at(key))
}

/// The day of a text without a time, as the schema writes it; `None` for other texts.
fn day(text: &str) -> Option<String> {
    let moment = calendar::iso(text).filter(|moment| moment.second.is_none())?;
    Some(calendar::date(moment.day? as f64))
}

/// The certificate of a session: what the laboratory states, and where that says nothing, the notes of the session.
pub struct Stated<'c> {
    certificate: &'c Certificate,
    /// First and last day of the measurement.
    days: [String; 2],
    serial_number: String,
}

impl<'c> Stated<'c> {
    /// What the laboratory states, with `date` and `serial_number` of `[about]`.
    ///
    /// # Errors
    /// If neither states a serial number and a day, or the last day is before the first.
    pub fn of(certificate: &'c Certificate, session: &Session) -> Result<Stated<'c>, Diagnostic> {
        let about = |name: &str| session.about.iter().find(|(known, _)| known == name).map(|(_, text)| text.as_str());
        let lacking = |key: &str, table: &str, note: &str| {
            let remedy = format!(
                "state it in `[{table}]` of the file of the certificate, or as `{note}` in `[about]` of the session"
            );
            error::missing("the certificate", key, remedy)
        };
        let head = &certificate.certificate;
        let begin = match &head.begin {
            Some(begin) => day(begin),
            None => about("date").and_then(|date| day(date.get(..10)?)),
        };
        let begin = begin.ok_or_else(|| lacking("day of the measurement (`begin`)", "certificate", "date"))?;
        let end = head.end.as_deref().and_then(day).unwrap_or_else(|| begin.clone());
        // Days of this form are in the order of their texts.
        if end < begin {
            let (one, other) = (format!("`end` on {end}"), format!("`begin` on {begin}"));
            let remedy = "the measurement ends after it begins";
            return Err(error::contradictory(one, other, remedy));
        }
        let noted = about("serial_number").map(str::trim).filter(|number| is_text(number));
        let number = certificate.item.serial_number.as_deref().or(noted);
        let number = number.ok_or_else(|| lacking("`serial_number`", "item", "serial_number"))?;
        Ok(Stated { certificate, days: [begin, end], serial_number: number.to_string() })
    }

    /// The certificate of a fit of the session as XML. The errors of the machine are its quantities, each with `U = 2u`.
    /// Its text names those that hold with the stated uncertainties of the set-up only, and what it leaves out:
    /// coefficients of effects, which mean nothing without their shape, and errors that the readings do not determine.
    ///
    /// # Errors
    /// If the readings contradict the session, if the model lacks an effect or that cannot be judged, or if no error is
    /// determined.
    pub fn xml(&self, problem: &Problem, result: &FitResult) -> Result<String, Diagnostic> {
        let refused = |why| Err(Diagnostic::identification(format!("there is no certificate: {why}")));
        if let Some(why) = result.model.outcome.goodness.forbids_decisions() {
            return refused(why);
        }
        if !result.plausibility.conflicts.is_empty() {
            return refused("the readings contradict the session");
        }
        let (mut certified, mut coefficients) = (Vec::new(), Vec::new());
        for own in &result.model.parameters {
            match (own.id.parse::<ParameterId>(), write::si_unit(&own.unit)) {
                (Ok(ParameterId::Setup { .. }), _) => {}
                (Ok(ParameterId::Error(_)), Some(unit)) if own.u > 0.0 => certified.push((own, unit)),
                _ => coefficients.push(own.id.as_str()),
            }
        }
        if certified.is_empty() {
            return refused("the readings determine no error of the machine");
        }
        let open = result.model.outcome.not_estimated.iter().map(|own| own.id.as_str());
        let open = open.filter(|id| id.parse::<ParameterId>().is_ok_and(|id| id.is_error())).collect();
        write::document(&write::Contents {
            session: &problem.session,
            result,
            stated: self,
            certified,
            coefficients,
            open,
        })
        .map_err(|cause| error::not_written("the certificate", cause))
    }
}
