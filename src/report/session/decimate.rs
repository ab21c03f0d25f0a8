//! Decimation of readings for plots. The extremes of every interval are kept.

/// Returns the rows to draw, in ascending order.
///
/// The range of the abscissa is divided into `intervals` equal intervals. In each interval, the rows with the minimum
/// and the maximum of every series are kept. The first and the last row are kept too.
pub fn decimated_rows(abscissa: &[f64], series: &[&[f64]], intervals: usize) -> Vec<usize> {
    let rows = abscissa.len();
    if rows <= 2 * intervals {
        return (0..rows).collect();
    }
    let low = abscissa.iter().copied().fold(f64::INFINITY, f64::min);
    let high = abscissa.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let width = ((high - low) / intervals as f64).max(f64::MIN_POSITIVE);
    let mut kept = vec![false; rows];
    for values in series {
        let mut extremes: Vec<Option<(usize, usize)>> = vec![None; intervals];
        for row in 0..rows {
            let interval = (((abscissa[row] - low) / width) as usize).min(intervals - 1);
            let (minimum, maximum) = extremes[interval].unwrap_or((row, row));
            extremes[interval] = Some((
                if values[row] < values[minimum] { row } else { minimum },
                if values[row] > values[maximum] { row } else { maximum },
            ));
        }
        for (minimum, maximum) in extremes.into_iter().flatten() {
            kept[minimum] = true;
            kept[maximum] = true;
        }
    }
    kept[0] = true;
    kept[rows - 1] = true;
    (0..rows).filter(|row| kept[*row]).collect()
}

/// Returns centre, minimum and maximum of each of `intervals` equal intervals of the abscissa. Empty intervals are
/// omitted.
pub fn interval_extremes(abscissa: &[f64], values: &[f64], intervals: usize) -> Vec<(f64, f64, f64)> {
    let low = abscissa.iter().copied().fold(f64::INFINITY, f64::min);
    let high = abscissa.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let width = ((high - low) / intervals as f64).max(f64::MIN_POSITIVE);
    let mut extremes: Vec<Option<(f64, f64)>> = vec![None; intervals];
    for (position, value) in abscissa.iter().zip(values) {
        let extreme = &mut extremes[(((position - low) / width) as usize).min(intervals - 1)];
        let (minimum, maximum) = extreme.unwrap_or((*value, *value));
        *extreme = Some((minimum.min(*value), maximum.max(*value)));
    }
    let centre = |k: usize| low + (k as f64 + 0.5) * width;
    let interval =
        |(k, pair): (usize, Option<(f64, f64)>)| pair.map(|(minimum, maximum)| (centre(k), minimum, maximum));
    extremes.into_iter().enumerate().filter_map(interval).collect()
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
        let kept = decimated_rows(&abscissa, &[&values], 300);
        assert!(kept.len() <= 602);
        assert!(kept.contains(&4321) && kept.contains(&4322));
        assert!(kept.is_sorted() && kept.first() == Some(&0) && kept.last() == Some(&9_999));
    }

    #[test]
    fn few_readings_are_all_kept() {
        assert_eq!(decimated_rows(&[1.0, 2.0, 3.0], &[&[0.0; 3]], 300), [0, 1, 2]);
    }
}
