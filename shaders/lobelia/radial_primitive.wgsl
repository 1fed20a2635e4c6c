// Microfacet distributions integrated along meridians, from their pole to an angle: what turns an integral over an area of half vectors into one along its
// edge. The twin in `f64`: `crates/lobes/src/area_light/radial_primitive.rs`.
//
// With z = n.h and D(z) the distribution:  H = integral of D,  Z = integral of D z,  S = integral of D sqrt(1 - z^2),  each over [z, 1] in z.
//
// GGX has a simpler way, `lobelia::ggx_half_vector`.
//
// Flags: NDF_BECKMANN; the distribution of Blinn and Phong without.
#define_import_path lobelia::radial_primitive

#import lobelia::brdf::phong_exponent
#import lobelia::math::{INV_PI, decay_mean, erf_mean, erfc, log_one_plus}

struct RadialPrimitive {
    // H / (1 - z), finite at z = 1.
    whole: f32,
    // Z / (1 - z).
    along: f32,
    // S / (1 - z^2)^(3/2).
    across: f32,
}

// (sqrt(pi)/2 erf t - t e^(-t^2)) / t^3 for t >= 0; 2/3 at 0. Relative error 5e-6.
fn gauss_rest(t: f32) -> f32 {
    let s = t * t;
    if s < 0.5 {
        return 0.666666667 + s * (-0.4 + s * (0.142857143 + s * (-0.037037037 + s * (0.00757575758 + s * (-0.00128205128 + s * (0.000185185185 + s * -2.3342670e-5))))));
    }
    return (erf_mean(t) - exp(-s)) / s;
}

// D = (n+2) / (2 pi) z^n. H and Z are exact; S takes the power for e^(-(n-1)/2 s^2) with s = sqrt(1 - z^2): within 3 % of its largest value from n = 20
// on.
fn radial_primitive_phong(alpha: f32, om: f32, z: f32) -> RadialPrimitive {
    let n = phong_exponent(alpha);
    let log_z = -log_one_plus(-min(om, 0.9999999));
    let scale = (0.5 * INV_PI) * log_z / om;
    var primitive: RadialPrimitive;
    primitive.whole = scale * (n + 2.0) * decay_mean((n + 1.0) * log_z);
    primitive.along = scale * (n + 2.0) * decay_mean((n + 2.0) * log_z);
    // Integral of s^2 e^(-a s^2) is (sqrt(pi)/2 erf t - t e^(-t^2)) / (2 a^(3/2)), t = sqrt(a) s.
    let a = max(0.5 * (n - 1.0), 1e-6);
    primitive.across = (0.25 * INV_PI) * (n + 2.0) * gauss_rest(sqrt(a * om * (1.0 + z)));
    return primitive;
}

// D = e^(-u) / (pi m^2 z^4), u = tan^2 / m^2, m = alpha.  H = integral of sqrt(1 + m^2 u) e^(-u) / (2 pi) over [0, u].
// Z = (1 - e^(-u)) / (2 pi).  S = m (sqrt(pi)/2 erf t - t e^(-t^2)) / (2 pi), t = tan / m.
fn radial_primitive_beckmann(alpha: f32, om: f32, z: f32) -> RadialPrimitive {
    let cosine = max(z, 1e-4);
    let m_squared = alpha * alpha;
    let u_over_om = (1.0 + z) / (m_squared * cosine * cosine);
    let u = u_over_om * om;
    var primitive: RadialPrimitive;
    var half_integral = 0.0;
    if u < 1.0 {
        // The closed form cancels here: five Gauss-Legendre nodes.
        half_integral = 0.118463443 * (beckmann_integrand(m_squared, 0.0469100770 * u) + beckmann_integrand(m_squared, 0.953089923 * u))
            + 0.239314335 * (beckmann_integrand(m_squared, 0.230765345 * u) + beckmann_integrand(m_squared, 0.769234655 * u))
            + 0.284444444 * beckmann_integrand(m_squared, 0.5 * u);
        primitive.whole = (0.5 * INV_PI) * half_integral * u_over_om;
        primitive.along = (0.5 * INV_PI) * decay_mean(u) * u_over_om;
    } else {
        let e = exp(-u);
        primitive.along = (0.5 * INV_PI) * (1.0 - e) / om;
        half_integral = 1.0 - e / cosine + 0.886226925 * alpha * (scaled_erfc(1.0 / alpha) - e * scaled_erfc(1.0 / (alpha * cosine)));
        primitive.whole = (0.5 * INV_PI) * half_integral / om;
    }
    primitive.across = (0.5 * INV_PI) * gauss_rest(sqrt(u)) / (m_squared * cosine * cosine * cosine);
    return primitive;
}

fn beckmann_integrand(m_squared: f32, u: f32) -> f32 {
    return sqrt(1.0 + m_squared * u) * exp(-u);
}

// e^(x^2) erfc x for x >= 0. Below 4 from `erfc`, above by its asymptotic series; relative error 1e-5.
fn scaled_erfc(x: f32) -> f32 {
    if x < 4.0 {
        return erfc(x) * exp(x * x);
    }
    let s = 1.0 / (x * x);
    return 0.564189584 / x * (1.0 + s * (-0.5 + s * (0.75 + s * (-1.875 + s * 6.5625))));
}

// `om` is 1 - z, > 0; z is given as well, since 1 - z is known better than z tells. alpha in [0.001, 1].
fn radial_primitive(alpha: f32, om: f32, z: f32) -> RadialPrimitive {
#ifdef NDF_BECKMANN
    return radial_primitive_beckmann(alpha, om, z);
#else
    return radial_primitive_phong(alpha, om, z);
#endif
}
