//! `abbe new --from-code`: sizes of the machine.

use abbe::files::template::Sizes;
use clap::Args;

/// Sizes of the machine of a code.
#[derive(Args)]
pub struct SizeArguments {
    /// From the rotary axes of the head to the spindle nose, mm [default: 150, as a guess].
    ///
    /// Example: --from-code wCbXYZAt --pivot-mm 180
    #[arg(long, value_name = "MM", requires = "from_code", allow_negative_numbers = true)]
    pivot_mm: Option<f64>,
    /// Height of the table surface above the origin of R with all axes at zero, mm: where the rotary axes of the table
    /// meet, or the spindle ball of a machine without them [default: -100, as a guess].
    ///
    /// Example: --from-code wCAbXYZt --table-mm -60
    #[arg(long, value_name = "MM", requires = "from_code", allow_negative_numbers = true)]
    table_mm: Option<f64>,
    /// From the spindle nose to the centre of the spindle ball, mm [default: 100, as a guess].
    ///
    /// Example: --from-code wCbXYZAt --gauge-mm 120
    #[arg(long, value_name = "MM", requires = "from_code", allow_negative_numbers = true)]
    gauge_mm: Option<f64>,
}

impl SizeArguments {
    /// What the user states.
    pub fn stated(&self) -> Sizes {
        Sizes { pivot_mm: self.pivot_mm, table_mm: self.table_mm, gauge_mm: self.gauge_mm }
    }
}
