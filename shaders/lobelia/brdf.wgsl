// The reflectance of glTF surfaces: Lambert plus a microfacet lobe with Smith's height-correlated masking and Schlick's Fresnel term.
//
//   f = base (1 - metallic) / pi + D G2 F / (4 (n.l) (n.v)),   alpha = max(roughness^2, 0.001)
//
// n: shading normal, l: to the light, v: to the viewer, h: half vector. The twin in `f64`, and what is known of the energy that each lobe reflects:
// `crates/lobes/src/brdf.rs`.
//
// Flags: SPECULAR (off: Lambert only), DIELECTRIC (off: dielectrics have an index of refraction of 1.5), NDF_PHONG (off: GGX), NORMAL_MAP (off: the
// geometric normal is the shading normal).
#define_import_path lobelia::brdf

#import lobelia::math::{INV_PI, PI, fifth_power, log_one_plus, safe_normalize}
#import lobelia::surface::Surface

const MIN_ALPHA: f32 = 0.001;

struct Brdf {
    // Diffuse albedo over pi.
    diffuse: vec3f,
    // Reflectance at normal incidence, and at grazing incidence.
    reflectance_normal: vec3f,
    reflectance_grazing: f32,
    alpha: f32,
}

fn brdf_from_surface(surface: Surface) -> Brdf {
    var brdf: Brdf;
    brdf.diffuse = surface.base_color * ((1.0 - surface.metallic) * INV_PI);
#ifdef SPECULAR
#ifdef DIELECTRIC
    brdf.reflectance_normal = surface.specular * mix(surface.dielectric.rgb, surface.base_color, surface.metallic);
    brdf.reflectance_grazing = surface.specular * mix(surface.dielectric.w, 1.0, surface.metallic);
#else
    brdf.reflectance_normal = surface.specular * mix(vec3f(0.04), surface.base_color, surface.metallic);
    brdf.reflectance_grazing = surface.specular;
#endif
    brdf.alpha = max(surface.roughness * surface.roughness, MIN_ALPHA);
#else
    brdf.reflectance_normal = vec3f(0.0);
    brdf.reflectance_grazing = 0.0;
    brdf.alpha = 1.0;
#endif
    return brdf;
}

// sin^2 of the angle between unit vectors without cancellation: 1 - (n.h)^2 loses every digit of a sharp lobe.
fn sin_squared(n: vec3f, h: vec3f) -> f32 {
    let c = cross(n, h);
    return min(dot(c, c), 1.0);
}

// GGX (Walter et al. 2007, equation 33): alpha^2 / (pi ((n.h)^2 (alpha^2 - 1) + 1)^2), the bracket written as cos^2 alpha^2 + sin^2.
fn ggx_distribution(alpha: f32, n: vec3f, h: vec3f) -> f32 {
    let s2 = sin_squared(n, h);
    let alpha_squared = alpha * alpha;
    let bracket = (1.0 - s2) * alpha_squared + s2;
    let ratio = alpha / bracket;
    return ratio * ratio * INV_PI;
}

// G2 / (4 (n.l) (n.v)) for GGX, height-correlated (Heitz 2014, equation 99).
fn ggx_visibility(alpha: f32, n_dot_l: f32, n_dot_v: f32) -> f32 {
    let alpha_squared = alpha * alpha;
    let lambda_v = n_dot_l * sqrt(n_dot_v * n_dot_v * (1.0 - alpha_squared) + alpha_squared);
    let lambda_l = n_dot_v * sqrt(n_dot_l * n_dot_l * (1.0 - alpha_squared) + alpha_squared);
    return 0.5 / max(lambda_v + lambda_l, 1e-20);
}

// Exponent of the Phong distribution that matches alpha, in [0, 2e6].
fn phong_exponent(alpha: f32) -> f32 {
    return max(2.0 / (alpha * alpha) - 2.0, 0.0);
}

// (e + 2) / (2 pi) (n.h)^e (Walter et al. 2007, equation 30). The power is exp(e/2 log(1 - sin^2)): pow would lose the lobe at large exponents.
fn phong_distribution(alpha: f32, n: vec3f, h: vec3f) -> f32 {
    let exponent = phong_exponent(alpha);
    return (exponent + 2.0) * 0.5 * INV_PI * exp(0.5 * exponent * log_one_plus(-sin_squared(n, h)));
}

// Smith's Lambda = 1/G1 - 1 of the Phong distribution, the rational fit for Beckmann's
// (Walter et al. 2007, Microfacet Models for Refraction through Rough Surfaces, equation 27) at a = sqrt(e/2 + 1) / tan.
fn phong_lambda(alpha: f32, n_dot_w: f32) -> f32 {
    let sine = sqrt(max(1.0 - n_dot_w * n_dot_w, 1e-12));
    let a = sqrt(0.5 * phong_exponent(alpha) + 1.0) * n_dot_w / sine;
    if a >= 1.6 {
        return 0.0;
    }
    return (1.0 + 2.276 * a + 2.577 * a * a) / max(3.535 * a + 2.181 * a * a, 1e-12) - 1.0;
}

