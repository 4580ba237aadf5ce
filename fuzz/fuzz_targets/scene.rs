#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| cutis_fuzz::scene::once(data));
