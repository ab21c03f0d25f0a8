//! Figures of standards of a linear axis and of an axis that carries the table.

use abbe::identify::figure::find;

use super::*;

/// The linear axis of the European Spallation Source: nine positions, five cycles. Its own report prints M and A.
#[test]
fn the_figures_of_a_linear_axis_are_those_of_its_report() {
    let name = "channels::the_figures_of_a_linear_axis_are_those_of_its_report";
    let Some(file) = test_needs::data(name, "linear_axis_ess/b02_x_ISO230.dat") else { return };
    let text = std::fs::read_to_string(file).unwrap();
    let mut targets = std::collections::BTreeMap::new();
    let mut rows = Vec::new();
    for (name, value) in text.lines().filter_map(|line| line.split_once('=')) {
        let Some((name, indices)) = name.split_once('[') else { continue };
        let indices: Vec<usize> = indices.trim_end_matches(']').split(',').map(|k| k.parse().unwrap()).collect();
        match (name, value.parse::<f64>(), indices.as_slice()) {
            ("TGT_DATA", Ok(value), [position]) => _ = targets.insert(*position, value),
            ("REF_DATA_FWD", Ok(value), [position, cycle]) => rows.push((2 * cycle, *position as isize, value)),
            // A backward run passes the positions in descending order.
            ("REF_DATA_BWD", Ok(value), [position, cycle]) => rows.push((2 * cycle + 1, -(*position as isize), value)),
            _ => {}
        }
    }
    rows.sort_by_key(|(run, order, _)| (*run, *order));
    assert_eq!((targets.len(), rows.len()), (9, 90));
    let mut data = String::from("run,x_mm,displacement_mm\n");
    for (run, order, value) in rows {
        data += &format!("{run},{},{value}\n", targets[&order.unsigned_abs()]);
    }
    let folder = Folder::new();
    folder.write("laser.csv", &data);
    let session = folder.session(&format!(
        "{MILL}[instrument]\nkind = \"laser\"\n{}[[test]]\nname = \"L\"\ndata = \"laser.csv\"\nbeam = [1, 0, 0]\n",
        parabolas(&["EXX"])
    ));
    let (problem, found) = prepare(&session, 1).unwrap();
    let result = fit::report(&problem, &found).unwrap();
    let [figures] = &result.positioning[..] else { panic!("{:?}", result.positioning) };
    assert_eq!((figures.axis.as_str(), figures.read.unit.as_str(), figures.read.positions.len()), ("X", "um", 9));
    let value = |id: &str| find(&figures.read.figures, id).unwrap().value;
    assert_eq!(format!("{:.2}", value("mean_range")), "93.65");
    assert_eq!(format!("{:.2}", value("accuracy")), "135.27");
}

/// A table axis: what is read against the table falls where the axis rises. A laser along −X, a positioning error of the
/// table, and a backlash; and the angle about a rotary axis of the table.
#[test]
fn the_figures_of_an_axis_that_carries_the_table_have_the_sign_of_its_deviations() {
    let folder = Folder::new();
    // The table goes 3 µm too far at X = 100, and 1 µm less far in negative direction.
    let mut data = String::from("run,x_mm,displacement_mm\n");
    let mut angles = String::from("run,c_deg,angle_arcsec\n");
    for run in 1..=4 {
        for step in 0..=10 {
            let step = if run % 2 == 1 { step } else { 10 - step };
            let (x, c) = (f64::from(10 * step), f64::from(36 * step));
            let actual = x + 3e-3 * x / 100.0 - if run % 2 == 1 { 0.0 } else { 1e-3 };
            // Along −X, with the reflector of the tool at rest and the optic on the table at `actual`.
            data += &format!("{run},{x},{:.9}\n", actual);
            // The table turns 5″ too far at C = 360°: the tool turns back against it.
            angles += &format!("{run},{c},{:.6}\n", -5.0 * c / 360.0);
        }
    }
    folder.write("laser.csv", &data);
    folder.write("angle.csv", &angles);
    let machine = "[machine]\nname = \"Table\"\nchain = \"w C X b Z t\"\naxis.X.direction = [1, 0, 0]\naxis.Z.direction = [0, 0, 1]\n\
                   axis.C = { direction = [0, 0, 1], origin_mm = [0, 0, 0] }\n[instrument]\nkind = \"laser\"\n";
    let tests = "[[test]]\nname = \"L\"\ndata = \"laser.csv\"\nbeam = [-1, 0, 0]\n[[test]]\nname = \"A\"\nkind = \"angle\"\n\
                 data = \"angle.csv\"\nabout = [0, 0, 1]\n[[test]]\nname = \"bed\"\nkind = \"angle\"\ndata = \"angle.csv\"\nabout = [0, 0, 1]\n\
                 body = \"tool\"\n";
    let session = folder.session(&format!("{machine}{tests}"));
    let rejected: Vec<Vec<bool>> = session.tests.iter().map(|_| vec![false; 44]).collect();
    let found = abbe::identify::positioning::of_session(&session, &rejected);
    // What the axis does not move has no figures.
    let [of_x, of_c] = &found[..] else { panic!("{found:?}") };
    let mean = |test: &abbe::identify::positioning::PositioningTest, place: usize| {
        let position = &test.read.positions[place];
        [position.forward.unwrap().mean, position.backward.unwrap().mean]
    };
    let near = |found: [f64; 2], expected: [f64; 2]| {
        assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-3), "{found:?}, not {expected:?}");
    };
    near(mean(of_x, 10), [3.0, 2.0]);
    near(mean(of_x, 0), [0.0, -1.0]);
    assert!((find(&of_x.read.figures, "mean_reversal").unwrap().value - 1.0).abs() < 1e-3);
    near(mean(of_c, 10), [5.0, 5.0]);
    assert_eq!((of_c.read.unit.as_str(), of_c.read.position_unit.as_str()), ("arcsec", "deg"));
}
