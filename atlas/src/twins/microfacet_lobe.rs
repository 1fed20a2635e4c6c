//! Microfacet lobes. alpha in [0.001, 1]; the view from the normal down to the horizon, exactly there and around it.
//!
//! A cosine is rounded by 2e-7, absolute, whatever its size, and a component of a direction in another frame as well. What that does to a result is
//! worked out from the result's slope, and is part of its bound; where it leaves less than half of the result, the result only has to be finite and
//! not negative (about 2 % of the rows of a glossy form).

use crate::{
    draw::{Draw, direction_of, group, row},
    twin::{Expected, Row, Twin},
};
use glam::DVec3;
use lobelia_lobes::{
    asg::AnisotropicSphericalGaussian,
    asg_product::{asg_sg_integral_of_peak, asg_sg_integral_printed, asg_sg_peak},
    brdf::{ggx_visibility, phong_exponent},
    microfacet_lobe::*,
    sg::{sg_integral, sg_product},
    sg_cosine::hemisphere_integral,
};
use std::f64::consts::{FRAC_PI_2, PI};

/// Rounding of a cosine, and of a component of a direction in another frame.
const COSINE: f64 = 2e-7;

fn alpha(draw: &mut Draw) -> f64 {
    draw.log_between(1e-3, 1.0)
}