fn phong_visibility(alpha: f32, n_dot_l: f32, n_dot_v: f32) -> f32 {
    let masking = 1.0 + phong_lambda(alpha, n_dot_l) + phong_lambda(alpha, n_dot_v);
    return 0.25 / max(masking * n_dot_l * n_dot_v, 1e-20);
}

// Schlick's approximation between f0 and f90.
fn fresnel(brdf: Brdf, v_dot_h: f32) -> vec3f {
    return brdf.reflectance_normal + (vec3f(brdf.reflectance_grazing) - brdf.reflectance_normal) * fifth_power(clamp(1.0 - v_dot_h, 0.0, 1.0));
}

// The specular part of f, 1/sr, for n.l > 0 and n.v > 0.
fn evaluate_specular(brdf: Brdf, n: vec3f, l: vec3f, v: vec3f, n_dot_l: f32, n_dot_v: f32) -> vec3f {
#ifdef SPECULAR
    let h = safe_normalize(l + v, n);
#ifdef NDF_PHONG
    let lobe = phong_distribution(brdf.alpha, n, h) * phong_visibility(brdf.alpha, n_dot_l, n_dot_v);
#else
    let lobe = ggx_distribution(brdf.alpha, n, h) * ggx_visibility(brdf.alpha, n_dot_l, n_dot_v);
#endif
    return lobe * fresnel(brdf, clamp(dot(v, h), 0.0, 1.0));
#else
    return vec3f(0.0);
#endif
}

// f(l, v), 1/sr, without the cosine; all vectors unit. 0 unless n.l > 0, n.v > 0 and l and v are on the same side of the geometric normal.
fn evaluate_brdf(brdf: Brdf, n: vec3f, geometric_normal: vec3f, l: vec3f, v: vec3f) -> vec3f {
    let n_dot_l = dot(n, l);
    let n_dot_v = dot(n, v);
    var sides = 1.0;
#ifdef NORMAL_MAP
    sides = dot(geometric_normal, l) * dot(geometric_normal, v);
#endif
    if !(n_dot_l > 0.0 && n_dot_v > 0.0 && sides > 0.0) {
        return vec3f(0.0);
    }
    return brdf.diffuse + evaluate_specular(brdf, n, l, v, n_dot_l, n_dot_v);
}

// About the integrals over v of D G2 / (4 n.l), in x, and of the same times (1 - l.h)^5, in y: rational functions of alpha and
// n.l / sqrt((n.l)^2 + alpha^2). 0 <= y <= x <= 1; off by 0.011 at the most. What the Phong distribution reflects beyond 1 is cut off.
fn specular_albedo_fit(alpha: f32, n_dot_l: f32) -> vec2f {
    let c = clamp(n_dot_l, 0.0, 1.0);
    let s = c * inverseSqrt(c * c + alpha * alpha);
#ifdef NDF_PHONG
    let above = 0.997736 + s * (-0.968412 + s * (0.317288 + s * -0.0929721)) + alpha * (-1.31369 + s * (0.551209 + s * 0.00188316) + alpha * (0.681277 + s * -0.0274519 + alpha * -0.135508));
    let below = 1.0 + s * (-0.728012 + s * -0.0197746) + alpha * (-1.43441 + s * 0.668922 + alpha * 0.594364);
    let schlick_above = 1.00669 + s * (-0.561109 + s * (-0.174035 + s * 0.269014)) + alpha * (-1.57555 + s * 0.506553 + alpha * 0.852314);
    let schlick_below = 1.0 + s * (-0.429838 + s * -0.0352457) + alpha * (3.48862 + s * -4.35659 + alpha * -0.740597);
#else
    let above = 0.99306 + s * (1.22247 + s * (-2.23416 + s * 0.527537)) + alpha * (-1.10864 + s * (0.161537 + s * 0.634634) + alpha * (0.403376 + s * -0.606537 + alpha * 0.0411019));
    let below = 1.0 + s * (1.33293 + s * -1.82067) + alpha * (-1.14555 + s * 0.73785 + alpha * 0.47553);
    let schlick_above = 0.976585 + s * (-0.490827 + s * (-0.333969 + s * 0.154412)) + alpha * (-0.482999 + s * 0.666946 + alpha * -0.107508);
    let schlick_below = 1.0 + s * (-0.320595 + s * -0.370928) + alpha * (14.5281 + s * -13.5666 + alpha * -5.2135);
#endif
    let all = clamp(above / below, 0.0, 1.0);
    return vec2f(all, clamp(fifth_power(1.0 - c) * schlick_above / schlick_below, 0.0, all));
}

// Share of the light from a direction that the specular lobe reflects, scattered once: within 0.011 of the larger reflectance.
fn specular_albedo(brdf: Brdf, n_dot_l: f32) -> vec3f {
#ifdef SPECULAR
    let fit = specular_albedo_fit(brdf.alpha, n_dot_l);
    return brdf.reflectance_normal * (fit.x - fit.y) + vec3f(brdf.reflectance_grazing * fit.y);
#else
    return vec3f(0.0);
#endif
}

// About the share of the light from a direction that the surface reflects, diffuse and specular.
fn albedo_estimate(brdf: Brdf, n_dot_l: f32) -> vec3f {
    return brdf.diffuse * PI + specular_albedo(brdf, n_dot_l);
}
