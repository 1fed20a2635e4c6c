// From linear radiance to display colours in [0, 1], sRGB-encoded. Every curve is finite for radiance in [0, 1e30]. For rising
// grey none falls, but for AgX just before white, by at most 4e-6 besides rounding.
#define_import_path lobelia::tonemap

// Highlights beyond this are white under every curve.
const MAX_INPUT: f32 = 1e6;

// sRGB transfer function, piecewise.
fn srgb_encode(linear: vec3f) -> vec3f {
    let clamped = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(max(clamped, vec3f(1e-8)), vec3f(1.0 / 2.4)) - vec3f(0.055), 12.92 * clamped, clamped <= vec3f(0.0031308));
}

// ACES reference and output device transforms, rational fit by Stephen Hill (BakingLab, ACES.hlsl), sRGB in, linear sRGB out.
fn aces(radiance: vec3f) -> vec3f {
    let color = min(max(radiance, vec3f(0.0)), vec3f(MAX_INPUT));
    let c = vec3f(
        dot(color, vec3f(0.59719, 0.35458, 0.04823)),
        dot(color, vec3f(0.07600, 0.90834, 0.01566)),
        dot(color, vec3f(0.02840, 0.13383, 0.83777)),
    );
    let fitted = (c * (c + vec3f(0.0245786)) - vec3f(0.000090537)) / (c * (0.983729 * c + vec3f(0.4329510)) + vec3f(0.238081));
    return clamp(vec3f(
        dot(fitted, vec3f(1.60475, -0.53108, -0.07367)),
        dot(fitted, vec3f(-0.10208, 1.10813, -0.00605)),
        dot(fitted, vec3f(-0.00327, -0.07276, 1.07602)),
    ), vec3f(0.0), vec3f(1.0));
}

// Sixth-order fit of AgX's default contrast curve by Benjamin Wrensch (Minimal AgX Implementation, 2023).
fn agx_contrast(x: vec3f) -> vec3f {
    let x2 = x * x;
    let x4 = x2 * x2;
    return 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - vec3f(0.00232);
}

// AgX (Troy Sobotka) with its base look. The result is display-encoded for a pure power of 2.2; it is linearised here so that every curve
// of this module hands linear values to `srgb_encode`.
fn agx(radiance: vec3f) -> vec3f {
    let color = min(max(radiance, vec3f(0.0)), vec3f(MAX_INPUT));
    let inset = vec3f(
        dot(color, vec3f(0.842479062253094, 0.0784335999999992, 0.0792237451477643)),
        dot(color, vec3f(0.0423282422610123, 0.878468636469772, 0.0791661274605434)),
        dot(color, vec3f(0.0423756549057051, 0.0784336, 0.879142973793104)),
    );
    let stops = clamp((log2(max(inset, vec3f(1e-10))) + vec3f(12.47393)) / 16.5, vec3f(0.0), vec3f(1.0));
    let curved = agx_contrast(stops);
    let outset = vec3f(
        dot(curved, vec3f(1.19687900512017, -0.0980208811401368, -0.0990297440797205)),
        dot(curved, vec3f(-0.0528968517574562, 1.15190312990417, -0.0989611768448433)),
        dot(curved, vec3f(-0.0529716355144438, -0.0980434501171241, 1.15107367264116)),
    );
    return pow(clamp(outset, vec3f(0.0), vec3f(1.0)), vec3f(2.2));
}
