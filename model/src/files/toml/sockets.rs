//! Reader of `[[socket_distance]]`: sockets at known distances.

use super::quantity::MICROMETRE;
use crate::error::ModelError;
use crate::files::toml::document::Table;
use crate::instrument::{InstrumentKind, SharedBy};
use crate::session::{SocketDistance, Test};
use crate::words;

/// `[[socket_distance]] between = ["0", "1"], mm = 50.0, u_um = 100`; without `u_um` the distance is exact.
pub(super) fn socket_distances(
    kind: InstrumentKind,
    tests: &[Test],
    root: &mut Table<'_>,
    read: bool,
) -> Result<Vec<SocketDistance>, ModelError> {
    let Some(value) = root.take("socket_distance") else {
        return Ok(Vec::new());
    };
    if !kind.shares(SharedBy::Socket) {
        let message = format!("[[socket_distance]] in a session whose instrument is a {}", kind.word());
        return Err(value.source.error(value.key_span.clone(), message, None));
    }
    let mut distances = Vec::new();
    for item in value.list("tables [[socket_distance]]")? {
        let mut table = item.table("[[socket_distance]]".into())?;
        let between = table.require("between", "the two sockets, such as [\"0\", \"1\"]")?;
        let (source, span) = (between.source, between.span.clone());
        let mut names = Vec::new();
        for name in between.list("a list of two sockets")? {
            let socket = name.text()?;
            // Sockets named by a column are known after the data are read.
            if read && !tests.iter().any(|test| test.socket.as_deref() == Some(socket.as_str())) {
                let mut known: Vec<&str> = tests.iter().filter_map(|test| test.socket.as_deref()).collect();
                known.dedup();
                let help = format!("sockets here: {}", known.join(", "));
                return Err(name.error(format!("no test has the socket \"{socket}\""), Some(help)));
            }
            names.push(socket);
        }
        let Ok(between) = <[String; 2]>::try_from(names) else {
            return Err(source.error(span, "`between` needs two sockets", None));
        };
        if between[0] == between[1] {
            return Err(source.error(span, "`between` needs two different sockets", None));
        }
        let distance_mm = table.require("mm", "the distance in mm")?.positive()?;
        let u_mm = match table.take("u_um") {
            Some(value) => {
                let u = value.number()?;
                if u < 0.0 {
                    return Err(value.error(format!("`u_um` is {}; it cannot be negative", words::number(u)), None));
                }
                u * MICROMETRE
            }
            None => 0.0,
        };
        table.finish()?;
        distances.push(SocketDistance { between, distance_mm, u_mm });
    }
    Ok(distances)
}
