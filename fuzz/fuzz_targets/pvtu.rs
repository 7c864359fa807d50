#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| faceoff_fuzz::results("input.pvtu", bytes));
