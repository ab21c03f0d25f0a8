//! The XML of a certificate.

use std::io;

use abbe_identify::fit::FitResult;
use abbe_identify::results::{DeterminedBy, Estimate};
use abbe_identify::tolerance::rule::Decision;
use abbe_model::axis::AxisKind;
use abbe_model::component::{ErrorKind, ErrorName};
use abbe_model::session::Session;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use super::{Organisation, Place, Stated};
use crate::report::number::unit;

/// The schema of certificates that the document follows.
const SCHEMA: &str = "3.1.2";
/// Probability of an interval of `± 2u` of the normal distribution.
const COVERAGE: &str = "0.9545";

/// What a certificate states.
pub struct Contents<'c> {
    pub session: &'c Session,
    pub result: &'c FitResult,
    pub stated: &'c Stated<'c>,
    /// Its errors, each with its unit of D-SI.
    pub certified: Vec<(&'c Estimate, &'static str)>,
    /// Estimates that it leaves out.
    pub coefficients: Vec<&'c str>,
    /// Errors that the readings do not determine.
    pub open: Vec<&'c str>,
}

type Xml = Writer<Vec<u8>>;

/// The document, in UTF-8.
pub fn document(contents: &Contents) -> io::Result<String> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let location = format!("https://ptb.de/dcc https://ptb.de/dcc/v{SCHEMA}/dcc.xsd");
    let attributes = [
        ("xmlns:dcc", "https://ptb.de/dcc"),
        ("xmlns:si", "https://ptb.de/si"),
        ("xmlns:xsi", "http://www.w3.org/2001/XMLSchema-instance"),
        ("xsi:schemaLocation", &location),
        ("schemaVersion", SCHEMA),
    ];
    xml.create_element("dcc:digitalCalibrationCertificate").with_attributes(attributes).write_inner_content(|xml| {
        administrative(xml, contents)?;
        results(xml, contents)
    })?;
    let mut text = String::from_utf8(xml.into_inner()).map_err(io::Error::other)?;
    text.push('\n');
    Ok(text)
}

/// An element with elements in it.
fn within(xml: &mut Xml, name: &str, inner: impl FnOnce(&mut Xml) -> io::Result<()>) -> io::Result<()> {
    xml.create_element(name).write_inner_content(inner).map(|_| ())
}

/// An element with a text.
fn text(xml: &mut Xml, name: &str, text: &str) -> io::Result<()> {
    xml.create_element(name).write_text_content(BytesText::new(text)).map(|_| ())
}

/// The same, if there is a text.
fn stated(xml: &mut Xml, name: &str, own: Option<&str>) -> io::Result<()> {
    own.map_or(Ok(()), |own| text(xml, name, own))
}

/// An element with a text in a language.
fn words(xml: &mut Xml, name: &str, language: &str, own: &str) -> io::Result<()> {
    within(xml, name, |xml| {
        let content = xml.create_element("dcc:content").with_attribute(("lang", language));
        content.write_text_content(BytesText::new(own)).map(|_| ())
    })
}

fn administrative(xml: &mut Xml, contents: &Contents) -> io::Result<()> {
    let Stated { certificate, days: [begin, end], serial_number } = contents.stated;
    let head = &certificate.certificate;
    let language = head.language.as_deref().unwrap_or("en");
    within(xml, "dcc:administrativeData", |xml| {
        within(xml, "dcc:dccSoftware", |xml| {
            within(xml, "dcc:software", |xml| {
                words(xml, "dcc:name", "en", "Abbe")?;
                text(xml, "dcc:release", env!("CARGO_PKG_VERSION"))
            })
        })?;
        within(xml, "dcc:coreData", |xml| {
            text(xml, "dcc:countryCodeISO3166_1", &head.country)?;
            // The texts that Abbe writes are English.
            for used in ["en", language].iter().take(if language == "en" { 1 } else { 2 }) {
                text(xml, "dcc:usedLangCodeISO639_1", used)?;
            }
            text(xml, "dcc:mandatoryLangCodeISO639_1", "en")?;
            text(xml, "dcc:uniqueIdentifier", &head.id)?;
            text(xml, "dcc:beginPerformanceDate", begin)?;
            text(xml, "dcc:endPerformanceDate", end)?;
            let place = match head.place {
                Place::Customer => "customer",
                Place::Laboratory => "laboratory",
                Place::LaboratoryBranch => "laboratoryBranch",
                Place::CustomerBranch => "customerBranch",
                Place::Elsewhere => "other",
            };
            text(xml, "dcc:performanceLocation", place)
        })?;
        within(xml, "dcc:items", |xml| {
            let own = &certificate.item;
            let name = own.name.as_deref().unwrap_or(&contents.session.machine.name);
            let made = [own.manufacturer.as_deref(), own.model.as_deref()];
            within(xml, "dcc:item", |xml| device(xml, language, name, made, [Some(serial_number), None]))
        })?;
        within(xml, "dcc:calibrationLaboratory", |xml| {
            stated(xml, "dcc:calibrationLaboratoryCode", certificate.laboratory.code.as_deref())?;
            within(xml, "dcc:contact", |xml| contact(xml, language, &certificate.laboratory))
        })?;
        within(xml, "dcc:respPersons", |xml| {
            for person in &certificate.person {
                within(xml, "dcc:respPerson", |xml| {
                    within(xml, "dcc:person", |xml| words(xml, "dcc:name", language, &person.name))?;
                    stated(xml, "dcc:role", person.role.as_deref())?;
                    text(xml, "dcc:mainSigner", if person.signs { "true" } else { "false" })
                })?;
            }
            Ok(())
        })?;
        within(xml, "dcc:customer", |xml| contact(xml, language, &certificate.customer))
    })
}

