//! The rows of a foreign table: encoding, separator, decimal sign, lines above the rows, names of the columns.

use abbe_model::instrument::Fault;
use abbe_model::unit::Unit;
use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE};

use crate::table::comment::is_comment;
use crate::table::encoding;

/// A separator; `None` is any number of spaces.
type Separator = Option<char>;

const SEPARATORS: [(Separator, &str); 5] =
    [(Some('\t'), "tab"), (Some(';'), "semicolon"), (Some('|'), "|"), (Some(','), "comma"), (None, "spaces")];

/// Lines from which the separator is found.
const LOOKED_AT: usize = 400;
/// Largest number of lines with names of columns.
const MAX_NAME_LINES: usize = 3;
/// Largest share of the lines below the first row that are no rows.
const MAX_LOST: f64 = 0.1;

/// A row with its line in the file, from 0.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub line: usize,
    pub cells: Vec<String>,
}

/// A table as it stands in the file.
#[derive(Debug)]
pub(super) struct Grid {
    pub encoding: &'static str,
    pub separator: Separator,
    pub decimal: char,
    /// The rows.
    pub rows: Vec<Row>,
    /// The name of each column: those of all lines of names, the last one last.
    pub names: Vec<Vec<String>>,
    /// The unit of each column on a line of its own; empty if there is none.
    pub units: Vec<String>,
    /// The line of the names, if there is one line that a reader of tables takes as the header.
    pub header_line: Option<usize>,
    /// Lines below the first row that are no rows.
    pub lost: Vec<usize>,
    /// What a reader of tables would not accept.
    pub unreadable: Vec<String>,
}

impl Grid {
    pub fn separator_in_words(&self) -> &'static str {
        SEPARATORS.iter().find(|(separator, _)| *separator == self.separator).map_or("", |(_, words)| words)
    }

    pub fn width(&self) -> usize {
        self.rows.first().map_or(0, |row| row.cells.len())
    }

    pub fn skipped_lines(&self) -> usize {
        self.header_line.unwrap_or_else(|| self.rows.first().map_or(0, |row| row.line))
    }

    /// The lines below the first row that are no rows.
    pub fn lost_in_words(&self) -> Vec<String> {
        let last = self.rows.last().map_or(0, |row| row.line);
        let (within, after): (Vec<usize>, Vec<usize>) = self.lost.iter().partition(|line| **line < last);
        [("lines follow the last row", after), ("lines between the rows are no rows", within)]
            .into_iter()
            .filter(|(_, lines)| !lines.is_empty())
            .map(|(words, lines)| format!("{words}: {}", of_lines(&lines)))
            .collect()
    }

    /// A fault with the layout in which the file was read, which may be its reason.
    pub fn with_layout(&self, (message, help): Fault) -> Fault {
        let decimal = if self.decimal == ',' { "comma" } else { "point" };
        let names = match (self.header_line, self.names.iter().any(|names| !names.is_empty())) {
            (Some(line), _) => format!("names on line {}", line + 1),
            (None, true) => "names above the first row".into(),
            (None, false) => "no names".into(),
        };
        let first = self.rows.first().map_or(0, |row| row.line + 1);
        let layout = format!(
            "{}, separator {}, decimal {decimal}, {names}, first row on line {first}",
            self.encoding,
            self.separator_in_words()
        );
        (format!("{message} (read as {layout})"), help)
    }

    /// The name of a column in messages.
    pub fn name(&self, column: usize) -> String {
        let parts: Vec<&str> = self.names.get(column).into_iter().flatten().map(String::as_str).collect();
        if parts.is_empty() { format!("column {}", column + 1) } else { parts.join(" ") }
    }
}

