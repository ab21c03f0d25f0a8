//! The clearance between spindle and table of a tilting table turned by 90°: Yamaji, Hamabata & Ihara, Evaluation of
//! linear axis motion error of machine tools using an R-test device (HPC 2014), Section 6, Figs. 7 to 10.
//!
//! `H` and `W` are the height and width of the device, `L` the shaft from jig to ball, `T` the jig, `Ds` and `Dt` the
//! diameters of spindle and table:
//!
//! | device on | condition | requirement |
//! |---|---|---|
//! | table | `Ds/2 ≥ H` | `L + T > Dt/2` |
//! | table | `Ds/2 < H` | `L > W/2` |
//! | spindle | `Ds/2 ≥ L` | `H ≥ Dt/2` and `L > W/2` |
//! | spindle | `Ds/2 < L` | nothing: Yamaji et al. print `H ≤ Dt/2 should be satisfied`, which is permitted and not required |
//!
//! These are no clearances of bodies ([`crate::collision`]): each case compares one pair of parts. On the table, a jig within
//! the device (`L ≤ W/2`) is permitted if `Ds/2 ≥ H`. In the spindle, the table begins at the end of the shaft, without
//! `T`, and a device wider than the shaft reaches is permitted if `Ds/2 < L`. Bodies of these lengths would permit and
//! refuse other devices than the paper does.

use abbe_model::words::number;

/// The relevant dimensions, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// `Ds`: diameter of the spindle.
    pub spindle_mm: f64,
    /// `Dt`: diameter of the table.
    pub table_mm: f64,
    /// `H`: height of the device with its jig.
    pub device_height_mm: f64,
    /// `W`: width of the device from above.
    pub device_width_mm: f64,
    /// `L`: from the jig to the centre of the ball.
    pub shaft_mm: f64,
    /// `T`: the jig that holds the ball.
    pub jig_mm: f64,
    /// Whether the device is on the table and the ball in the spindle.
    pub device_on_table: bool,
}

impl Clearance {
    /// Each dimension that is too short, as a sentence. Empty if the clearance is sufficient with the table turned by
    /// 90°.
    pub fn faults(&self) -> Vec<String> {
        let Clearance { spindle_mm, table_mm, device_height_mm, device_width_mm, shaft_mm, jig_mm, .. } = *self;
        let mut faults = Vec::new();
        let mut need = |holds: bool, words: String| {
            if !holds {
                faults.push(words);
            }
        };
        let clear_of_device = format!(
            "the shaft of {} mm has to be longer than half the device's width, {} mm",
            number(shaft_mm),
            number(device_width_mm / 2.0)
        );
        if self.device_on_table {
            if spindle_mm / 2.0 >= device_height_mm {
                let words = format!(
                    "shaft and jig, {} mm, have to be longer than the table's radius, {} mm: the spindle reaches over its edge",
                    number(shaft_mm + jig_mm),
                    number(table_mm / 2.0)
                );
                need(shaft_mm + jig_mm > table_mm / 2.0, words);
            } else {
                need(shaft_mm > device_width_mm / 2.0, clear_of_device);
            }
        } else if spindle_mm / 2.0 >= shaft_mm {
            let words = format!(
                "the device of {} mm has to be at least as high as the table's radius, {} mm",
                number(device_height_mm),
                number(table_mm / 2.0)
            );
            need(device_height_mm >= table_mm / 2.0, words);
            need(shaft_mm > device_width_mm / 2.0, clear_of_device);
        }
        faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Machine A of Yamaji et al.: a spindle of 290 mm and a table of 500 mm.
    fn machine_a(device_on_table: bool) -> Clearance {
        Clearance {
            spindle_mm: 290.0,
            table_mm: 500.0,
            device_height_mm: 100.0,
            device_width_mm: 120.0,
            shaft_mm: 100.0,
            jig_mm: 100.0,
            device_on_table,
        }
    }

    #[test]
    fn a_flat_device_on_the_table_requires_a_long_shaft() {
        assert_eq!(machine_a(true).faults().len(), 1);
        assert!(Clearance { shaft_mm: 160.0, ..machine_a(true) }.faults().is_empty());
        // A device higher than the spindle's radius only has to clear the tool holder.
        assert!(Clearance { device_height_mm: 150.0, ..machine_a(true) }.faults().is_empty());
        assert_eq!(Clearance { device_height_mm: 150.0, shaft_mm: 50.0, ..machine_a(true) }.faults().len(), 1);
    }

    #[test]
    fn a_device_in_the_spindle_has_to_be_high_or_the_shaft_long() {
        assert_eq!(machine_a(false).faults().len(), 1);
        assert!(Clearance { device_height_mm: 250.0, ..machine_a(false) }.faults().is_empty());
        assert!(Clearance { shaft_mm: 150.0, ..machine_a(false) }.faults().is_empty());
    }
}
