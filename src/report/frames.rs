//! The frames of a set-up: where instruments stand and how targets are mounted.

use abbe::identify::fit::frames::SetUpFrame;

use super::block::Report;
use super::number::places;
use super::table::{Cell, Table, cells, numbers, words};

/// Frames that a terminal shows without `--all`.
const MAX_FRAMES: usize = 4;
/// Frames, and parameters at nominal, that a sentence names.
const MAX_NAMED: [usize; 2] = [2, 6];
/// Decimal places of the elements of a rotation.
const PLACES_OF_ROTATION: usize = 12;

/// The frames, each with its uncertainty in the line below; in detail their matrices and static transforms.
pub fn section(report: &mut Report, frames: &[SetUpFrame]) {
    if frames.is_empty() {
        return;
    }
    report.key(table(frames));
    for frame in frames {
        report.folded(frame.meaning.clone(), matrix(frame));
        report.detail(format!("`{}`", frame.ros));
    }
}

/// The frames with u; a dash where the readings determine nothing.
pub fn table(frames: &[SetUpFrame]) -> Table {
    let pair = |value: f64, u: Option<f64>| match u {
        // Stated, and not estimated.
        Some(0.0) => [Cell::fixed(value, places(0.0)), "0".into()],
        Some(u) => Cell::estimate(value, u),
        None => [Cell::or_dash(None), Cell::or_dash(None)],
    };
    let rows = frames.iter().flat_map(|frame| {
        let mut lines = [cells![format!("{} → {}", frame.parent, frame.child)], cells!["  u"]];
        let lengths = frame.xyz_mm.iter().zip(frame.u_xyz_mm);
        let angles = frame.rpy_deg.iter().zip(frame.u_rpy_deg).filter(|_| !frame.is_point);
        for (value, u) in lengths.chain(angles) {
            lines.iter_mut().zip(pair(*value, u)).for_each(|(line, cell)| line.push(cell));
        }
        lines.iter_mut().for_each(|line| line.resize(7, "".into()));
        lines
    });
    let columns = ["x, mm", "y, mm", "z, mm", "roll, °", "pitch, °", "yaw, °"].map(numbers);
    let title = "Frames with standard uncertainty u, by the coordinates in the first frame of what is given in the second \
                 (Rz(yaw)·Ry(pitch)·Rx(roll))";
    let mut table = Table::new([words("frame")].into_iter().chain(columns), rows)
        .titled(title)
        .named("frames")
        .folded(2 * MAX_FRAMES)
        .without_empty_columns();
    table.notes = relative(frames);
    table
}

/// What frames are relative to, those of equal words in one sentence, and where the tool frame lies.
fn relative(frames: &[SetUpFrame]) -> Vec<String> {
    let mut sentences: Vec<(Vec<String>, &[String])> = Vec::new();
    for frame in frames.iter().filter(|frame| !frame.relative_to.is_empty()) {
        let name = format!("{} → {}", frame.parent, frame.child);
        match sentences.iter_mut().find(|(_, held)| *held == frame.relative_to.as_slice()) {
            Some((names, _)) => names.push(name),
            None => sentences.push((vec![name], &frame.relative_to)),
        }
    }
    let listed = |words: &[String], most: usize| {
        let named = words.iter().take(most).map(String::as_str).collect::<Vec<_>>().join(", ");
        let more = words.len().saturating_sub(most);
        if more > 0 { format!("{named} and {more} more") } else { named }
    };
    let [most_frames, most_held] = MAX_NAMED;
    let held = sentences.iter().map(|(names, held)| {
        format!("{}: relative to the errors held at nominal, {}", listed(names, most_frames), listed(held, most_held))
    });
    let is_tool = frames.iter().any(|frame| frame.parent == "tool");
    let tool = is_tool.then(|| {
        "tool: the coordinates of the base frame with all axes at zero; `flange` of the machine states another frame".into()
    });
    held.chain(tool).collect()
}

/// The 4 × 4 matrix, with the quaternion and the uncertainty below it.
fn matrix(frame: &SetUpFrame) -> Table {
    let rows = frame.matrix.iter().map(|row| {
        let place = |column: usize| {
            if column == 3 { places(frame.u_xyz_mm[0].unwrap_or(0.0)).max(3) } else { PLACES_OF_ROTATION }
        };
        row.iter().enumerate().map(|(column, value)| Cell::fixed(*value, place(column))).collect()
    });
    let mut table = Table::new(["x", "y", "z", "origin, mm"].map(numbers), rows);
    let list =
        |values: &[f64]| values.iter().map(|x| format!("{x:.PLACES_OF_ROTATION$}")).collect::<Vec<_>>().join(" ");
    table.notes.push(format!("quaternion x y z w: {}", list(&frame.quaternion_xyzw)));
    if let [Some(x), Some(y), Some(z)] = frame.u_rotation_deg {
        let shown = [x, y, z].map(|u| format!("{u:.1e}")).join(", ");
        table.notes.push(format!("u of the rotation about X, Y, Z of the {} frame: {shown}°", frame.parent));
    }
    table
}

/// The static transforms, one command each, below what it does and the matrix as comments.
pub fn transforms(frames: &[SetUpFrame]) -> String {
    let one = |frame: &SetUpFrame| {
        let Table { rows, notes, .. } = matrix(frame);
        let row = |row: &Vec<Cell>| format!("# {}\n", row.iter().map(Cell::to_string).collect::<Vec<_>>().join(" "));
        let u = frame.u_xyz_mm.map(|u| u.map_or("–".to_string(), |u| format!("{u:.1e}"))).join(", ");
        let notes =
            notes.into_iter().chain([format!("u of x, y, z: {u} mm")]).chain(relative(std::slice::from_ref(frame)));
        let notes: String = notes.map(|note| format!("# {note}\n")).collect();
        format!("# {}\n{}{notes}{}\n", frame.meaning, rows.iter().map(row).collect::<String>(), frame.ros)
    };
    frames.iter().map(one).collect::<Vec<_>>().join("\n")
}