/// The grid of a file.
pub(super) fn of(bytes: &[u8]) -> Result<Grid, Fault> {
    let (text, encoding) = decoded(bytes);
    if text.contains('\0') {
        let help = "export the readings as text (CSV); spreadsheets (.xlsx, .ods) are named as `data` of a test";
        return Err(("the file is no text".into(), help.into()));
    }
    let lone_return = text.replace("\r\n", "\n").contains('\r');
    let lines: Vec<&str> = if lone_return { text.split(['\n', '\r']).collect() } else { text.lines().collect() };
    let Some((separator, decimal, width)) = best_split(&lines) else {
        let help = "a table of readings has a row of numbers for each reading, in two columns or more";
        return Err((format!("the file, read as {encoding}, has no rows of numbers"), help.into()));
    };
    let mut grid = Grid {
        encoding,
        separator,
        decimal,
        rows: Vec::new(),
        names: Vec::new(),
        units: Vec::new(),
        header_line: None,
        lost: Vec::new(),
        unreadable: Vec::new(),
    };
    for (line, text) in lines.iter().enumerate() {
        if is_blank(text) || is_comment(text) {
            continue;
        }
        let cells = cells(text, separator);
        if is_row(&cells, width, decimal) {
            grid.rows.push(Row { line, cells });
        } else if !grid.rows.is_empty() {
            grid.lost.push(line);
        }
    }
    name_columns(&mut grid, &lines);
    if lone_return {
        grid.unreadable.push("its lines end with a carriage return alone".into());
    }
    if separator.is_none() {
        grid.unreadable.push("its columns are separated by spaces".into());
    }
    let last = grid.rows.last().map_or(0, |row| row.line);
    let within = grid.lost.iter().filter(|line| **line < last).count();
    if within as f64 > MAX_LOST * grid.rows.len() as f64 {
        let found = format!(
            "{within} of {} lines below the first row are no rows of {width} columns, line {} the first",
            within + grid.rows.len(),
            grid.lost[0] + 1
        );
        return Err(grid.with_layout((found, "export every reading with the same columns".into())));
    }
    let lost = grid.lost_in_words();
    grid.unreadable.extend(lost);
    comma_twice(&grid, &lines)?;
    Ok(grid)
}

/// The numbers of lines, from 1.
fn of_lines(lines: &[usize]) -> String {
    let numbers: Vec<String> = lines.iter().map(|line| (line + 1).to_string()).collect();
    abbe_model::words::first_of(&numbers.iter().map(String::as_str).collect::<Vec<_>>(), 5, ", ", "")
}

fn decoded(bytes: &[u8]) -> (String, &'static str) {
    let (found, mark) = encoding::of_start(bytes, None);
    let wide = |encoding: &'static Encoding| encoding == UTF_16LE || encoding == UTF_16BE;
    let named = |encoding: &'static Encoding| match encoding {
        encoding if encoding == UTF_8 => "utf-8",
        encoding if encoding == UTF_16LE => "utf-16le",
        encoding if encoding == UTF_16BE => "utf-16be",
        _ => "latin1",
    };
    let bytes = &bytes[mark..];
    match found {
        Some(encoding) if wide(encoding) => {
            (encoding.decode_without_bom_handling(bytes).0.into_owned(), named(encoding))
        }
        _ => match encoding::decode(bytes, None) {
            Ok((text, encoding)) => (text.into_owned(), named(encoding)),
            Err(encoding) => (String::from_utf8_lossy(bytes).into_owned(), named(encoding)),
        },
    }
}

fn is_blank(line: &str) -> bool {
    line.trim().is_empty()
}

/// The cells of a line, without surrounding spaces and quotes.
fn cells(line: &str, separator: Separator) -> Vec<String> {
    let plain = |cell: &str| {
        let cell = cell.trim();
        cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')).unwrap_or(cell).trim().to_string()
    };
    match separator {
        None => line.split_whitespace().map(plain).collect(),
        Some(separator) if line.contains('"') => {
            let mut reader = csv::ReaderBuilder::new()
                .has_headers(false)
                .delimiter(u8::try_from(separator).unwrap_or(b','))
                .flexible(true)
                .from_reader(line.as_bytes());
            let mut record = csv::StringRecord::new();
            match reader.read_record(&mut record) {
                Ok(true) => record.iter().map(plain).collect(),
                _ => line.split(separator).map(plain).collect(),
            }
        }
        Some(separator) => line.split(separator).map(plain).collect(),
    }
}

