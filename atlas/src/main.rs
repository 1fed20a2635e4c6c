//! Draws the atlas.
fn main() {}
