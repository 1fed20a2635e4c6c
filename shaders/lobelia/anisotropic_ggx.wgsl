// GGX with an alpha along the tangent and one across it, for brushed surfaces. Directions are in the frame of the surface: x along the tangent, z along the normal.
//
// The twin in `f64`: `crates/lobes/src/anisotropic_ggx.rs`.
#define_import_path lobelia::anisotropic_ggx

#import lobelia::brdf::MIN_ALPHA
#import lobelia::math::INV_PI

// Scale of half vectors, along the tangent and across it, that makes the anisotropic distribution the isotropic one of the geometric mean of its alphas. Alphas are
// in the ratio (1 + anisotropy) : (1 - anisotropy), with anisotropy in (-1, 1).
fn anisotropic_stretch(anisotropy: f32) -> vec2f {
    let along = sqrt((1.0 - anisotropy) / (1.0 + anisotropy));
    return vec2f(along, 1.0 / along);
}

// Geometric mean of alpha (1 + anisotropy) and alpha (1 - anisotropy).
fn anisotropic_mean_alpha(alpha: f32, anisotropy: f32) -> f32 {
    return max(alpha * sqrt((1.0 - anisotropy) * (1.0 + anisotropy)), MIN_ALPHA);
}

// Along the tangent and across it.
fn anisotropic_alphas(alpha: f32, anisotropy: f32) -> vec2f {
    return anisotropic_mean_alpha(alpha, anisotropy) / anisotropic_stretch(anisotropy);
}

// Burley 2012, Physically Based Shading at Disney, equation 13; h is unit and above the horizon.
fn anisotropic_ggx_distribution(alphas: vec2f, h: vec3f) -> f32 {
    let slopes = h.xy / alphas;
    let bracket = dot(slopes, slopes) + h.z * h.z;
    return INV_PI / (alphas.x * alphas.y * bracket * bracket);
}

// G2 / (4 (n.l) (n.v)), height-correlated (Heitz 2014, equations 86 and 99).
fn anisotropic_ggx_visibility(alphas: vec2f, l: vec3f, v: vec3f) -> f32 {
    let below = l.z * length(vec3f(v.xy * alphas, v.z)) + v.z * length(vec3f(l.xy * alphas, l.z));
    return 0.5 / max(below, 1e-20);
}
