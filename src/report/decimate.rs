//! Fewer points for drawing, none of them a peak.

/// The rows that are drawn: in each of `columns` strips of the abscissa those where each of the given columns is least and greatest, and the first and
/// the last row. In order.
pub fn kept(abscissa: &[f64], columns_of_values: &[&[f64]], columns: usize) -> Vec<usize> {
    let rows = abscissa.len();
    if rows <= 2 * columns {
        return (0..rows).collect();
    }
    let low = abscissa.iter().copied().fold(f64::INFINITY, f64::min);
    let high = abscissa.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let width = ((high - low) / columns as f64).max(f64::MIN_POSITIVE);
    let mut chosen = vec![false; rows];
    for values in columns_of_values {
        let mut extremes: Vec<Option<(usize, usize)>> = vec![None; columns];
        for row in 0..rows {
            let column = (((abscissa[row] - low) / width) as usize).min(columns - 1);
            let (least, most) = extremes[column].unwrap_or((row, row));
            extremes[column] = Some((
                if values[row] < values[least] { row } else { least },
                if values[row] > values[most] { row } else { most },
            ));
        }
        for (least, most) in extremes.into_iter().flatten() {
            chosen[least] = true;
            chosen[most] = true;
        }
    }
    chosen[0] = true;
    chosen[rows - 1] = true;
    (0..rows).filter(|row| chosen[*row]).collect()
}

/// Least and greatest of each of `columns` strips of the abscissa that holds any value: middle of the strip, least, greatest.
pub fn strips(abscissa: &[f64], values: &[f64], columns: usize) -> Vec<(f64, f64, f64)> {
    let low = abscissa.iter().copied().fold(f64::INFINITY, f64::min);
    let high = abscissa.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let width = ((high - low) / columns as f64).max(f64::MIN_POSITIVE);
    let mut extremes: Vec<Option<(f64, f64)>> = vec![None; columns];
    for (at, value) in abscissa.iter().zip(values) {
        let strip = &mut extremes[(((at - low) / width) as usize).min(columns - 1)];
        let (least, most) = strip.unwrap_or((*value, *value));
        *strip = Some((least.min(*value), most.max(*value)));
    }
    let middle = |k: usize| low + (k as f64 + 0.5) * width;
    let strip = |(k, pair): (usize, Option<(f64, f64)>)| pair.map(|(least, most)| (middle(k), least, most));
    extremes.into_iter().enumerate().filter_map(strip).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_peak_among_many_readings_is_kept() {
        let abscissa: Vec<f64> = (0..10_000).map(f64::from).collect();
        let mut values = vec![0.0; 10_000];
        values[4321] = 7.0;
        values[4322] = -9.0;
        let kept = kept(&abscissa, &[&values], 300);
        assert!(kept.len() <= 602);
        assert!(kept.contains(&4321) && kept.contains(&4322));
        assert!(kept.is_sorted() && kept.first() == Some(&0) && kept.last() == Some(&9_999));
    }

    #[test]
    fn few_readings_all_stay() {
        assert_eq!(kept(&[1.0, 2.0, 3.0], &[&[0.0; 3]], 300), [0, 1, 2]);
    }
}
