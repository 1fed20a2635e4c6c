#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    lobelia_tests::untrusted::read("picture", bytes);
});
