// Directions drawn from the densities that integrals over the sphere need, and those densities (1/sr). The twins in `f64`, with sources:
// `crates/lobes/src/sampling/directions.rs`.
//
// Every `sample_x` maps a point `u` of the unit square, both coordinates in [0, 1), to a unit vector: u.x chooses the angle to the axis and is 0 there,
// u.y the azimuth in turns. Axes, normals and views are unit vectors. Polar angles are drawn as versines, 1 - cos, or as sines and cosines side by side:
// a cosine alone does not hold an angle below 3e-4.
//
// Flags: those of lobelia::brdf. SPECULAR (off: Lambert only), NDF_PHONG (off: GGX).
#define_import_path lobelia::direction_sampling

#import lobelia::math::{INV_PI, PI, TAU, decay_mean, exp_minus_one, log_one_plus, luminance, perpendicular, safe_normalize}
#import lobelia::sg::{sg_evaluate, sg_integral}
#import lobelia::brdf::{Brdf, albedo_estimate, evaluate_brdf, ggx_distribution, phong_distribution, phong_exponent, sin_squared}

// Smallest v.h that phong_reflection_pdf divides by.
const MIN_V_DOT_H: f32 = 1e-6;

// Largest number below 1.
const BELOW_ONE: f32 = 0.99999994;

// Cosine and sine of an angle in turns, |turns| < 1e6; error 2e-7. The language allows `cos` and `sin` an error of 5e-4 each, which would leave no
// unit vector; and a quarter turn taken off `turns` is exact.
fn unit_circle(turns: f32) -> vec2f {
    let quarter = floor(4.0 * turns + 0.5);
    let x = TAU * (turns - 0.25 * quarter);
    let y = -x * x;
    let sine = x * (1.0 + y * (0.166666667 + y * (0.00833333333 + y * (0.000198412698 + y * 2.75573192e-6))));
    let cosine = 1.0 + y * (0.5 + y * (0.0416666667 + y * (0.00138888889 + y * 2.48015873e-5)));
    let step = i32(quarter) & 3;
    let turned = select(vec2f(cosine, sine), vec2f(-sine, cosine), (step & 1) == 1);
    return select(turned, -turned, step >= 2);
}

// The unit vector with the given cosine and sine to `axis`, at an azimuth in turns.
fn around(axis: vec3f, cosine: f32, sine: f32, turns: f32) -> vec3f {
    return axis * cosine + across(axis, turns) * sine;
}

// The unit vector perpendicular to `axis` at an azimuth in turns.
fn across(axis: vec3f, turns: f32) -> vec3f {
    let tangent = perpendicular(axis);
    let circle = unit_circle(turns);
    return tangent * circle.x + cross(axis, tangent) * circle.y;
}

// The unit vector whose cosine to `axis` is 1 - versine, at an azimuth in turns; versine in [0, 2].
fn direction_about(axis: vec3f, versine: f32, turns: f32) -> vec3f {
    return around(axis, 1.0 - versine, sqrt(max(versine * (2.0 - versine), 0.0)), turns);
}

// Uniform over the sphere; u.x = 0 is +Z.
fn sample_sphere(u: vec2f) -> vec3f {
    return around(vec3f(0.0, 0.0, 1.0), 1.0 - 2.0 * u.x, 2.0 * sqrt(u.x * (1.0 - u.x)), u.y);
}

fn sphere_pdf() -> f32 {
    return 0.25 * INV_PI;
}

// Uniform over the hemisphere about `normal`.
fn sample_hemisphere(normal: vec3f, u: vec2f) -> vec3f {
    return direction_about(normal, u.x, u.y);
}

fn hemisphere_pdf(normal: vec3f, direction: vec3f) -> f32 {
    return select(0.0, 0.5 * INV_PI, dot(normal, direction) > 0.0);
}

// Proportional to the cosine to `normal`.
fn sample_cosine_hemisphere(normal: vec3f, u: vec2f) -> vec3f {
    return around(normal, sqrt(1.0 - u.x), sqrt(u.x), u.y);
}

fn cosine_hemisphere_pdf(normal: vec3f, direction: vec3f) -> f32 {
    return max(dot(normal, direction), 0.0) * INV_PI;
}

// Uniform over the cone about `axis` whose half angle has the cosine 1 - versine, versine in (0, 2]; the axis for 0.
fn sample_cone(axis: vec3f, versine: f32, u: vec2f) -> vec3f {
    return direction_about(axis, versine * u.x, u.y);
}

