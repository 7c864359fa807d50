#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| faceoff_fuzz::sound("input.inp", bytes));
