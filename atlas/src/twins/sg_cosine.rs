//! SGs over the hemisphere. Above the horizon bounds are relative to the value, below it to the integral over the sphere.

use crate::{
    draw::{Draw, row},
    twin::{Expected, Row, Twin},
};
use lobelia_lobes::{sg::sg_integral, sg_cosine::*};

/// Sharpness, cosine and squared sine of the angle to the normal.
fn lobe(index: u32) -> Row {
    let mut draw = Draw::new(index, 10);
    let (sharpness, angle) = (draw.sharpness(), draw.angle());
    row([[sharpness, angle.cos(), angle.sin().powi(2), 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

fn expected(row: &[f64; 16], value: f64) -> Vec<Expected> {
    let c = row[1];
    let whole = sg_integral(row[0]);
    vec![if c > 0.0 { Expected::relative(value, 3e-6) } else { Expected::scaled(value, whole, 1e-6) }.non_negative()]
}

macro_rules! twin {
    ($name:literal, $wgsl:literal, $value:expr) => {
        Twin {
            name: concat!("sg_cosine::", $name),
            wgsl: concat!("#import lobelia::sg_cosine::", $name, "\nfn value(input: Input) -> vec4f { return vec4f(", $name, $wgsl, "); }"),
            domain: "sharpness 0, 1e-6 to 1e8; angle to the normal 0 to pi",
            input: lobe,
            expected: |row| {
                let value: fn(&[f64; 16]) -> f64 = $value;
                expected(row, value(row))
            },
        }
    };
}

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    vec![
        twin!("hemisphere_integral", "(input.a.x, input.a.y)", |row| hemisphere_integral(row[0], row[1])),
        twin!("hemisphere_integral_fast", "(input.a.x, input.a.y)", |row| hemisphere_integral_fast(row[0], row[1])),
        twin!("clamped_cosine_integral", "(input.a.x, input.a.y, input.a.z)", |row| clamped_cosine_integral(row[0], row[1], row[2])),
        twin!("clamped_cosine_integral_fast", "(input.a.x, input.a.y)", |row| clamped_cosine_integral_fast(row[0], row[1])),
        twin!("clamped_cosine_integral_constant_cosine", "(input.a.x, input.a.y)", |row| {
            clamped_cosine_integral_constant_cosine(row[0], row[1])
        }),
    ]
}