// 1 / (2 pi versine) within the cone, 0 outside. A direction is rounded by 1e-7, and so may be a sample on the rim of a cone: whoever knows that the
// direction is his own sample takes 1 / (2 pi versine).
fn cone_pdf(axis: vec3f, versine: f32, direction: vec3f) -> f32 {
    let d = direction - axis;
    return select(0.0, 0.5 * INV_PI / max(versine, 1e-30), dot(d, d) <= 2.0 * versine);
}

// 1 - cos of the angle between a direction drawn from an SG and its axis, in [0, 2]. Relative error 2e-6.
fn sample_sg_versine(sharpness: f32, u: f32) -> f32 {
    let mean = decay_mean(2.0 * sharpness);
    // u (1 - e^(-2 sharpness)).
    let share = 2.0 * sharpness * u * mean;
    if share > 0.5 {
        // 1 - share, with the digits of 1 - u; the floor is for u = 1.
        let rest = (1.0 - u) + u * exp(-2.0 * sharpness);
        return min(-log(max(rest, 1e-37)) / sharpness, 2.0);
    }
    var stretch = 1.0;
    if share > 1e-12 {
        stretch = -log_one_plus(-share) / share;
    }
    return min(2.0 * u * mean * stretch, 2.0);
}

// Proportional to exp(sharpness (w.axis - 1)), sharpness in [0, 1e8].
fn sample_sg(axis: vec3f, sharpness: f32, u: vec2f) -> vec3f {
    return direction_about(axis, sample_sg_versine(sharpness, u.x), u.y);
}

// Relative error 3e-6 + 3e-7 x for exp(-x) times the largest density, directions taken as they are.
fn sg_pdf(axis: vec3f, sharpness: f32, direction: vec3f) -> f32 {
    return sg_evaluate(axis, sharpness, direction) / sg_integral(sharpness);
}

// Half vector proportional to cos^(exponent + 1), exponent in [0, 2e6].
fn sample_phong_half_vector(exponent: f32, normal: vec3f, u: vec2f) -> vec3f {
    let log_cosine = log_one_plus(-u.x) / (exponent + 2.0);
    let versine = max(-exp_minus_one(log_cosine), 0.0);
    // Near the horizon the difference would lose the cosine's digits.
    let cosine = select(exp(log_cosine), 1.0 - versine, versine < 0.5);
    return around(normal, cosine, sqrt(versine * (1.0 + cosine)), u.y);
}

fn phong_half_vector_pdf(exponent: f32, normal: vec3f, h: vec3f) -> f32 {
    let n_dot_h = dot(normal, h);
    if n_dot_h <= 0.0 {
        return 0.0;
    }
    let s2 = sin_squared(normal, h);
    var log_cosine = 0.0;
    if s2 < 0.5 {
        log_cosine = 0.5 * log_one_plus(-s2);
    } else {
        log_cosine = log(n_dot_h);
    }
    return (exponent + 2.0) * 0.5 * INV_PI * exp((exponent + 1.0) * log_cosine);
}

// Half vector proportional to D(h) (n.h) of GGX, alpha in [0.001, 1].
fn sample_ggx_half_vector(alpha: f32, normal: vec3f, u: vec2f) -> vec3f {
    let rest = 1.0 - u.x;
    let scale = inverseSqrt(rest + alpha * alpha * u.x);
    return around(normal, sqrt(rest) * scale, alpha * sqrt(u.x) * scale, u.y);
}

fn ggx_half_vector_pdf(alpha: f32, normal: vec3f, h: vec3f) -> f32 {
    return ggx_distribution(alpha, normal, h) * max(dot(normal, h), 0.0);
}

// Half vector of GGX among those that the viewer sees, proportional to D(h) max(v.h, 0), by spherical caps. For n.v >= 0; a view below the horizon
// counts as one on it.
fn sample_ggx_visible_normal(alpha: f32, normal: vec3f, v: vec3f, u: vec2f) -> vec3f {
    let n_dot_v = dot(normal, v);
    // The view where the microsurface is stretched to a hemisphere: a part along the normal and one across.
    let along = max(n_dot_v, 0.0);
    let part = (v - normal * n_dot_v) * alpha;
    let scale = inverseSqrt(max(along * along + dot(part, part), 1e-30));
    let stretched_along = along * scale;
    let stretched_part = part * scale;
    // A point of the cap from the pole down to -along, plus the view: the height of the sum, and what it has across.
    let height = (1.0 - u.x) * (1.0 + stretched_along);
    let low = dot(stretched_part, stretched_part) / (1.0 + stretched_along);
    let sine = sqrt(u.x * (1.0 + stretched_along) * (height + low));
    let sum = stretched_part + across(normal, u.y) * sine;
    return safe_normalize(sum * alpha + normal * height, normal);
}

