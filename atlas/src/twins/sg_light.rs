//! Virtual SG lights. Radii over distances of 1e-12 to 30, with either of them 0, and both. x: exponent of the value.

use crate::{
    draw::{Draw, direction_of, group, row},
    twin::{Expected, Row, Twin},
};
use glam::DVec3;
use lobelia_lobes::{
    asg_product::{asg_sg_integral, asg_sg_peak},
    sg_cosine::clamped_cosine_integral,
    sg_light::*,
};

/// A distance of 1e-3 to 1e4 m and a radius of 1e-12 to 30 times that; either or both may be 0.
fn distance_and_radius(draw: &mut Draw) -> [f64; 2] {
    let distance = draw.log_between(1e-3, 1e4);
    let radius = distance * draw.log_between(1e-12, 30.0);
    match draw.bits() % 64 {
        0 | 1 => [distance, 0.0],
        2 | 3 => [0.0, radius],
        4 => [0.0, 0.0],
        _ => [distance, radius],
    }
}

/// Distance and radius in `a`.
fn cone(index: u32) -> Row {
    let [distance, radius] = distance_and_radius(&mut Draw::new(index, 60));
    row([[distance, radius, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// Cosine, squared sine, distance and radius in `a`.
fn tilted_cone(index: u32) -> Row {
    let mut draw = Draw::new(index, 61);
    let [distance, radius] = distance_and_radius(&mut draw);
    let angle = draw.angle();
    row([[angle.cos(), angle.sin().powi(2), distance, radius], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// The light's lobe in `a`, its direction and distance in `b`, bandwidths and radius in `c`. In most rows the lobes look where the light
/// is.
fn light(index: u32) -> Row {
    let mut draw = Draw::new(index, 62);
    let [distance, radius] = distance_and_radius(&mut draw);
    let (sharpness, x, y) = (draw.sharpness(), draw.sharpness(), draw.sharpness());
    let y = if draw.one_in(8) { x } else { y };
    let near = DVec3::new(draw.between(-3.0, 3.0) / (x + 1.0).sqrt(), draw.between(-3.0, 3.0) / (y + 1.0).sqrt(), 1.0).normalize();
    let direction = if draw.one_in(4) { draw.direction() } else { near };
    let angle = if draw.one_in(4) { draw.angle() } else { (draw.between(0.0, 4.0) / (sharpness + 0.5).sqrt()).min(3.0) };
    let lobe_axis = draw.direction_at(direction, angle);
    row([group(lobe_axis, sharpness), group(direction, distance), [x, y, radius, 0.0], [0.0; 4]])
}

/// What a row of [`light`] holds.
struct Light {
    lobe_axis: DVec3,
    lobe_sharpness: f64,
    direction: DVec3,
    distance: f64,
    eta: [f64; 2],
    radius: f64,
}

impl Light {
    fn of(row: &[f64; 16]) -> Self {
        let (lobe_axis, direction) = (direction_of(row, 0), direction_of(row, 1));
        Self { lobe_axis, lobe_sharpness: row[3], direction, distance: row[7], eta: [row[8], row[9]], radius: row[10] }
    }

    fn with(&self, kernel: fn([f64; 2], DVec3, f64, DVec3, f64, f64) -> f64) -> f64 {
        kernel(self.eta, self.lobe_axis, self.lobe_sharpness, self.direction, self.distance, self.radius)
    }

    /// Product of lobe and cone, as axis, |p|, sum and minus the logarithm of the amplitude.
    fn product(&self) -> (DVec3, f64, f64, f64) {
        let s = 2.0 * self.distance.hypot(self.radius) * (self.distance.hypot(self.radius) + self.distance);
        let lobe = self.lobe_sharpness * self.radius * self.radius;
        let p = self.lobe_axis * lobe + self.direction * s;
        let exponent = self.lobe_sharpness * s * (self.lobe_axis - self.direction).length_squared() / (lobe + s + p.length());
        (p.normalize_or(self.direction), p.length(), lobe + s, exponent)
    }

    /// What one rounding of each part of the product's axis (3e-7 of the larger summand) is, component by component.
    fn axis_rounding(&self) -> DVec3 {
        let (axis, length, sum, _) = self.product();
        let lobe = self.lobe_sharpness * self.radius * self.radius;
        (3e-7 / length.max(1e-30)) * (self.lobe_axis.abs() * lobe + self.direction.abs() * (sum - lobe)) + 3e-7 * axis.abs()
    }

    /// Bound and scale of a kernel whose ASG is evaluated with the gradient `slope` at the product's axis: what the rounding of that axis
    /// does comes on top of 5e-6 + 8e-7 x, and a cosine near 0 has that rounding as its error.
    fn expected(&self, value: f64, exponent: f64, slope: DVec3, cosine: f64) -> Expected {
        let (_, length, sum, own) = self.product();
        if sum <= 0.0 {
            return Expected::absolute(0.0, 1e-30).non_negative();
        }
        // Lobe and cone of opposite axes leave a sum without a direction; the amplitude is what matters.
        if length < 1e-5 * sum {
            return Expected::absolute(value, 1e38).non_negative();
        }
        let rounding = self.axis_rounding();
        let bound = 5e-6 + 8e-7 * (exponent + own) + slope.dot(rounding);
        let flat = value / cosine.max(1e-30) * rounding.z / bound;
        Expected::scaled(value, visible(value, exponent + own) + flat.max(0.0), bound).non_negative()
    }
}

/// The scale of a value that has the factor exp(-x): where that factor is below 1e-30 the value counts as 0, whatever the area that it is
/// divided by.
fn visible(value: f64, exponent: f64) -> f64 {
    (value * (exponent - 69.0).clamp(0.0, 600.0).exp()).max(1e-30)
}

macro_rules! of_cone {
    ($name:literal, $value:expr) => {
        Twin {
            name: concat!("sg_light::", $name),
            wgsl: concat!(
                "#import lobelia::sg_light::",
                $name,
                "\nfn value(input: Input) -> vec4f { return vec4f(",
                $name,
                "(input.a.x, input.a.y)); }"
            ),
            domain: "distance 0, 1e-3 to 1e4 m; radius 0, 1e-12 to 30 times that",
            input: cone,
            expected: |row| {
                let value: fn(f64, f64) -> f64 = $value;
                vec![Expected::relative(value(row[0], row[1]), 2e-6).non_negative()]
            },
        }
    };
}

macro_rules! of_light {
    ($name:literal, $arguments:literal, $expected:expr) => {
        Twin {
            name: concat!("sg_light::", $name),
            wgsl: concat!(
                "#import lobelia::sg_light::",
                $name,
                "\nfn value(input: Input) -> vec4f { return vec4f(",
                $name,
                "(",
                $arguments,
                ")); }"
            ),
            domain: "sharpness and bandwidths 0, 1e-6 to 1e8; distance 0, 1e-3 to 1e4 m; radius 0, 1e-12 to 30 times that; all directions",
            input: light,
            expected: |row| {
                let expected: fn(&Light) -> Expected = $expected;
                vec![expected(&Light::of(row))]
            },
        }
    };
}

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    vec![
        of_cone!("cone_slant", cone_slant),
        of_cone!("cone_solid_angle", cone_solid_angle),
        of_cone!("cone_sharpness", cone_sharpness),
        of_cone!("solid_angle_over_disk_area", solid_angle_over_disk_area),
        of_cone!("cone_energy_ratio", cone_energy_ratio),
        Twin {
            name: "sg_light::cone_visibility",
            wgsl: "#import lobelia::sg_light::cone_visibility
fn value(input: Input) -> vec4f {
    let lobe = cone_visibility(vec3f(0.0, 0.6, 0.8), input.a.x, input.a.y);
    return vec4f(lobe.sharpness, lobe.amplitude, lobe.axis.yz);
}",
            domain: "distance 0, 1e-3 to 1e4 m; radius 0, 1e-12 to 30 times that",
            input: cone,
            expected: |row| {
                let lobe = cone_visibility(DVec3::new(0.0, 0.6, 0.8), row[0], row[1]);
                [lobe.sharpness, lobe.amplitude, lobe.axis.y, lobe.axis.z].map(|value| Expected::relative(value, 2e-6)).to_vec()
            },
        },
        Twin {
            name: "sg_light::cone_irradiance",
            wgsl: "#import lobelia::sg_light::cone_irradiance
fn value(input: Input) -> vec4f { return vec4f(cone_irradiance(input.a.x, input.a.y, input.a.z, input.a.w)); }",
            domain: "distance 0, 1e-3 to 1e4 m; radius 0, 1e-12 to 30 times that; all tilts",
            input: tilted_cone,
            expected: |row| {
                let (value, sharpness) = (cone_irradiance(row[0], row[1], row[2], row[3]), cone_sharpness(row[2], row[3]));
                let facing = 2.0 * clamped_cosine_integral(sharpness, 1.0, 0.0);
                vec![if row[0] > 0.0 { Expected::relative(value, 5e-6) } else { Expected::scaled(value, facing, 2e-6) }.non_negative()]
            },
        },
        of_light!("vsgl_kernel_fast", "input.c.xy, input.a.xyz, input.a.w, input.b.xyz, input.b.w, input.c.z", |light| {
            let (axis, length, _, _) = light.product();
            let smoothed = light.eta.map(|eta| eta * (length / (2.0 * eta * light.radius * light.radius + length).max(1e-300)));
            let exponent = smoothed[0] * axis.x * axis.x + smoothed[1] * axis.y * axis.y;
            let slope = DVec3::new(2.0 * smoothed[0] * axis.x.abs(), 2.0 * smoothed[1] * axis.y.abs(), 0.0);
            light.expected(light.with(vsgl_kernel_fast), exponent, slope, axis.z)
        }),
        of_light!("vsgl_kernel", "input.c.xy, input.a.xyz, input.a.w, input.b.xyz, input.b.w, input.c.z", |light| {
            let (axis, length, _, _) = light.product();
            let sharpness = (length / (light.radius * light.radius).max(1e-300)).min(1e8);
            let peak = asg_sg_peak(light.eta[0], light.eta[1], axis, sharpness);
            let slope = sharpness * (axis - peak.local).abs();
            let cosine = if sharpness < 1e8 { peak.local.z } else { axis.z };
            let exponent = peak.log_amplitude.abs();
            let expected = light.expected(light.with(vsgl_kernel), exponent, slope, cosine);
            // As for `asg_sg_integral`: what an axis far below the horizon leaves counts against the value along the ASG's axis.
            let [here, along] = [axis, DVec3::Z].map(|axis| asg_sg_integral(light.eta[0], light.eta[1], axis, sharpness));
            let most = expected.value * (along / here.max(1e-300)).min(1e30);
            // Where nothing is left, in itself or beside it, floats leave a rounding error of a number that nobody sees.
            let unseen = if expected.value < 1e-30 || here <= 1e-12 * along { 1e-15 } else { 0.0 };
            Expected { bound: expected.bound + 7e-6, scale: expected.scale.max(1e-4 * most).max(unseen), ..expected }
        }),
        of_light!("vsgl_kernel_diffuse_receiver", "input.a.xyz, input.a.w, input.b.xyz, input.b.w, input.c.z", |light| {
            let (_, length, sum, exponent) = light.product();
            let kernel = |_, lobe_axis, sharpness, direction, distance, radius| {
                vsgl_kernel_diffuse_receiver(lobe_axis, sharpness, direction, distance, radius)
            };
            // Opposite lobes: the length of what is left is that of a rounding error, which only matters above r^2.
            let opposite = if sum > 0.0 && length < 1e-2 * sum { 4e-7 * sum / length.max(light.radius * light.radius) } else { 0.0 };
            let value = light.with(kernel);
            Expected::scaled(value, visible(value, exponent), 5e-6 + 8e-7 * exponent + opposite).non_negative()
        }),
        of_light!("vsgl_kernel_point", "input.c.xy, input.a.xyz, input.a.w, input.b.xyz, input.b.w, input.c.z", |light| {
            let w = light.direction;
            let own = 0.5 * light.lobe_sharpness * (light.lobe_axis - w).length_squared();
            let exponent = own + light.eta[0] * w.x * w.x + light.eta[1] * w.y * w.y;
            let value = light.with(vsgl_kernel_point);
            Expected::scaled(value, visible(value, exponent), 5e-6 + 8e-7 * exponent).non_negative()
        }),
        Twin {
            name: "sg_light::cone_peak_correction",
            wgsl: "#import lobelia::sg_light::cone_peak_correction
fn value(input: Input) -> vec4f { return vec4f(cone_peak_correction(input.a.x)); }",
            domain: "ratio 0, 1e-6 to 1e8",
            input: |index| row([[Draw::new(index, 63).sharpness(), 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]]),
            expected: |row| vec![Expected::relative(cone_peak_correction(row[0]), 2e-6).non_negative()],
        },
        Twin {
            name: "sg_light::combined_sharpness_bound",
            wgsl: "#import lobelia::sg_light::combined_sharpness_bound
fn value(input: Input) -> vec4f { return vec4f(combined_sharpness_bound(input.c.x, input.c.y, input.a.w)); }",
            domain: "sharpness and bandwidths 0, 1e-6 to 1e8",
            input: light,
            expected: |row| vec![Expected::relative(combined_sharpness_bound(row[8], row[9], row[3]), 3e-7).non_negative()],
        },
        Twin {
            name: "sg_light::bias_reduction_applies",
            wgsl: "#import lobelia::sg_light::bias_reduction_applies
fn value(input: Input) -> vec4f { return vec4f(select(0.0, 1.0, bias_reduction_applies(input.a.w, 0.25, input.b.w, input.c.z))); }",
            domain: "sharpness 0, 1e-6 to 1e8; distance 0, 1e-3 to 1e4 m; radius 0, 1e-12 to 30 times that",
            input: light,
            expected: |row| {
                let applies = |threshold: f64| bias_reduction_applies(row[3], threshold, row[7], row[10]);
                // On the border rounding decides.
                if applies(0.25 * (1.0 - 1e-6)) == applies(0.25 * (1.0 + 1e-6)) {
                    vec![Expected::absolute(f64::from(u8::from(applies(0.25))), 1e-7)]
                } else {
                    vec![]
                }
            },
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bound that grows with what the rounding of an axis does must not excuse everything.
    #[test]
    fn most_kernels_are_determined() {
        for (name, least) in [("sg_light::vsgl_kernel_fast", 0.95), ("sg_light::vsgl_kernel", 0.95)] {
            let all = twins();
            let Some(twin) = all.iter().find(|twin| twin.name == name) else { panic!("no {name}") };
            let rows =
                (0..20_000).map(|index| (twin.expected)(&(twin.input)(index).map(f64::from))[0]).filter(|expected| expected.value > 1e-20);
            let (known, visible) = rows.fold((0, 0), |(known, visible), expected| {
                (known + u32::from(expected.bound * expected.scale < 1e-4 * expected.value), visible + 1)
            });
            let share = f64::from(known) / f64::from(visible);
            assert!(share > least, "{name}: {share}");
        }
    }
}