/// alpha in `a.x`.
fn alphas(index: u32) -> Row {
    row([[alpha(&mut Draw::new(index, 50)), 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// A sharpness, or an exponent, in `a.x`.
fn sharpnesses(index: u32) -> Row {
    row([[Draw::new(index, 55).sharpness(), 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// An angle from 0 to the horizon, both among the values.
fn view_angle(draw: &mut Draw) -> f64 {
    let angle = draw.angle();
    if angle > FRAC_PI_2 { PI - angle } else { angle }
}

/// A normal and alpha in `a`, a half vector of the upper hemisphere in `b`, half of them where the lobe is.
fn half_vectors(index: u32) -> Row {
    let mut draw = Draw::new(index, 51);
    let (normal, alpha) = (draw.direction(), alpha(&mut draw));
    let angle = if draw.one_in(2) { (alpha * draw.between(0.0, 6.0)).atan() } else { view_angle(&mut draw) };
    row([group(normal, alpha), group(draw.direction_at(normal, angle), 0.0), [0.0; 4], [0.0; 4]])
}

/// alpha and the cosines to light and view in `a`.
fn cosines(index: u32) -> Row {
    let mut draw = Draw::new(index, 52);
    let mut cosine = || if draw.one_in(2) { draw.log_between(1e-6, 1.0) } else { draw.between(1e-6, 1.0) };
    let (light, view) = (cosine(), cosine());
    row([[alpha(&mut draw), light, view, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// A normal and the sharpness of an NDF in `a`, a view in `b`, a direction in `c`, half of them where the reflection lobe is.
fn warps(index: u32) -> Row {
    let mut draw = Draw::new(index, 53);
    let normal = draw.direction();
    let sharpness = if draw.one_in(64) { 0.0 } else { draw.log_between(0.1, 1e7) };
    let angle = view_angle(&mut draw);
    let view = draw.direction_at(normal, angle);
    let direction = if draw.one_in(2) { draw.direction() } else { around(&mut draw, &reflection_lobe_asg(sharpness, normal, view), 0.0) };
    row([group(normal, sharpness), group(view, 0.0), group(direction, 0.0), [0.0; 4]])
}

/// As [`warps`], with a cosine of the view of at least 1e-6.
fn warps_above_the_horizon(index: u32) -> Row {
    let mut row = warps(index);
    let (normal, view) = (DVec3::new(row[0].into(), row[1].into(), row[2].into()), DVec3::new(row[4].into(), row[5].into(), row[6].into()));
    if normal.dot(view) < 1e-6 {
        row[4..7].copy_from_slice(&(view + normal * 1e-4).normalize().to_array().map(|part| part as f32));
    }
    row
}

/// A direction within a few standard deviations of a lobe that an SG has widened.
fn around(draw: &mut Draw, lobe: &AnisotropicSphericalGaussian, sharpness: f64) -> DVec3 {
    let mut at =
        |eta: f64| draw.between(-4.0, 4.0) * (0.5 / (eta + 0.1) + if sharpness > 0.0 { 1.0 / (sharpness + 0.1) } else { 0.0 }).sqrt();
    (lobe.axis + lobe.tangent * at(lobe.eta_x) + lobe.bitangent * at(lobe.eta_y)).normalize()
}

/// A normal and alpha in `a`, a view in `b`, a light's axis and sharpness in `c`.
fn lights(index: u32) -> Row {
    let mut draw = Draw::new(index, 54);
    let (normal, alpha) = (draw.direction(), alpha(&mut draw));
    let angle = view_angle(&mut draw);
    let (view, sharpness) = (draw.direction_at(normal, angle), draw.sharpness());
    let lobe = reflection_lobe_asg(ndf_sharpness_ggx(alpha), normal, view);
    let axis = if draw.one_in(4) { draw.direction() } else { around(&mut draw, &lobe, sharpness) };
    row([group(normal, alpha), group(view, 0.0), group(axis, sharpness), [0.0; 4]])
}

/// Relative error of the larger bandwidth of a reflection lobe: that of the view's cosine and sine in `lambda / (lambda c^2 + s^2 / 2)`.
fn stretch_error(sharpness: f64, normal: DVec3, view: DVec3) -> f64 {
    let (c, s) = (normal.dot(view), normal.cross(view).length());
    let stretch = sharpness / (sharpness * c * c + 0.5 * s * s).max(1e-30);
    2e-6 + 2.0 * COSINE * stretch * (c.abs() + s / sharpness.max(1e-30))
}

/// A value, not negative, of which `error` (absolute) is in doubt. Exponentials below 1e-30 count as 0; `peak` is what they are multiplied by.
fn doubtful(value: f64, peak: f64, error: f64) -> Expected {
    let scale = value.max(1e-30 * peak);
    if error < 0.5 * scale {
        Expected::scaled(value, scale, error / scale + 1e-7).non_negative()
    } else {
        Expected::absolute(value, 1e38).non_negative()
    }
}

struct Scene {
    alpha: f64,
    normal: DVec3,
    view: DVec3,
    axis: DVec3,
    sharpness: f64,
}

impl Scene {
    fn of(row: &[f64; 16]) -> Self {
        Self { normal: direction_of(row, 0), alpha: row[3], view: direction_of(row, 1), axis: direction_of(row, 2), sharpness: row[11] }
    }

    fn call(&self, f: fn(f64, DVec3, DVec3, DVec3, f64) -> f64) -> f64 {
        f(self.alpha, self.normal, self.view, self.axis, self.sharpness)
    }

    /// No lobe's amplitude times its masking is larger.
    fn largest(&self) -> f64 {
        1.0 / self.alpha.powi(3)
    }

    /// The most and the least that masking and cosine can be when both cosines are off by `error`.
    fn masking(&self, direction: DVec3, error: f64) -> (f64, f64) {
        let (l, v) = (self.normal.dot(direction), self.normal.dot(self.view));
        let at = |l: f64, v: f64| if l <= 0.0 { 0.0 } else { ggx_visibility(self.alpha, l, v.max(0.0)) * l };
        (at(l + error, v - COSINE), at(l - error, v + COSINE))
    }

    /// How far one lobe's share may be off. x: exponent of its value.
    fn lobe_error(&self, lobe: NdfLobe) -> f64 {
        let asg = reflection_lobe_asg(lobe.sharpness, self.normal, self.view);
        let local = asg.to_local(self.axis);
        let peak = asg_sg_peak(asg.eta_x, asg.eta_y, local, self.sharpness);
        let x = -peak.log_amplitude;
        // The slope of the exponent, as a function of the light's axis, is that of the light's lobe at the peak. A peak near the lobe's horizon has a
        // cosine that is as well known as that of the axis.
        let turned = 3.0 * COSINE * self.sharpness * (peak.local - local).length();
        let relative = 1.2e-5
            + 1e-6 * x
            + turned
            + stretch_error(lobe.sharpness, self.normal, self.view) * (1.0 + x)
            + 3.0 * COSINE / local.z.abs().max(1e-30);
        let integral = asg_sg_integral_of_peak(asg.eta_x, asg.eta_y, local, self.sharpness, &peak);
        let (most, least) = self.masking(asg.to_world(peak.local), 5.0 * COSINE);
        lobe.amplitude * integral * (most * relative + most - least)
    }
}

fn by_lobes(row: &[f64; 16], f: fn(f64, DVec3, DVec3, DVec3, f64) -> f64, lobes: &[NdfLobe]) -> Vec<Expected> {
    let scene = Scene::of(row);
    vec![doubtful(scene.call(f), scene.largest(), lobes.iter().map(|lobe| scene.lobe_error(*lobe)).sum())]
}

/// As [`Scene::lobe_error`], of the printed product.
fn fast(row: &[f64; 16]) -> Vec<Expected> {
    let scene = Scene::of(row);
    let lobe = ggx_lobe_one(scene.alpha);
    let asg = reflection_lobe_asg(lobe.sharpness, scene.normal, scene.view);
    let local = asg.to_local(scene.axis);
    let nu = 0.5 * scene.sharpness.max(1e-6);
    let [across, along] = [asg.eta_x, asg.eta_y].map(|eta| nu * (eta / (eta + nu)));
    let x = across * local.x * local.x + along * local.y * local.y;
    let turned = 6.0 * COSINE * (across * local.x.abs() + along * local.y.abs());
    let relative = 4e-6
        + 1e-6 * x
        + turned
        + stretch_error(lobe.sharpness, scene.normal, scene.view) * (1.0 + x)
        + 3.0 * COSINE / local.z.abs().max(1e-30);
    let integral = asg_sg_integral_printed(asg.eta_x, asg.eta_y, local, 2.0 * nu).min(PI);
    let sharpness = 2.0 * asg.eta_x.sqrt() * asg.eta_y.sqrt();
    let product = sg_product(asg.axis, sharpness, scene.axis, scene.sharpness);
    // What is left of nearly opposite lobes carries the rounding of both; and the sharpness that weighs the axes is itself off.
    let sum = (sharpness + scene.sharpness).max(1e-30);
    let moved =
        stretch_error(lobe.sharpness, scene.normal, scene.view) * sharpness * (scene.sharpness / sum) * (asg.axis - scene.axis).length();
    let (most, least) = scene.masking(product.axis, (4.0 * COSINE * sum + moved) / product.sharpness.max(1e-30));
    vec![doubtful(scene.call(glossy_sg_light_fast), scene.largest(), lobe.amplitude * integral * (most * relative + most - least))]
}

fn filtered(row: &[f64; 16]) -> Vec<Expected> {
    let scene = Scene::of(row);
    let value = scene.call(filtered_ndf_shading);
    let c = scene.normal.dot(scene.view).max(0.0);
    let u = (1.0 - scene.alpha) * (1.0 + scene.alpha);
    let weight = 2.0 * scene.sharpness * c * c + u;
    let (along, across) = [scene.sharpness, scene.sharpness * c * c].map(|s| scene.alpha.powi(2) + u * u / (2.0 * s + u).max(1e-30)).into();
    // The width across the view, as a function of its cosine.
    let across_error = 4.0 * scene.sharpness * c * COSINE * (u / weight.max(1e-30)).powi(2) / across;
    let projected = scene.view - scene.normal * c;
    let tangent = if projected.length() > 1e-6 {
        (projected - scene.normal * scene.normal.dot(projected)).normalize()
    } else {
        scene.normal.any_orthonormal_vector()
    };
    let both = scene.view + scene.axis;
    let h = both.normalize_or(scene.normal);
    let (x, y, z) = (tangent.dot(h), scene.normal.cross(tangent).dot(h), scene.normal.dot(h));
    let bracket = x * x / along + y * y / across + z * z;
    // A short sum of opposite directions carries their rounding.
    let component = COSINE * (1.0 + 1.0 / both.length().max(1e-30));
    let sloped = 4.0 * component * (x.abs() / along + y.abs() / across + z.abs()) / bracket;
    let floor = along * projected.length_squared() + c * c;
    let relative = 8e-6 + 3.0 * across_error + sloped + COSINE * (c + along) / floor;
    let lobe = 0.5 * u / scene.alpha.powi(2);
    let product = sg_product(reflection_axis(scene.normal, scene.view), lobe, scene.axis, scene.sharpness);
    let sum = (lobe + scene.sharpness).max(1e-30);
    let off = 4.0 * COSINE * sum / product.sharpness.max(1e-30);
    let at = |d: f64| {
        hemisphere_integral(product.sharpness, (scene.normal.dot(product.axis) + d).clamp(-1.0, 1.0)) / sg_integral(product.sharpness)
    };
    // The sharpness of a product of nearly opposite lobes is as doubtful as its axis; below the horizon the share is known as a part of the whole.
    let visible = at(off) - at(-off) + 2e-6 + 2e-6 * off / COSINE * at(off);
    vec![doubtful(value, scene.largest(), value * relative + value / at(0.0).max(1e-300) * visible)]
}

macro_rules! scalar {
    ($name:literal, $domain:expr, $input:expr, $value:expr, $bound:expr) => {
        Twin {
            name: concat!("microfacet_lobe::", $name),
            wgsl: concat!(
                "#import lobelia::microfacet_lobe::",
                $name,
                "\nfn value(input: Input) -> vec4f { return vec4f(",
                $name,
                "(input.a.x)); }"
            ),
            domain: $domain,
            input: $input,
            expected: |row| {
                let value: fn(f64) -> f64 = $value;
                vec![Expected::relative(value(row[0]), $bound).non_negative()]
            },
        }
    };
}

macro_rules! ndf_lobe {
    ($name:literal, $domain:expr, $input:expr, $value:expr) => {
        Twin {
            name: concat!("microfacet_lobe::", $name),
            wgsl: concat!(
                "#import lobelia::microfacet_lobe::",
                $name,
                "\nfn value(input: Input) -> vec4f { let lobe = ",
                $name,
                "(input.a.x); return vec4f(lobe.sharpness, lobe.amplitude, 0.0, 0.0); }"
            ),
            domain: $domain,
            input: $input,
            expected: |row| {
                let lobe: NdfLobe = $value(row[0]);
                vec![Expected::relative(lobe.sharpness, 1e-6).non_negative(), Expected::relative(lobe.amplitude, 1e-6).non_negative()]
            },
        }
    };
}

macro_rules! light {
    ($name:literal, $expected:expr) => {
        Twin {
            name: concat!("microfacet_lobe::", $name),
            wgsl: concat!(
                "#import lobelia::microfacet_lobe::",
                $name,
                "\nfn value(input: Input) -> vec4f { return vec4f(",
                $name,
                "(input.a.w, input.a.xyz, input.b.xyz, input.c.xyz, input.c.w)); }"
            ),
            domain: "alpha 1e-3 to 1; view 0 to pi/2; light sharpness 0, 1e-6 to 1e8, all axes",
            input: lights,
            expected: $expected,
        }
    };
}

macro_rules! round {
    ($name:literal, $domain:expr, $input:expr, $lobe:expr, $error:expr) => {
        Twin {
            name: concat!("microfacet_lobe::", $name),
            wgsl: concat!(
                "#import lobelia::microfacet_lobe::",
                $name,
                "\nfn value(input: Input) -> vec4f { let lobe = ",
                $name,
                "(input.a.w, input.a.xyz, input.b.xyz); return vec4f(lobe.axis, lobe.sharpness); }"
            ),
            domain: $domain,
            input: $input,
            expected: |row| {
                let (normal, view) = (direction_of(row, 0), direction_of(row, 1));
                let lobe = $lobe(row[3], normal, view);
                let error: fn(f64, DVec3, DVec3) -> f64 = $error;
                let axis = lobe.axis.to_array().map(|part| Expected::absolute(part, 6e-7));
                axis.into_iter().chain([Expected::relative(lobe.sharpness, error(row[3], normal, view)).non_negative()]).collect()
            },
        }
    };
}

macro_rules! slab {
    ($name:literal, $domain:expr, $input:expr, $lobe:expr, $error:expr) => {
        Twin {
            name: concat!("microfacet_lobe::", $name),
            wgsl: concat!(
                "#import lobelia::microfacet_lobe::",
                $name,
                "\nfn value(input: Input) -> vec4f {\n    let lobe = ",
                $name,
                "(input.a.w, input.a.xyz, input.b.xyz);\n    let local = vec2f(dot(lobe.tangent, input.c.xyz), dot(lobe.bitangent, input.c.xyz));\n",
                "    let skew = abs(dot(lobe.tangent, lobe.axis)) + abs(dot(lobe.bitangent, lobe.axis)) + abs(length(lobe.tangent) - 1.0);\n",
                "    return vec4f(lobe.eta_x, lobe.eta_y, lobe.eta_x * local.x * local.x + lobe.eta_y * local.y * local.y, skew);\n}"
            ),
            domain: $domain,
            input: $input,
            expected: |row| {
                let (normal, view, direction) = (direction_of(row, 0), direction_of(row, 1), direction_of(row, 2));
                let lobe = $lobe(row[3], normal, view);
                let error: fn(f64, DVec3, DVec3) -> f64 = $error;
                let error = error(row[3], normal, view);
                let local = lobe.to_local(direction).abs();
                let (x, y) = (lobe.eta_x * local.x, lobe.eta_y * local.y);
                let exponent = x * local.x + y * local.y;
                // The exponent in a direction does not depend on which frame stands for a round lobe.
                let turned = 6.0 * COSINE * (x + y) + 10.0 * COSINE * COSINE * (lobe.eta_x + lobe.eta_y);
                vec![
                    Expected::relative(lobe.eta_x, error).non_negative(),
                    Expected::relative(lobe.eta_y, 5e-7).non_negative(),
                    Expected::absolute(exponent, exponent * (error + 1e-6) + turned + 1e-9),
                    Expected::absolute(0.0, 1.5e-6),
                ]
            },
        }
    };
}

const VIEWS: &str = "NDF sharpness 0, 0.1 to 1e7; view 0 to pi/2";
const VIEWS_ABOVE: &str = "NDF sharpness 0, 0.1 to 1e7; n.o >= 1e-6";

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    vec![
        Twin {
            name: "microfacet_lobe::beckmann_distribution",
            wgsl: "#import lobelia::microfacet_lobe::beckmann_distribution
fn value(input: Input) -> vec4f { return vec4f(beckmann_distribution(input.a.w, input.a.xyz, input.b.xyz)); }",
            domain: "alpha 1e-3 to 1; half vector 0 to pi/2",
            input: half_vectors,
            expected: |row| {
                let (n, h) = (direction_of(row, 0), direction_of(row, 1));
                let value = beckmann_distribution(row[3], n, h);
                let c = n.dot(h).abs().max(1e-3);
                let x = (1.0 - c * c) / (c * row[3]).powi(2);
                vec![doubtful(value, 1.0 / (PI * (row[3] * c * c).powi(2)), value * (3e-6 + 1e-6 * x + (2.0 * x + 4.0) * COSINE / c))]
            },
        },
        Twin {
            name: "microfacet_lobe::beckmann_visibility",
            wgsl: "#import lobelia::microfacet_lobe::beckmann_visibility
fn value(input: Input) -> vec4f { return vec4f(beckmann_visibility(input.a.x, input.a.y, input.a.z)); }",
            domain: "alpha 1e-3 to 1; both cosines 1e-6 to 1",
            input: cosines,
            expected: |row| {
                // The fit steps by 7e-5 at its end, and which side of it a cosine is on may be rounded.
                let at_the_end = |c: f64| {
                    let a = (0.5 * phong_exponent(row[0]) + 1.0).sqrt() * c / (1.0 - c * c).max(1e-12).sqrt();
                    (a / 1.6 - 1.0).abs() < 3e-6
                };
                let step = if at_the_end(row[1]) || at_the_end(row[2]) { 1e-4 } else { 0.0 };
                vec![Expected::relative(beckmann_visibility(row[0], row[1], row[2]), 4e-6 + step).non_negative()]
            },
        },
        scalar!("ndf_sharpness_beckmann", "alpha 1e-3 to 1", alphas, ndf_sharpness_beckmann, 5e-7),
        scalar!("ndf_sharpness_ggx", "alpha 1e-3 to 1", alphas, ndf_sharpness_ggx, 5e-7),
        scalar!("ndf_sharpness_ggx_broad", "alpha 1e-3 to 1", alphas, ndf_sharpness_ggx_broad, 1e-6),
        scalar!("ndf_sharpness_phong", "exponent 0, 1e-6 to 1e8", sharpnesses, ndf_sharpness_phong, 2e-7),
        scalar!("ndf_amplitude_projected", "sharpness 0, 1e-6 to 1e8", sharpnesses, ndf_amplitude_projected, 2e-6),
        ndf_lobe!("beckmann_lobe", "alpha 1e-3 to 1", alphas, beckmann_lobe),
        ndf_lobe!("phong_lobe", "exponent 0, 1e-6 to 1e8", sharpnesses, phong_lobe),
        ndf_lobe!("ggx_lobe_one", "alpha 1e-3 to 1", alphas, ggx_lobe_one),
        Twin {
            name: "microfacet_lobe::ggx_lobes_two",
            wgsl: "#import lobelia::microfacet_lobe::ggx_lobes_two
fn value(input: Input) -> vec4f {
    let lobes = ggx_lobes_two(input.a.x);
    return vec4f(lobes[0].sharpness, lobes[0].amplitude, lobes[1].sharpness, lobes[1].amplitude);
}",
            domain: "alpha 1e-3 to 1",
            input: alphas,
            expected: |row| {
                let parts = ggx_lobes_two(row[0]).map(|lobe| [lobe.sharpness, lobe.amplitude]);
                parts.as_flattened().iter().map(|part| Expected::relative(*part, 1e-6).non_negative()).collect()
            },
        },
        Twin {
            name: "microfacet_lobe::ggx_lobes_three",
            wgsl: "#import lobelia::microfacet_lobe::ggx_lobes_three
fn value(input: Input) -> vec4f {
    let lobes = ggx_lobes_three(input.a.x);
    let sum = lobes[0].amplitude + lobes[1].amplitude + lobes[2].amplitude;
    return vec4f(lobes[0].sharpness, lobes[1].sharpness, lobes[2].sharpness, sum);
}",
            domain: "alpha 1e-3 to 1",
            input: alphas,
            expected: |row| {
                let lobes = ggx_lobes_three(row[0]);
                let sum = lobes.iter().map(|lobe| lobe.amplitude).sum();
                let parts = lobes.iter().map(|lobe| lobe.sharpness).chain([sum]);
                parts.map(|part| Expected::relative(part, 1e-6).non_negative()).collect()
            },
        },
        Twin {
            name: "microfacet_lobe::reflection_axis",
            wgsl: "#import lobelia::microfacet_lobe::reflection_axis
fn value(input: Input) -> vec4f { return vec4f(reflection_axis(input.a.xyz, input.b.xyz), 0.0); }",
            domain: "view 0 to pi/2",
            input: warps,
            expected: |row| {
                let axis = reflection_axis(direction_of(row, 0), direction_of(row, 1));
                axis.to_array().map(|part| Expected::absolute(part, 6e-7)).to_vec()
            },
        },
        round!("reflection_lobe_sg", VIEWS, warps, reflection_lobe_sg, stretch_error),
        round!("reflection_lobe_sg_printed", VIEWS_ABOVE, warps_above_the_horizon, reflection_lobe_sg_printed, |_, n, v| {
            1e-6 + COSINE / n.dot(v)
        }),
        slab!("reflection_lobe_asg", VIEWS, warps, reflection_lobe_asg, stretch_error),
        slab!("reflection_lobe_asg_printed", VIEWS_ABOVE, warps_above_the_horizon, reflection_lobe_asg_printed, |_, n, v| {
            1e-6 + 2.0 * COSINE / n.dot(v) * (1.0 + COSINE / n.dot(v))
        }),
        light!("glossy_sg_light_fast", fast),
        light!("glossy_sg_light_one", |row| by_lobes(row, glossy_sg_light_one, &[ggx_lobe_one(row[3])])),
        light!("glossy_sg_light_two", |row| by_lobes(row, glossy_sg_light_two, &ggx_lobes_two(row[3]))),
        light!("glossy_sg_light_three", |row| by_lobes(row, glossy_sg_light_three, &ggx_lobes_three(row[3]))),
        light!("filtered_ndf_shading", filtered),
    ]
}
