//! The schemas of limits, bodies and sizes have the keys that the readers know.

use crate::suite::model::schema::{BAR, SWEEP, known_to_the_reader, properties, schema, with};

#[test]
fn the_schemas_of_limits_and_bodies_have_the_keys_that_the_reader_knows() {
    let (session, machine) = (schema("session"), schema("machine"));
    let sweeping = format!("{BAR}\n{SWEEP}");
    let limits = "[tolerance]\ntests.T = { ";
    for (schema, of, at) in [
        (&session, "tolerance", "[tolerance]\nzz = 1".to_string()),
        (&session, "test_limits", format!("{limits}zz = 1 }}")),
        (&session, "clearance", "[clearance]\nzz = 1".to_string()),
        (&session, "holder", "[clearance]\nspindle_holder = { radius_mm = 1, length_mm = 1, zz = 1 }".to_string()),
        (&machine, "body", "[[machine.body]]\nname = \"T\"\nbox_mm = [[0, 0, 0], [1, 1, 1]]\nzz = 1".to_string()),
    ] {
        let known = known_to_the_reader(&with("", "ballbar", &sweeping, &at));
        assert_eq!(known, properties(&schema["$defs"][of]), "{of}");
    }
}
