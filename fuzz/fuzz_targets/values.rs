#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| abbe_fuzz::errors::values(input));
