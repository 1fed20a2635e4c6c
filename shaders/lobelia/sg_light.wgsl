// Virtual SG lights: a disk-like source of radius r seen as a cone, whose visibility is the SG 2 G, and the integrals of lobes over it.
// Distances and radii are >= 0, 0 among them; nothing divides by r^2. Kernels are integrals over directions divided by pi r^2 (1/m^2) and
// tend to the point light's. The twins in `f64`, with sources and the errors of approximations: `crates/lobes/src/sg_light.rs`.
#define_import_path lobelia::sg_light

#import lobelia::math::{PI, TAU, decay_mean, safe_normalize}
#import lobelia::sg::{SphericalGaussian, sg_log_evaluate}
#import lobelia::sg_cosine::clamped_cosine_integral
#import lobelia::asg::asg_sg_integral

// sqrt(distance^2 + radius^2).
fn cone_slant(distance: f32, radius: f32) -> f32 {
    // Scaled by the larger one: neither square leaves the range of floats.
    let larger = max(distance, radius);
    let ratio = min(distance, radius) / max(larger, 1e-30);
    return larger * sqrt(1.0 + ratio * ratio);
}

// s = 2 h (h + d) with the slant h: the sharpness of the cone times r^2.
fn cone_scaled_sharpness(distance: f32, radius: f32) -> f32 {
    let h = cone_slant(distance, radius);
    return 2.0 * h * (h + distance);
}

// Solid angle of the cone, sr: 2 pi r^2 / (h (h + d)), 0 to 2 pi; 0 for radius 0. Relative error 2e-6.
fn cone_solid_angle(distance: f32, radius: f32) -> f32 {
    let h = max(cone_slant(distance, radius), 1e-30);
    return TAU * (radius / h) * (radius / (h + distance));
}

// Sharpness of the SG that stands for the cone: 4 pi / solid angle, 2 (a hemisphere) to 4e30 (r below 1e-15 h counts as that). Relative
// error 2e-6.
fn cone_sharpness(distance: f32, radius: f32) -> f32 {
    if !(max(distance, radius) > 0.0) {
        return 2.0;
    }
    let h = cone_slant(distance, radius);
    let r = max(radius, 1e-15 * h);
    return 2.0 * (h / r) * ((h + distance) / r);
}

// Solid angle over the area of the disk, 1/m^2: 2 / (h (h + d)), 1/d^2 for radius 0; 0 where distance and radius are both 0. Relative error
// 2e-6.
fn solid_angle_over_disk_area(distance: f32, radius: f32) -> f32 {
    if !(max(distance, radius) > 0.0) {
        return 0.0;
    }
    let h = cone_slant(distance, radius);
    return (1.0 / h) * (2.0 / (h + distance));
}

// Integral of cone_visibility over the solid angle: 1, and 1.8 % less for a hemisphere.
fn cone_energy_ratio(distance: f32, radius: f32) -> f32 {
    return 1.0 - exp(-2.0 * cone_sharpness(distance, radius));
}

// The cone's visibility as an SG: amplitude 2, twice the cone's own.
fn cone_visibility(direction: vec3f, distance: f32, radius: f32) -> SphericalGaussian {
    return SphericalGaussian(direction, cone_sharpness(distance, radius), 2.0);
}

// Irradiance from the cone's SG per radiance, sr; c and s2: cosine between normal and direction and its squared sine.
fn cone_irradiance(c: f32, s2: f32, distance: f32, radius: f32) -> f32 {
    return 2.0 * clamped_cosine_integral(cone_sharpness(distance, radius), c, s2);
}

// Product of the light's lobe and cone scaled by r^2.
struct ScaledLightProduct {
    axis: vec3f,
    // |p| with p = lobe_sharpness r^2 lobe_axis + s direction; over r^2 the sharpness of the product.
    scaled_sharpness: f32,
    log_amplitude: f32,
    // lobe_sharpness r^2 + s: 0 where distance and radius are both 0.
    sum: f32,
}

fn scaled_light_product(lobe_axis: vec3f, lobe_sharpness: f32, light_direction: vec3f, distance: f32, radius: f32) -> ScaledLightProduct {
    if !(max(distance, radius) > 0.0) {
        return ScaledLightProduct(light_direction, 0.0, 0.0, 0.0);
    }
    let s = cone_scaled_sharpness(distance, radius);
    let lobe = lobe_sharpness * radius * radius;
    let sum = lobe + s;
    // In units of the sum: neither large nor small scenes leave the range of floats.
    let p = lobe_axis * (lobe / sum) + light_direction * (s / sum);
    let p_length = length(p);
    let d = lobe_axis - light_direction;
    let log_amplitude = -lobe_sharpness * (s / sum) * dot(d, d) / (1.0 + p_length);
    return ScaledLightProduct(safe_normalize(p, light_direction), sum * p_length, log_amplitude, sum);
}