/// A number in a cell: with this decimal sign, and points between thousands if it is a comma. A unit may follow it.
pub(super) fn number(cell: &str, decimal: char) -> Option<f64> {
    let cell = cell.replace('\u{2212}', "-");
    let plain = match decimal {
        ',' if cell.contains('.') => {
            let (whole, fraction) = cell.split_once(',')?;
            let mut groups = whole.trim_start_matches(['-', '+']).split('.');
            let first = groups.next()?;
            let grouped = (1..=3).contains(&first.len()) && groups.all(|group| group.len() == 3);
            grouped.then(|| format!("{}.{fraction}", whole.replace('.', "")))?
        }
        ',' => cell.replace(',', "."),
        _ => cell,
    };
    let is_number = |text: &str| text.bytes().any(|byte| byte.is_ascii_digit()) && !text.contains(['x', 'X']);
    plain.parse::<f64>().ok().filter(|value| value.is_finite() && is_number(&plain))
}

/// The number of a cell that may end with a unit, and that unit.
pub(super) fn number_with_unit(cell: &str, decimal: char) -> Option<(f64, &str)> {
    if let Some(value) = number(cell, decimal) {
        return Some((value, ""));
    }
    let end = cell.rfind(|c: char| c.is_ascii_digit())? + 1;
    let (digits, unit) = cell.split_at(end);
    Unit::of_word(unit).and_then(|_| Some((number(digits, decimal)?, unit.trim())))
}

/// Whether cells are a row of readings: as many columns, and at least half of those filled contain numbers.
fn is_row(cells: &[String], width: usize, decimal: char) -> bool {
    let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
    cells.len() == width && filled > 0 && 2 * numbers(cells, decimal) >= filled && numbers(cells, decimal) > 0
}

fn numbers(cells: &[String], decimal: char) -> usize {
    cells.iter().filter(|cell| number_with_unit(cell, decimal).is_some()).count()
}

/// The separator and the decimal sign with which most cells are numbers in rows of one width.
fn best_split(lines: &[&str]) -> Option<(Separator, char, usize)> {
    let mut best: Option<(usize, Separator, char, usize)> = None;
    // The rows are where most lines are: those in the middle count beside the first.
    let middle = lines.len().saturating_sub(LOOKED_AT) / 2;
    let looked_at: Vec<&&str> =
        lines.iter().take(LOOKED_AT).chain(lines.iter().skip(LOOKED_AT.max(middle)).take(LOOKED_AT)).collect();
    for (separator, _) in SEPARATORS {
        for decimal in ['.', ','] {
            if separator == Some(decimal) {
                continue;
            }
            let mut by_width: std::collections::BTreeMap<usize, usize> = std::collections::BTreeMap::new();
            for line in looked_at.iter().filter(|line| !is_blank(line) && !is_comment(line)) {
                let cells = cells(line, separator);
                if cells.len() > 1 && is_row(&cells, cells.len(), decimal) {
                    *by_width.entry(cells.len()).or_default() += numbers(&cells, decimal);
                }
            }
            for (width, count) in by_width {
                if best.is_none_or(|(most, ..)| count > most) {
                    best = Some((count, separator, decimal, width));
                }
            }
        }
    }
    best.map(|(_, separator, decimal, width)| (separator, decimal, width))
}

