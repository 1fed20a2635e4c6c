//! Benchmarks live in `benches/`; nothing is exported.