fn vsgl_kernel_of_product(eta: vec2f, product: ScaledLightProduct, radius: f32) -> f32 {
    if !(product.sum > 0.0) {
        return 0.0;
    }
    // Opposite equal lobes cancel; what the amplitude leaves of them does not matter.
    let n = max(product.scaled_sharpness, 1e-6 * product.sum);
    let xy = 2.0 * eta * (radius * radius) + n;
    let axis = product.axis;
    let exponent = product.log_amplitude - eta.x * (n / xy.x) * axis.x * axis.x - eta.y * (n / xy.y) * axis.y * axis.y;
    return 4.0 * max(axis.z, 0.0) / (sqrt(xy.x) * sqrt(xy.y)) * exp(exponent);
}

// Integral of a receiver's ASG, an SG lobe of the light and the light's cone over pi r^2 (1/m^2), fast: the product with the ASG as Xu et
// al. print it. Directions in the ASG's frame, amplitudes 1; sharpness and bandwidths in [0, 1e8]. Relative error 5e-6 + 8e-7 x for a value
// of exp(-x) times its prefactor.
fn vsgl_kernel_fast(eta: vec2f, lobe_axis: vec3f, lobe_sharpness: f32, light_direction: vec3f, distance: f32, radius: f32) -> f32 {
    return vsgl_kernel_of_product(eta, scaled_light_product(lobe_axis, lobe_sharpness, light_direction, distance, radius), radius);
}

// The same integral, accurate: the product with the ASG about its true peak. For r = 0 the virtual point light, for lobe_sharpness = 0 a
// diffuse light; 0 where distance and radius are both 0. A form of this project.
fn vsgl_kernel(eta: vec2f, lobe_axis: vec3f, lobe_sharpness: f32, light_direction: vec3f, distance: f32, radius: f32) -> f32 {
    let product = scaled_light_product(lobe_axis, lobe_sharpness, light_direction, distance, radius);
    let square = radius * radius;
    // Beyond a sharpness of 1e8 both forms agree.
    if product.scaled_sharpness >= 1e8 * square {
        return vsgl_kernel_of_product(eta, product, radius);
    }
    let integral = asg_sg_integral(eta.x, eta.y, product.axis, product.scaled_sharpness / square);
    return 2.0 / (PI * square) * exp(product.log_amplitude) * integral;
}

// The same for a diffuse receiver, whose cosine is pulled out: lobe and cone over pi r^2 (1/m^2). Exact for the SGs; relative error 5e-6 +
// 8e-7 x.
fn vsgl_kernel_diffuse_receiver(lobe_axis: vec3f, lobe_sharpness: f32, light_direction: vec3f, distance: f32, radius: f32) -> f32 {
    let product = scaled_light_product(lobe_axis, lobe_sharpness, light_direction, distance, radius);
    if !(product.sum > 0.0) {
        return 0.0;
    }
    let n = product.scaled_sharpness;
    let square = radius * radius;
    var width: f32;
    if 2.0 * n < square {
        width = 8.0 / square * decay_mean(2.0 * n / square);
    } else {
        // Where the ratio is above 100 the exponential is 0, and r may be too.
        width = 4.0 / n * (1.0 - exp(-2.0 * n / max(square, 0.02 * n)));
    }
    return width * exp(product.log_amplitude);
}

// Product of ASG and lobe as a point: their values in the light's direction times solid_angle_over_disk_area, 1/m^2.
fn vsgl_kernel_point(eta: vec2f, lobe_axis: vec3f, lobe_sharpness: f32, light_direction: vec3f, distance: f32, radius: f32) -> f32 {
    let w = light_direction;
    let exponent = sg_log_evaluate(lobe_axis, lobe_sharpness, w) - eta.x * w.x * w.x - eta.y * w.y * w.y;
    return max(w.z, 0.0) * exp(exponent) * solid_angle_over_disk_area(distance, radius);
}

// Factor that takes the doubled peak of cone_visibility back where a receiver's lobe is narrower than the cone and looks into it, at the
// price of energy: 1 to 1/2. An option that is off by default. sharpness_ratio: the lobe's sharpness over the cone's.
fn cone_peak_correction(sharpness_ratio: f32) -> f32 {
    return (1.0 + sharpness_ratio) * decay_mean(2.0 * sharpness_ratio);
}

// Upper bound of the sharpness of the product of an ASG and an SG.
fn combined_sharpness_bound(eta_x: f32, eta_y: f32, lobe_sharpness: f32) -> f32 {
    return 2.0 * max(eta_x, eta_y) + lobe_sharpness;
}

// Whether the light may be taken for a point with the lobes' values in its direction (vsgl_kernel_point): product_sharpness < threshold
// cone_sharpness.
fn bias_reduction_applies(product_sharpness: f32, threshold: f32, distance: f32, radius: f32) -> bool {
    return product_sharpness * radius * radius < threshold * cone_scaled_sharpness(distance, radius);
}