/// Finds the lines of names and of units above the first row.
fn name_columns(grid: &mut Grid, lines: &[&str]) {
    let (first, width) = (grid.rows[0].line, grid.width());
    let mut above: Vec<(usize, bool, Vec<String>)> = Vec::new();
    for line in (0..first).rev() {
        let text = lines[line];
        if is_blank(text) {
            continue;
        }
        const MARKS: [char; 4] = ['#', '%', '!', '/'];
        let is_marked = text.trim_start().starts_with(MARKS);
        // The first cell of a line without a mark may be empty.
        let bare = if is_marked { text.trim_start().trim_start_matches(MARKS) } else { text };
        let mut found = header_cells(bare, grid.separator, width);
        // A last separator makes a last cell that is empty.
        if found.len() == width + 1 && found.last().is_some_and(String::is_empty) {
            found.pop();
        }
        let filled = found.iter().filter(|cell| !cell.is_empty()).count();
        let is_text = numbers(&found, grid.decimal) * 2 < filled;
        if found.len() > width || found.len() + 1 < width || filled < 2 || !is_text || above.len() == MAX_NAME_LINES {
            break;
        }
        found.resize(width, String::new());
        above.push((line, is_marked, found));
    }
    // The line next to the rows holds units if it holds little else.
    let is_units = |cells: &[String]| {
        let filled: Vec<&String> = cells.iter().filter(|cell| !cell.is_empty()).collect();
        2 * filled.iter().filter(|cell| Unit::of_word(bare_unit(cell)).is_some()).count() >= filled.len()
    };
    if above.len() > 1
        && let Some(place) = (0..2).find(|place| is_units(&above[*place].2))
    {
        // Units stand below the names, seldom above them.
        let names_below = place == 1 && is_units(&above[1].2) && above.len() == 2;
        if place == 0 || names_below {
            grid.units = above.remove(place).2.iter().map(|cell| bare_unit(cell).to_string()).collect();
            above.iter_mut().for_each(|line| line.1 = true);
        }
    }
    let single = match &above[..] {
        [(line, false, names)] => {
            let repeated = (0..names.len()).any(|k| names[k].is_empty() || names[..k].contains(&names[k]));
            (!repeated && names.len() == width).then_some(*line)
        }
        _ => None,
    };
    grid.header_line = single.filter(|_| grid.units.is_empty());
    grid.names = vec![Vec::new(); width];
    for (_, _, cells) in above.into_iter().rev() {
        // A name over several columns stands over the first of them.
        let spans = cells.iter().any(String::is_empty) && !cells[0].is_empty();
        let mut last = String::new();
        for (column, cell) in cells.into_iter().enumerate() {
            if !cell.is_empty() {
                last.clone_from(&cell);
            }
            let name = if cell.is_empty() && spans { last.clone() } else { cell };
            if !name.is_empty() {
                grid.names[column].push(name);
            }
        }
    }
}

/// The names on a line. Names separated by spaces may contain spaces, if two or more separate them.
fn header_cells(line: &str, separator: Separator, width: usize) -> Vec<String> {
    if separator.is_some() {
        return cells(line, separator);
    }
    let wide: Vec<String> = line
        .split("  ")
        .flat_map(|part| part.split('\t'))
        .map(str::trim)
        .filter(|part| !part.is_empty())
        .map(str::to_string)
        .collect();
    if wide.len() == width {
        return wide;
    }
    // A unit in brackets belongs to the name before it.
    let mut names: Vec<String> = Vec::new();
    for word in line.split_whitespace() {
        match names.last_mut() {
            Some(last) if word.starts_with(['[', '(']) => last.push_str(word),
            _ => names.push(word.to_string()),
        }
    }
    names
}

/// A unit without its brackets.
fn bare_unit(cell: &str) -> &str {
    cell.trim().trim_start_matches(['[', '(', '{', '<']).trim_end_matches([']', ')', '}', '>']).trim()
}

/// Refuses a table whose decimal comma is also its separator: it has twice as many columns as names.
fn comma_twice(grid: &Grid, lines: &[&str]) -> Result<(), Fault> {
    if grid.separator != Some(',') {
        return Ok(());
    }
    let first = grid.rows[0].line;
    let names = lines[..first].iter().rev().find(|line| !is_blank(line)).map_or(0, |line| cells(line, Some(',')).len());
    let points = grid.rows.iter().take(LOOKED_AT).flat_map(|row| &row.cells).filter(|cell| cell.contains('.')).count();
    if names > 1 && points == 0 && grid.width() > names && grid.width() <= 2 * names {
        let found = format!(
            "{} cells in a row under {names} names, line {}: the comma is the decimal sign and the separator, so the \
             numbers run together",
            grid.width(),
            first + 1
        );
        return Err((
            found,
            "export the file with another separator, such as a semicolon, or with decimal points".into(),
        ));
    }
    Ok(())
}
