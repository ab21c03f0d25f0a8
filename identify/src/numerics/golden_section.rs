//! The maximum of a function of one variable, without its derivative.

/// The maximum of a function between 0 and 1 after so many steps, and what belongs to it, by golden section (Kiefer, Proc.
/// Am. Math. Soc. 4 (1953) 502).
pub fn highest<T>(value_at: impl Fn(f64) -> (f64, T), steps: usize) -> (f64, T) {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = (0.0, 1.0);
    let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
    let (mut at_c, mut at_d) = (value_at(c), value_at(d));
    for _ in 0..steps {
        if at_c.0 > at_d.0 {
            (b, d) = (d, c);
            at_d = at_c;
            c = b - golden * (b - a);
            at_c = value_at(c);
        } else {
            (a, c) = (c, d);
            at_c = at_d;
            d = a + golden * (b - a);
            at_d = value_at(d);
        }
    }
    if at_c.0 > at_d.0 { at_c } else { at_d }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_maximum_of_a_parabola_is_its_vertex() {
        for vertex in [0.2, 0.71] {
            let (value, place) = highest(|x| (3.0 - (x - vertex) * (x - vertex), x), 40);
            assert!((place - vertex).abs() < 1e-7 && (value - 3.0).abs() < 1e-12);
        }
        // At an end it is approached to within the last interval.
        let (_, place) = highest(|x| (x, x), 20);
        assert!(place > 0.999 && place < 1.0);
    }
}