/// The contents of a device, with its manufacturer and model, its serial number and the number of its certificate.
fn device(
    xml: &mut Xml,
    language: &str,
    name: &str,
    [manufacturer, model]: [Option<&str>; 2],
    [serial_number, certificate]: [Option<&str>; 2],
) -> io::Result<()> {
    words(xml, "dcc:name", language, name)?;
    if let Some(manufacturer) = manufacturer {
        within(xml, "dcc:manufacturer", |xml| words(xml, "dcc:name", language, manufacturer))?;
    }
    stated(xml, "dcc:model", model)?;
    let identifications =
        [(serial_number, "manufacturer", "Serial number"), (certificate, "calibrationLaboratory", "Certificate")];
    let known =
        identifications.into_iter().filter_map(|(value, issuer, name)| value.map(|value| (value, issuer, name)));
    let known: Vec<_> = known.collect();
    if known.is_empty() {
        return Ok(());
    }
    within(xml, "dcc:identifications", |xml| {
        for (value, issuer, name) in known {
            within(xml, "dcc:identification", |xml| {
                text(xml, "dcc:issuer", issuer)?;
                text(xml, "dcc:value", value)?;
                words(xml, "dcc:name", "en", name)
            })?;
        }
        Ok(())
    })
}

fn contact(xml: &mut Xml, language: &str, own: &Organisation) -> io::Result<()> {
    words(xml, "dcc:name", language, &own.name)?;
    text(xml, "dcc:eMail", &own.email)?;
    stated(xml, "dcc:phone", own.phone.as_deref())?;
    within(xml, "dcc:location", |xml| {
        text(xml, "dcc:city", &own.city)?;
        stated(xml, "dcc:countryCode", own.country.as_deref())?;
        stated(xml, "dcc:postCode", own.post_code.as_deref())?;
        stated(xml, "dcc:street", own.street.as_deref())
    })
}

fn results(xml: &mut Xml, contents: &Contents) -> io::Result<()> {
    let Contents { stated: Stated { certificate, .. }, certified, session, .. } = contents;
    let language = certificate.certificate.language.as_deref().unwrap_or("en");
    within(xml, "dcc:measurementResults", |xml| {
        within(xml, "dcc:measurementResult", |xml| {
            words(xml, "dcc:name", "en", "Geometric errors of the machine")?;
            words(xml, "dcc:description", "en", &description(contents))?;
            within(xml, "dcc:usedMethods", |xml| {
                within(xml, "dcc:usedMethod", |xml| {
                    words(xml, "dcc:name", "en", "Least-squares fit of the kinematic model to all readings")?;
                    words(xml, "dcc:description", "en", &method(contents))?;
                    text(xml, "dcc:norm", "JCGM 102:2011")?;
                    // Location errors of rotary axes are those of this standard.
                    if certified.iter().any(|(own, _)| is_of_rotary_axis(session, &own.id)) {
                        text(xml, "dcc:norm", "ISO 230-7:2015")?;
                    }
                    Ok(())
                })
            })?;
            if !certificate.equipment.is_empty() {
                within(xml, "dcc:measuringEquipments", |xml| {
                    for own in &certificate.equipment {
                        let made = [own.manufacturer.as_deref(), own.model.as_deref()];
                        let numbers = [own.serial_number.as_deref(), own.certificate.as_deref()];
                        within(xml, "dcc:measuringEquipment", |xml| device(xml, language, &own.name, made, numbers))?;
                    }
                    Ok(())
                })?;
            }
            if let Some([low, high]) = certificate.conditions.temperature_c.as_deref() {
                within(xml, "dcc:influenceConditions", |xml| {
                    within(xml, "dcc:influenceCondition", |xml| {
                        words(xml, "dcc:name", "en", "Temperature of the air")?;
                        within(xml, "dcc:data", |xml| {
                            for (name, value) in [("lowest", low), ("highest", high)] {
                                within(xml, "dcc:quantity", |xml| {
                                    words(xml, "dcc:name", "en", name)?;
                                    real(xml, name, *value, "\\degreecelsius", None)
                                })?;
                            }
                            Ok(())
                        })
                    })
                })?;
            }
            within(xml, "dcc:results", |xml| {
                for (own, unit) in certified {
                    within(xml, "dcc:result", |xml| {
                        words(xml, "dcc:name", "en", &format!("{}: {}", own.id, own.meaning))?;
                        within(xml, "dcc:data", |xml| {
                            within(xml, "dcc:quantity", |xml| {
                                words(xml, "dcc:name", "en", &own.id)?;
                                real(xml, &own.id, own.value, unit, Some(own.expanded_u))?;
                                conformity(xml, contents, &own.id)
                            })
                        })
                    })?;
                }
                Ok(())
            })
        })
    })
}

