//! Conversion of a cell to a number.

use abbe_model::session::limits;

use super::request::Format;

/// A finite number in a cell, or its fault and what to do.
pub(crate) fn number(cell: &str, format: &Format) -> Result<f64, (String, &'static str)> {
    const NUMBER: &str = "enter a number or remove the row";
    if cell.is_empty() {
        return Err(("an empty cell where a number is expected".into(), NUMBER));
    }
    let parsed = if format.decimal == b',' {
        if cell.contains('.') {
            return Err((
                format!("`{cell}` has a decimal point, but `decimal = \",\"` is declared"),
                "declare the decimal sign of the file",
            ));
        }
        cell.replace(',', ".").parse::<f64>()
    } else {
        cell.parse::<f64>()
    };
    match parsed {
        Ok(value) if value.abs() <= limits::LARGEST => Ok(value),
        Ok(value) if value.is_nan() => Err((format!("`{cell}` is not a number (NaN)"), NUMBER)),
        Ok(_) => {
            let fault = format!("`{cell}` is infinite or too large; the limit is {:e}", limits::LARGEST);
            Err((fault, NUMBER))
        }
        Err(_) if cell.replacen(',', ".", 1).parse::<f64>().is_ok() => {
            Err((format!("`{cell}` has a decimal comma, which is not declared"), "declare `[format] decimal = \",\"`"))
        }
        Err(_) => Err((format!("`{cell}` is not a number"), NUMBER)),
    }
}
