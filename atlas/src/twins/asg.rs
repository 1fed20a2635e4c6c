//! ASGs and their products. x: exponent of the value.

use crate::{
    draw::{Draw, direction_of, group, row},
    twin::{Expected, Row, Twin},
};
use glam::{DMat3, DVec3};
use lobelia_lobes::{asg::*, asg_product::*};

/// Two bandwidths.
fn bandwidths(index: u32) -> Row {
    let mut draw = Draw::new(index, 20);
    let x = draw.sharpness();
    let y = if draw.one_in(8) { x } else { draw.sharpness() };
    row([[x, y, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// A direction in `a`, half of them where the lobe is, and two bandwidths in `b`.
fn direction_and_bandwidths(index: u32) -> Row {
    let [x, y, ..] = bandwidths(index).map(f64::from);
    let mut draw = Draw::new(index, 21);
    let near = DVec3::new(draw.between(-4.0, 4.0) / (x + 0.1).sqrt(), draw.between(-4.0, 4.0) / (y + 0.1).sqrt(), 1.0);
    let direction = if draw.one_in(2) { draw.direction() } else { near.normalize() };
    row([group(direction, 0.0), [x, y, 0.0, 0.0], [0.0; 4], [0.0; 4]])
}

/// An SG in `a`, in the frame of an ASG whose bandwidths are in `b`.
fn gaussian_and_bandwidths(index: u32) -> Row {
    let mut row = direction_and_bandwidths(index);
    row[3] = Draw::new(index, 22).sharpness() as f32;
    row
}

/// Diagonal entries in `a` and off-diagonal ones in `b` of the matrix of two squares.
fn matrices(index: u32) -> Row {
    let mut draw = Draw::new(index, 23);
    let (u, v, w) = (draw.direction(), draw.direction(), draw.direction());
    let [x, y, z] = [(); 3].map(|()| draw.sharpness());
    let entry = |i: usize, j: usize| x * u[i] * u[j] + y * v[i] * v[j] + z * w[i] * w[j];
    row([[entry(0, 0), entry(1, 1), entry(2, 2), 0.0], [entry(1, 2), entry(0, 2), entry(0, 1), 0.0], [0.0; 4], [0.0; 4]])
}

/// Two ASGs: tangent and eta_x in `a`, axis and eta_y in `b`; the second in `c` and `d`, mostly near the first, where their product is. In most rows the
/// four bandwidths are within a factor of a thousand of each other, which is what leaves the product an axis.
fn two_lobes(index: u32) -> Row {
    let mut draw = Draw::new(index, 24);
    let (alike, middle) = (!draw.one_in(8), draw.log_between(1e-6, 3e6));
    let mut eta = [(); 4].map(|()| if alike { middle * draw.log_between(0.03, 30.0) } else { draw.sharpness() }).into_iter();
    let mut lobe = |axis: DVec3, draw: &mut Draw| {
        let across = draw.direction_at(axis, std::f64::consts::FRAC_PI_2).cross(axis).normalize_or(axis.any_orthonormal_vector());
        [group(across, eta.next().unwrap_or_default()), group(axis, eta.next().unwrap_or_default())]
    };
    let axis = draw.direction();
    let [a, b] = lobe(axis, &mut draw);
    let sharpest = a[3].max(b[3]);
    let angle = if draw.one_in(2) { draw.angle() } else { draw.between(0.0, 4.0) / (sharpest + 2.0).sqrt() };
    let other = draw.direction_at(axis, angle);
    let [c, d] = lobe(other, &mut draw);
    row([a, b, c, d])
}

fn lobe_of(row: &[f64; 16], at: usize) -> AnisotropicSphericalGaussian {
    let (tangent, axis) = (direction_of(row, at), direction_of(row, at + 1));
    AnisotropicSphericalGaussian {
        tangent,
        bitangent: axis.cross(tangent),
        axis,
        eta_x: row[4 * at + 3],
        eta_y: row[4 * at + 7],
        amplitude: 1.0,
    }
}

fn matrix_of(row: &[f64; 16]) -> DMat3 {
    let ([x, y, z], [yz, xz, xy]) = ([row[0], row[1], row[2]], [row[4], row[5], row[6]]);
    DMat3::from_cols_array_2d(&[[x, xy, xz], [xy, y, yz], [xz, yz, z]])
}

/// How far the logarithm of a product of ASGs may be off in 32 bits. The matrices' entries are rounded to 4e-7 of the largest eigenvalue: that turns the
/// axis by that over the gap to the next eigenvalue, and shifts the smaller bandwidth. With sharp slabs on sharp slabs nothing is left, and the
/// bound says so.
fn product_bound(a: &AnisotropicSphericalGaussian, b: &AnisotropicSphericalGaussian, product: &AnisotropicSphericalGaussian) -> f64 {
    let (rounding, gap) = (4e-7 * product.eta_x.max(1e-6), product.eta_y);
    let turn = (rounding / gap.max(1e-30)).min(1.0);
    let mut bound = 3e-6 + (gap + rounding) * turn * turn + rounding / (gap + 1.0);
    for lobe in [a, b] {
        let local = lobe.to_local(product.axis).abs();
        bound += 4e-7 * (lobe.eta_x * local.x + lobe.eta_y * local.y) + (turn + 2e-7) / local.z.max(1e-30);
    }
    bound
}

/// Where the axis of a product is not determined in 32 bits, a value only has to be finite and of the right sign.
fn conditioned(value: f64, scale: f64, bound: f64, known: bool) -> Expected {
    if known && bound < 0.5 { Expected::scaled(value, scale, bound) } else { Expected::absolute(value, 1e38) }
}

macro_rules! two_lobes {
    ($value:literal) => {
        concat!(
            "#import lobelia::asg::{AnisotropicSphericalGaussian, asg_asg_integral, asg_product}\n",
            "fn lobe(a: vec4f, b: vec4f) -> AnisotropicSphericalGaussian {\n",
            "    return AnisotropicSphericalGaussian(a.xyz, cross(b.xyz, a.xyz), b.xyz, a.w, b.w, 1.0);\n}\n",
            "fn value(input: Input) -> vec4f { return vec4f(",
            $value,
            "); }"
        )
    };
}

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    vec![
        Twin {
            name: "asg::asg_evaluate",
            wgsl: "#import lobelia::asg::asg_evaluate\nfn value(input: Input) -> vec4f { return vec4f(asg_evaluate(input.b.x, input.b.y, input.a.xyz)); }",
            domain: "both bandwidths 0, 1e-6 to 1e8; all directions",
            input: direction_and_bandwidths,
            expected: |row| {
                let local = direction_of(row, 0);
                let exponent = row[4] * local.x * local.x + row[5] * local.y * local.y;
                vec![Expected::relative(asg_evaluate(row[4], row[5], local), 2e-6 + 3e-7 * exponent).non_negative()]
            },
        },
        Twin {
            name: "asg::asg_integral",
            wgsl: "#import lobelia::asg::asg_integral\nfn value(input: Input) -> vec4f { return vec4f(asg_integral(input.a.x, input.a.y)); }",
            domain: "both bandwidths 0, 1e-6 to 1e8",
            input: bandwidths,
            expected: |row| vec![Expected::relative(asg_integral(row[0], row[1]), 3e-6).non_negative()],
        },
        Twin {
            name: "asg::asg_integral_fast",
            wgsl: "#import lobelia::asg::asg_integral_fast\nfn value(input: Input) -> vec4f { return vec4f(asg_integral_fast(input.a.x, input.a.y)); }",
            domain: "both bandwidths 1e-6 to 1e8",
            input: |index| bandwidths(index).map(|eta| eta.max(1e-6)),
            expected: |row| vec![Expected::relative(asg_integral_fast(row[0], row[1]), 1e-6).non_negative()],
        },
        Twin {
            name: "asg::asg_sg_integral",
            wgsl: "#import lobelia::asg::asg_sg_integral\nfn value(input: Input) -> vec4f { return vec4f(asg_sg_integral(input.b.x, input.b.y, input.a.xyz, input.a.w)); }",
            domain: "bandwidths and sharpness 0, 1e-6 to 1e8; all axes",
            input: gaussian_and_bandwidths,
            expected: |row| {
                let (axis, sharpness) = (direction_of(row, 0), row[3]);
                let exponent = asg_sg_peak(row[4], row[5], axis, sharpness).log_amplitude.abs();
                // What an axis far below the horizon leaves is a quotient of what rounding leaves; it counts against the value along the ASG's axis.
                let [value, along] = [axis, DVec3::Z].map(|axis| asg_sg_integral(row[4], row[5], axis, sharpness));
                vec![Expected::scaled(value, value.max(1e-4 * along), 1e-5 + 8e-7 * exponent).non_negative()]
            },
        },
        Twin {
            name: "asg::asg_sg_peak (direction, larger bandwidth)",
            wgsl: "#import lobelia::asg::asg_sg_peak\nfn value(input: Input) -> vec4f {
    let peak = asg_sg_peak(input.b.x, input.b.y, input.a.xyz, input.a.w);
    return vec4f(peak.local, peak.eta_larger);
}",
            domain: "bandwidths and sharpness 0, 1e-6 to 1e8; all axes",
            input: gaussian_and_bandwidths,
            expected: |row| {
                let peak = asg_sg_peak(row[4], row[5], direction_of(row, 0), row[3]);
                let direction = peak.local.to_array().map(|part| Expected::absolute(part, 2e-6));
                // Where both bandwidths of the product are equal, the root of their difference is the root of a rounding error.
                let bandwidth = Expected::scaled(peak.eta_larger, row[3] + row[4] + row[5] + 1e-12, 4e-4);
                direction.into_iter().chain([bandwidth.non_negative()]).collect()
            },
        },
        Twin {
            name: "asg::asg_sg_integral_printed",
            wgsl: "#import lobelia::asg::asg_sg_integral_printed\nfn value(input: Input) -> vec4f { return vec4f(asg_sg_integral_printed(input.b.x, input.b.y, input.a.xyz, input.a.w)); }",
            domain: "bandwidths and sharpness 1e-6 to 1e8; all axes",
            input: |index| {
                let mut row = gaussian_and_bandwidths(index);
                for place in [3, 4, 5] {
                    row[place] = row[place].max(1e-6);
                }
                row
            },
            expected: |row| {
                let axis = direction_of(row, 0);
                let nu = 0.5 * row[3];
                let exponent = nu * (row[4] / (row[4] + nu) * axis.x * axis.x + row[5] / (row[5] + nu) * axis.y * axis.y);
                vec![Expected::relative(asg_sg_integral_printed(row[4], row[5], axis, row[3]), 3e-6 + 5e-7 * exponent).non_negative()]
            },
        },
        Twin {
            name: "asg::symmetric_eigen (values)",
            wgsl: "#import lobelia::asg::symmetric_eigen\nfn value(input: Input) -> vec4f { return vec4f(symmetric_eigen(input.a.xyz, input.b.xyz).values, 0.0); }",
            domain: "entries up to 3e8, ranks 0 to 3",
            input: matrices,
            expected: |row| {
                let (values, _) = symmetric_eigen(matrix_of(row));
                values.to_array().map(|value| Expected::scaled(value, values.x, 2e-6)).to_vec()
            },
        },
        Twin {
            name: "asg::symmetric_eigen (M v / values)",
            wgsl: "#import lobelia::asg::symmetric_eigen\nfn value(input: Input) -> vec4f {
    let eigen = symmetric_eigen(input.a.xyz, input.b.xyz);
    let o = input.b.xyz;
    let m = mat3x3f(input.a.x, o.z, o.y, o.z, input.a.y, o.x, o.y, o.x, input.a.z);
    let scale = max(eigen.values.x, 1e-30);
    var worst = vec4f(0.0);
    for (var k = 0; k < 3; k++) {
        worst[k] = length(m * (eigen.vectors[k] / scale) - eigen.vectors[k] * (eigen.values[k] / scale));
    }
    worst.w = determinant(eigen.vectors) * determinant(eigen.vectors);
    return worst;
}",
            domain: "entries up to 3e8, ranks 0 to 3",
            input: matrices,
            expected: |_| [0.0, 0.0, 0.0, 1.0].map(|value| Expected::absolute(value, 3e-6)).to_vec(),
        },
        Twin {
            name: "asg::asg_product (log amplitude)",
            wgsl: two_lobes!("asg_product(lobe(input.a, input.b), lobe(input.c, input.d)).log_amplitude"),
            domain: "four bandwidths 0, 1e-6 to 1e8, mostly within 1000 of each other; all axes",
            input: two_lobes,
            expected: |row| {
                let (a, b) = (lobe_of(row, 0), lobe_of(row, 2));
                let (lobe, log) = asg_product(&a, &b);
                vec![conditioned(log.max(-1e30), 1.0, product_bound(&a, &b, &lobe), log.is_finite())]
            },
        },
        Twin {
            name: "asg::asg_asg_integral",
            wgsl: two_lobes!("asg_asg_integral(lobe(input.a, input.b), lobe(input.c, input.d))"),
            domain: "four bandwidths 0, 1e-6 to 1e8, mostly within 1000 of each other; all axes",
            input: two_lobes,
            expected: |row| {
                let (a, b) = (lobe_of(row, 0), lobe_of(row, 2));
                let (lobe, _) = asg_product(&a, &b);
                let value = asg_asg_integral(&a, &b);
                vec![conditioned(value, value.max(1e-23), product_bound(&a, &b, &lobe), true).non_negative()]
            },
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_products_of_two_lobes_are_determined() {
        let known = (0..10_000).filter(|index| {
            let row = two_lobes(*index).map(f64::from);
            let (a, b) = (lobe_of(&row, 0), lobe_of(&row, 2));
            let (lobe, _) = asg_product(&a, &b);
            product_bound(&a, &b, &lobe) < 0.01
        });
        let share = known.count() as f64 / 10_000.0;
        assert!(share > 0.77, "{share}");
    }
}