/// A quantity with its expanded uncertainty.
fn real(xml: &mut Xml, label: &str, value: f64, unit: &str, expanded_u: Option<f64>) -> io::Result<()> {
    within(xml, "si:real", |xml| {
        text(xml, "si:label", label)?;
        text(xml, "si:value", &decimal(value))?;
        text(xml, "si:unit", unit)?;
        let Some(expanded_u) = expanded_u else { return Ok(()) };
        within(xml, "si:expandedUnc", |xml| {
            text(xml, "si:uncertainty", &decimal(expanded_u))?;
            text(xml, "si:coverageFactor", "2")?;
            text(xml, "si:coverageProbability", COVERAGE)?;
            text(xml, "si:distribution", "normal")
        })
    })
}

/// A number with the digits that tell it from others: `12.5`, `3.1e-7`.
fn decimal(value: f64) -> String {
    let plain = format!("{value}");
    if plain.len() <= 20 { plain } else { format!("{value:e}") }
}

/// The name in D-SI of the unit of an error. `None` for units that no error has.
pub fn si_unit(unit: &str) -> Option<&'static str> {
    match unit {
        "um" => Some("\\micro\\metre"),
        "um/m" => Some("\\micro\\metre\\metre\\tothe{-1}"),
        "arcsec" => Some("\\arcsecond"),
        "deg" => Some("\\degree"),
        _ => None,
    }
}

/// Whether this is a location error of a rotary axis.
fn is_of_rotary_axis(session: &Session, id: &str) -> bool {
    let axis = |name: &ErrorName| session.machine.axes.iter().find(|axis| axis.name == name.axis).map(|axis| axis.kind);
    ErrorName::parse(id).is_some_and(|name| name.kind == ErrorKind::Location && axis(&name) == Some(AxisKind::Rotary))
}

/// The decision about a limit of the session. An undecided one is in words: the schema has no such status.
fn conformity(xml: &mut Xml, contents: &Contents, id: &str) -> io::Result<()> {
    let Some(conformity) = &contents.result.conformity else { return Ok(()) };
    let Some(own) = conformity.items.iter().find(|item| item.id == id) else { return Ok(()) };
    let lower = own.lower.map_or(String::new(), |lower| format!("{} to ", decimal(lower)));
    let limits = format!(
        "Permitted: {lower}{} {}. Decision: {}; a pass or a fail is true with a probability of at least {}.",
        decimal(own.upper),
        unit(&own.unit),
        own.decision.word(),
        decimal(conformity.probability)
    );
    within(xml, "dcc:measurementMetaData", |xml| {
        within(xml, "dcc:metaData", |xml| {
            text(xml, "dcc:norm", "ISO 14253-1:2017")?;
            words(xml, "dcc:declaration", "en", &limits)?;
            match own.decision {
                Decision::Pass => text(xml, "dcc:conformity", "pass"),
                Decision::Fail => text(xml, "dcc:conformity", "fail"),
                Decision::Undecided => Ok(()),
            }
        })
    })
}

/// What the result is, and what it leaves out.
fn description(contents: &Contents) -> String {
    let Contents { session, certified, coefficients, open, .. } = contents;
    let by_prior = certified.iter().filter(|(own, _)| own.determined_by == DeterminedBy::Prior);
    let by_prior: Vec<&str> = by_prior.map(|(own, _)| own.id.as_str()).collect();
    let mut text = format!(
        "Errors of the axes of the machine {}. The frame, the signs and the names are those of the documentation of Abbe {}.",
        session.machine.code(),
        env!("CARGO_PKG_VERSION")
    );
    for (what, ids) in [
        ("Determined together with the stated values and uncertainties of the set-up", &by_prior),
        ("Not certified, since they are coefficients of a shape", coefficients),
        ("Not determined by the readings", open),
    ] {
        if !ids.is_empty() {
            text += &format!(" {what}: {}.", ids.join(", "));
        }
    }
    text
}

/// What was fitted, and how well.
fn method(contents: &Contents) -> String {
    let result = contents.result;
    let ratio = result.model.chi_square / result.model.degrees_of_freedom.max(1) as f64;
    format!(
        "{} readings, {} of them excluded as outliers; chi-square over degrees of freedom {ratio:.3}; expanded uncertainty U = 2u from the covariance of the fit, with the stated uncertainties of the set-up.",
        result.model.fit.readings + result.model.outliers.len(),
        result.model.outliers.len(),
    )
}