fn ggx_visible_normal_pdf(alpha: f32, normal: vec3f, v: vec3f, h: vec3f) -> f32 {
    if dot(normal, h) <= 0.0 {
        return 0.0;
    }
    return ggx_distribution(alpha, normal, h) * max(dot(v, h), 0.0) * masking_over_cosine(alpha, dot(normal, v));
}

// G1(v) / (n.v) of GGX.
fn masking_over_cosine(alpha: f32, n_dot_v: f32) -> f32 {
    let alpha_squared = alpha * alpha;
    let c = max(n_dot_v, 0.0);
    return 2.0 / (c + sqrt(alpha_squared + (1.0 - alpha_squared) * c * c));
}

// Density of the reflection of v about sample_ggx_visible_normal.
fn ggx_reflection_pdf(alpha: f32, normal: vec3f, v: vec3f, l: vec3f) -> f32 {
    let h = safe_normalize(l + v, normal);
    if dot(normal, h) <= 0.0 {
        return 0.0;
    }
    return 0.25 * ggx_distribution(alpha, normal, h) * masking_over_cosine(alpha, dot(normal, v));
}

// Density of the reflection of v about sample_phong_half_vector with the exponent of alpha.
fn phong_reflection_pdf(alpha: f32, normal: vec3f, v: vec3f, l: vec3f) -> f32 {
    let sum = l + v;
    let h = safe_normalize(sum, normal);
    let v_dot_h = max(0.5 * length(sum), MIN_V_DOT_H);
    return 0.25 * phong_distribution(alpha, normal, h) * max(dot(normal, h), 0.0) / v_dot_h;
}

// A direction to the light, drawn for a surface's reflectance.
struct BrdfSample {
    direction: vec3f,
    // Density, 1/sr; 0 where there is no sample, and the weight is 0 with it.
    pdf: f32,
    // f(l, v) (n.l) / pdf.
    weight: vec3f,
}

// How often sample_brdf takes the specular lobe.
fn specular_probability(brdf: Brdf, n_dot_v: f32) -> f32 {
    let total = albedo_estimate(brdf, max(n_dot_v, 0.0));
    let all = luminance(total);
    if !(all > 0.0) {
        return 0.0;
    }
    return clamp(luminance(total - brdf.diffuse * PI) / all, 0.0, 1.0);
}

// One direction for the whole of a BRDF: cosine-weighted, or a reflection about a (GGX: visible) half vector, u.x choosing which and then used up to 1
// again. No sample (pdf 0) for n.v <= 0, and where a reflection goes below the horizon. About the shading normal alone: where a map has bent it, the
// caller drops directions that the geometric normal forbids.
fn sample_brdf(brdf: Brdf, n: vec3f, v: vec3f, u: vec2f) -> BrdfSample {
    let nothing = BrdfSample(n, 0.0, vec3f(0.0));
    let n_dot_v = dot(n, v);
    if n_dot_v <= 0.0 {
        return nothing;
    }
    let probability = specular_probability(brdf, n_dot_v);
    var direction: vec3f;
    if u.x < probability {
        let used = vec2f(min(u.x / probability, BELOW_ONE), u.y);
#ifdef NDF_PHONG
        let h = sample_phong_half_vector(phong_exponent(brdf.alpha), n, used);
#else
        let h = sample_ggx_visible_normal(brdf.alpha, n, v, used);
#endif
        let v_dot_h = dot(v, h);
        if v_dot_h <= 0.0 {
            return nothing;
        }
        direction = safe_normalize(2.0 * v_dot_h * h - v, n);
    } else {
        direction = sample_cosine_hemisphere(n, vec2f(min((u.x - probability) / (1.0 - probability), BELOW_ONE), u.y));
    }
    let pdf = brdf_pdf(brdf, n, v, direction);
    if !(pdf > 0.0) {
        return nothing;
    }
    return BrdfSample(direction, pdf, evaluate_brdf(brdf, n, n, direction, v) * (dot(n, direction) / pdf));
}

// Density of sample_brdf, 1/sr: 0 unless n.l > 0 and n.v > 0.
fn brdf_pdf(brdf: Brdf, n: vec3f, v: vec3f, l: vec3f) -> f32 {
    let n_dot_l = dot(n, l);
    let n_dot_v = dot(n, v);
    if n_dot_l <= 0.0 || n_dot_v <= 0.0 {
        return 0.0;
    }
#ifdef NDF_PHONG
    let specular = phong_reflection_pdf(brdf.alpha, n, v, l);
#else
    let specular = ggx_reflection_pdf(brdf.alpha, n, v, l);
#endif
    let probability = specular_probability(brdf, n_dot_v);
    return (1.0 - probability) * n_dot_l * INV_PI + probability * specular;
}
