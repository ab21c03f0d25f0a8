//! The name of an effect in tables and sentences.

use abbe::trace::result::EffectName;

/// An effect by component, driver and shape.
pub fn name(effect: &EffectName) -> String {
    let order = effect.order.map_or(String::new(), |order| format!(" order {order}"));
    let tests = if effect.tests.is_empty() { String::new() } else { format!(" in {}", effect.tests.join(", ")) };
    format!("{} over {}: {}{order}{tests}", effect.component, effect.driver, effect.shape)
}
