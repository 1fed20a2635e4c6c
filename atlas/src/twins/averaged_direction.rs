//! Averaged directions and positions.

use crate::{
    draw::{Draw, direction_of, group, row},
    twin::{Expected, Row, Twin},
};
use glam::DVec3;
use lobelia_lobes::averaged_direction::*;

/// A sharpness in `a.x`.
fn sharpness(index: u32) -> Row {
    row([[Draw::new(index, 50).sharpness(), 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// R and q of a lobe in `a.x` and `a.y`; in some rows q is below what is distinguished.
fn length(index: u32) -> Row {
    let mut draw = Draw::new(index, 51);
    let sharpness = draw.sharpness();
    let (length, q) = (mean_cosine(sharpness), one_minus_mean_cosine_squared(sharpness));
    row([if draw.one_in(32) { [1.0, 0.0, 0.0, 0.0] } else { [length, q, 0.0, 0.0] }, [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// Four averaged directions, all within some angle of the first; the weights come from [`weights_of`].
fn directions(index: u32) -> Row {
    let mut draw = Draw::new(index, 52);
    let axis = draw.direction();
    let spread = if draw.one_in(8) { 3.0 } else { draw.log_between(1e-6, 1.0) };
    let alike = draw.one_in(2);
    let first = draw.sharpness();
    let mut groups = [[0.0; 4]; 4];
    for (place, group_) in groups.iter_mut().enumerate() {
        let around = spread * draw.unit();
        let other = if place == 0 || draw.one_in(16) { axis } else { draw.direction_at(axis, around) };
        let sharpness = if alike { first } else { draw.sharpness() };
        *group_ = group(other, if draw.one_in(64) { 0.0 } else { one_minus_mean_cosine_squared(sharpness) });
    }
    row(groups)
}

/// Four positions with variances: relative to an origin near by, as far apart as 1e-3 to 10 m.
fn positions(index: u32) -> Row {
    let mut draw = Draw::new(index, 53);
    let origin = DVec3::new(draw.between(-10.0, 10.0), draw.between(-10.0, 10.0), draw.between(-10.0, 10.0));
    let spread = draw.log_between(1e-3, 10.0);
    let plain = draw.one_in(2);
    let mut groups = [[0.0; 4]; 4];
    for group_ in &mut groups {
        let offset = draw.direction() * spread * draw.unit();
        *group_ = group(origin + offset, if plain { 0.0 } else { (spread * draw.unit()).powi(2) });
    }
    row(groups)
}

/// Weights that both sides derive from a row: the first is 1, the others are scaled by numbers of the row.
fn weights_of(row: &[f64; 16]) -> [f64; 4] {
    [1.0, row[0].abs(), 16.0 * row[5].abs(), 1024.0 * row[10] * row[10]]
}

fn merged_directions(row: &[f64; 16]) -> AveragedDirection {
    let weights = weights_of(row);
    let part = |place: usize| AveragedDirection { axis: direction_of(row, place), one_minus_length_squared: row[4 * place + 3] };
    merge_averaged_directions(&[0, 1, 2, 3].map(|place| (weights[place], part(place))))
}

fn merged_positions(row: &[f64; 16]) -> PositionVariance {
    let weights = weights_of(row);
    let part = |place: usize| PositionVariance { mean: direction_of(row, place), variance: row[4 * place + 3] };
    merge_position_variance(&[0, 1, 2, 3].map(|place| (weights[place], part(place))))
}

macro_rules! of_sharpness {
    ($name:literal, $bound:expr, $value:expr) => {
        Twin {
            name: concat!("averaged_direction::", $name),
            wgsl: concat!(
                "#import lobelia::averaged_direction::",
                $name,
                "\nfn value(input: Input) -> vec4f { return vec4f(",
                $name,
                "(input.a.x)); }"
            ),
            domain: "sharpness 0, 1e-6 to 1e8",
            input: sharpness,
            expected: |row| {
                let value: fn(f64) -> f64 = $value;
                vec![Expected::relative(value(row[0]), $bound).non_negative()]
            },
        }
    };
}

macro_rules! of_length {
    ($name:literal, $value:expr) => {
        Twin {
            name: concat!("averaged_direction::", $name),
            wgsl: concat!(
                "#import lobelia::averaged_direction::",
                $name,
                "\nfn value(input: Input) -> vec4f { return vec4f(",
                $name,
                "(input.a.x, input.a.y)); }"
            ),
            domain: "R and q of sharpness 0, 1e-6 to 1e8, and q = 0",
            input: length,
            expected: |row| {
                let value: fn(f64, f64) -> f64 = $value;
                vec![Expected::relative(value(row[0], row[1]), 2e-6).non_negative()]
            },
        }
    };
}

/// WGSL of a merge of the row's four parts.
macro_rules! merged {
    ($part:literal, $merge:literal, $value:literal) => {
        concat!(
            "#import lobelia::averaged_direction::{",
            $part,
            ", ",
            $merge,
            "}\n",
            "fn value(input: Input) -> vec4f {\n",
            "    let weights = vec4f(1.0, abs(input.a.x), 16.0 * abs(input.b.y), 1024.0 * input.c.z * input.c.z);\n",
            "    let parts = array<",
            $part,
            ", 4>(",
            $part,
            "(input.a.xyz, input.a.w), ",
            $part,
            "(input.b.xyz, input.b.w), ",
            $part,
            "(input.c.xyz, input.c.w), ",
            $part,
            "(input.d.xyz, input.d.w));\n",
            "    let merged = ",
            $merge,
            "(parts, weights);\n",
            "    return ",
            $value,
            ";\n}"
        )
    };
}

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    vec![
        of_sharpness!("mean_cosine", 2e-6, mean_cosine),
        of_sharpness!("one_minus_mean_cosine", 1.5e-6, one_minus_mean_cosine),
        of_sharpness!("one_minus_mean_cosine_squared", 2e-6, one_minus_mean_cosine_squared),
        of_sharpness!("mean_cosine_toksvig", 1e-6, mean_cosine_toksvig),
        of_sharpness!("mean_cosine_banerjee", 2e-6, mean_cosine_banerjee),
        of_length!("sharpness_from_averaged_direction", sharpness_from_averaged_direction),
        of_length!("sharpness_from_averaged_direction_banerjee", sharpness_from_averaged_direction_banerjee),
        of_length!("sharpness_from_averaged_direction_toksvig", sharpness_from_averaged_direction_toksvig),
        Twin {
            name: "averaged_direction::sharpness_from_averaged_direction (there and back)",
            wgsl: "#import lobelia::averaged_direction::{mean_cosine, one_minus_mean_cosine_squared, sharpness_from_averaged_direction}
fn value(input: Input) -> vec4f {
    return vec4f(sharpness_from_averaged_direction(mean_cosine(input.a.x), one_minus_mean_cosine_squared(input.a.x)));
}",
            domain: "sharpness 0, 1e-6 to 1e8",
            input: sharpness,
            // 0.10 % of the inverse, and rounding.
            expected: |row| vec![Expected::relative(row[0], 1.05e-3).non_negative()],
        },
        Twin {
            name: "averaged_direction::averaged_direction_length",
            wgsl: "#import lobelia::averaged_direction::averaged_direction_length
fn value(input: Input) -> vec4f { return vec4f(averaged_direction_length(input.a.y)); }",
            domain: "q of sharpness 0, 1e-6 to 1e8",
            input: length,
            expected: |row| vec![Expected::relative(averaged_direction_length(row[1]), 1e-6).non_negative()],
        },
        Twin {
            name: "averaged_direction::averaged_direction_of_lobe, averaged_direction_sharpness",
            wgsl: "#import lobelia::averaged_direction::{averaged_direction_of_lobe, averaged_direction_sharpness}
fn value(input: Input) -> vec4f {
    return vec4f(averaged_direction_sharpness(averaged_direction_of_lobe(vec3f(0.0, 0.0, 1.0), input.a.x)));
}",
            domain: "sharpness 0, 1e-6 to 1e8",
            input: sharpness,
            expected: |row| {
                let value = AveragedDirection::of_lobe(DVec3::Z, row[0]).sharpness();
                // q to 2e-6; its distance to 1 is the square of the length.
                let length = mean_cosine(row[0]);
                vec![Expected::scaled(value, value.max(1e-2), 4e-6 + 2e-6 / length.max(1e-3).powi(2)).non_negative()]
            },
        },
        Twin {
            name: "averaged_direction::merge_averaged_directions (q)",
            wgsl: merged!("AveragedDirection", "merge_averaged_directions", "vec4f(merged.one_minus_length_squared)"),
            domain: "q of sharpness 0, 1e-6 to 1e8, and 0; weights 0 to 1e3; directions 0 to 3 rad apart",
            input: directions,
            expected: |row| vec![Expected::relative(merged_directions(row).one_minus_length_squared, 2e-6).non_negative()],
        },
        Twin {
            name: "averaged_direction::merge_averaged_directions (axis)",
            wgsl: merged!("AveragedDirection", "merge_averaged_directions", "vec4f(merged.axis, 0.0)"),
            domain: "q of sharpness 0, 1e-6 to 1e8, and 0; weights 0 to 1e3; directions 0 to 3 rad apart",
            input: directions,
            expected: |row| {
                // The longest part over the length of the mean is how much of the sum cancels.
                let merged = merged_directions(row);
                let longest = (0..4).map(|place| averaged_direction_length(row[4 * place + 3])).fold(0.0, f64::max);
                let scale = if merged.length() > 1e-7 { (longest / merged.length()).max(1.0) } else { 4e6 };
                merged.axis.to_array().map(|part| Expected::scaled(part, scale, 5e-7)).to_vec()
            },
        },
        Twin {
            name: "averaged_direction::merge_position_variance (variance)",
            wgsl: merged!("PositionVariance", "merge_position_variance", "vec4f(merged.variance)"),
            domain: "1e-3 to 10 m apart, within 20 m of the origin; weights 0 to 1e5; variance 0 too",
            input: positions,
            expected: |row| vec![Expected::relative(merged_positions(row).variance, 2e-6).non_negative()],
        },
        Twin {
            name: "averaged_direction::merge_position_variance (mean)",
            wgsl: merged!("PositionVariance", "merge_position_variance", "vec4f(merged.mean, 0.0)"),
            domain: "1e-3 to 10 m apart, within 20 m of the origin; weights 0 to 1e5; variance 0 too",
            input: positions,
            expected: |row| {
                let farthest = (0..4).map(|place| direction_of(row, place).abs().max_element()).fold(0.0, f64::max);
                merged_positions(row).mean.to_array().map(|part| Expected::scaled(part, farthest, 5e-7)).to_vec()
            },
        },
        Twin {
            name: "averaged_direction::radius_from_variance",
            wgsl: "#import lobelia::averaged_direction::radius_from_variance
fn value(input: Input) -> vec4f { return vec4f(radius_from_variance(input.a.x - 1e-3)); }",
            domain: "variance -1e-3 to 1e8 m^2",
            input: sharpness,
            expected: |row| vec![Expected::relative(radius_from_variance(f64::from(row[0] as f32 - 1e-3)), 5e-7).non_negative()],
        },
    ]
}
