// GGX lobes integrated over lights: the vector irradiance of a stretched outline. The twin in `f64`: `crates/lobes/src/area_light/ggx_half_vector.rs`.
//
// In slopes m = -h.xy / h.z the projected distribution D(h) (n.h) dh is 1 / (pi ax ay (1 + (mx/ax)^2 + (my/ay)^2)^2) dm, which is the clamped cosine over directions
// u = (h.x / ax, h.y / ay, h.z), made unit. So the integral of D(h) h dh is, up to the stretch, that of u du: the vector irradiance of the half vectors as u sees them, and by
// Stokes' theorem half the integral of u x du along their edge. There is no primitive and no arc tangent left in it, and two alphas cost nothing more than one.
//
// Half vectors of a straight edge, or of any circle, are up to their length quadratic in the tangent of half the angle along it, and so is u. What is integrated is the
// ratio of a polynomial of degree 2 and one of degree 4, whose complex roots tell where it peaks and how wide. All of this is a design of this project.
//
// Everything is in the frame of the surface: z along the normal, x along the tangent of anisotropic surfaces.
//
// Flags: HALF_VECTOR_NODES_TWO, _FOUR, _SIX; three quadrature nodes on each side of a peak without. ANISOTROPIC: more than one alpha.
#define_import_path lobelia::ggx_half_vector

#import lobelia::circular_arc::CircularArc
#import lobelia::math::{INV_PI, TAU, log_one_plus}

struct GgxPeak {
    // u from the peak on: foot + 2 half_linear t + square t^2.
    foot: vec3f,
    half_linear: vec3f,
    square: vec3f,
    width: f32,
    // Of the azimuth: what is integrated in closed form, and the rest.
    share: f32,
    rest: f32,
}

// Integrals of 1, t and t^2 over |u|^2, and of these times what is left of the azimuth.
struct GgxPowers {
    across: vec3f,
    along: vec3f,
}

// A quadrature node at t = width sinh nu, times `direction`. (Near the peak sinh loses digits of a place where nothing depends on them.)
fn ggx_node(powers: ptr<function, GgxPowers>, peak: GgxPeak, direction: f32, nu: f32, weight: f32) {
    let e = exp(nu);
    let half = 0.5 * peak.width;
    let t = direction * half * (e - 1.0 / e);
    let u = peak.foot + (2.0 * peak.half_linear + peak.square * t) * t;
    let height = u.z * u.z;
    let radius = max(dot(u.xy, u.xy), 1e-7 * height + 1e-24);
    let scale = weight * half * (e + 1.0 / e) / (radius * (radius + height));
    let along = scale * (peak.rest * radius - peak.share * height);
    let across = scale * radius;
    let power = vec3f(1.0, t, t * t);
    (*powers).across += across * power;
    (*powers).along += along * power;
}

// From the peak to `reach` in the direction of the sign of `direction`.
fn ggx_side(powers: ptr<function, GgxPowers>, peak: GgxPeak, direction: f32, reach: f32) {
    let x = reach / peak.width;
    let to = log_one_plus(x + x * x / (1.0 + sqrt(1.0 + x * x)));
#ifdef HALF_VECTOR_NODES_TWO
    ggx_node(powers, peak, direction, 0.211324865 * to, 0.5 * to);
    ggx_node(powers, peak, direction, 0.788675135 * to, 0.5 * to);
#else
#ifdef HALF_VECTOR_NODES_FOUR
    ggx_node(powers, peak, direction, 0.0694318442 * to, 0.173927423 * to);
    ggx_node(powers, peak, direction, 0.330009478 * to, 0.326072577 * to);
    ggx_node(powers, peak, direction, 0.669990522 * to, 0.326072577 * to);
    ggx_node(powers, peak, direction, 0.930568156 * to, 0.173927423 * to);
#else
#ifdef HALF_VECTOR_NODES_SIX
    ggx_node(powers, peak, direction, 0.0337652429 * to, 0.0856622462 * to);
    ggx_node(powers, peak, direction, 0.169395307 * to, 0.180380787 * to);
    ggx_node(powers, peak, direction, 0.380690407 * to, 0.233956967 * to);
    ggx_node(powers, peak, direction, 0.619309593 * to, 0.233956967 * to);
    ggx_node(powers, peak, direction, 0.830604693 * to, 0.180380787 * to);
    ggx_node(powers, peak, direction, 0.966234757 * to, 0.0856622462 * to);
#else
    ggx_node(powers, peak, direction, 0.112701665 * to, 0.277777778 * to);
    ggx_node(powers, peak, direction, 0.5 * to, 0.444444444 * to);
    ggx_node(powers, peak, direction, 0.887298335 * to, 0.277777778 * to);
#endif
#endif
#endif
}

fn complex_product(a: vec2f, b: vec2f) -> vec2f {
    return vec2f(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

fn complex_root(a: vec2f) -> vec2f {
    let larger = sqrt(0.5 * (length(a) + abs(a.x)));
    let smaller = 0.5 * a.y / max(larger, 1e-18);
    return select(vec2f(abs(smaller), select(-larger, larger, a.y >= 0.0)), vec2f(larger, smaller), a.x >= 0.0);
}

fn plane_cross(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// Tangent of the angle between u and the normal, squared.
fn slope_squared(u: vec3f) -> f32 {
    return dot(u.xy, u.xy) / max(u.z * u.z, 1e-30);
}

// Adds u = constant + 2 half_linear t + square t^2 for t in [start, end].
fn add_ggx_piece(sum: ptr<function, vec3f>, constant: vec3f, half_linear: vec3f, square: vec3f, start: f32, end: f32) {
    // Roots of u.x + i u.y: where half vectors would meet the normal, were t complex.
    let linear = 2.0 * half_linear.xy;
    var root = complex_root(complex_product(linear, linear) - 4.0 * complex_product(constant.xy, square.xy));
    root = select(root, -root, dot(linear, root) < 0.0);
    let q = -0.5 * (linear + root);
    // Of the two places that are nearest to these roots, the one nearer to the lobe; the width joins the distance from the root and the lobe's own.
    let near = clamp(dot(constant.xy, q) / max(dot(q, q), 1e-30), start, end);
    let far = clamp(dot(q, square.xy) / max(dot(square.xy, square.xy), 1e-30), start, end);
    let at_near = constant + (2.0 * half_linear + square * near) * near;
    let at_far = constant + (2.0 * half_linear + square * far) * far;
    let is_far = dot(at_far, at_far) < dot(at_near, at_near);
    let place = select(near, far, is_far);
    var peak: GgxPeak;
    peak.foot = select(at_near, at_far, is_far);
    peak.half_linear = half_linear + square * place;
    peak.square = square;
    peak.width = clamp(length(peak.foot) / max(length(root), 1e-12), 1e-7, 1e6);
    // Far outside the lobe edges cancel to a thousandth of their values, and what decides is the height of u and not its azimuth, which is integrated in closed form there.
    let ratio = min(0.125 * min(slope_squared(at_near), slope_squared(at_far)), 1e9);
    peak.rest = 1.0 / (1.0 + ratio * ratio);
    peak.share = ratio * ratio * peak.rest;
    var powers: GgxPowers;
    if place > start {
        ggx_side(&powers, peak, -1.0, place - start);
    }
    if place < end {
        ggx_side(&powers, peak, 1.0, end - place);
    }
    let first = cross(peak.foot, peak.half_linear);
    let second = cross(peak.foot, square);
    let third = cross(peak.half_linear, square);
    var added = first * vec3f(powers.across.xx, powers.along.x) + second * vec3f(powers.across.yy, powers.along.y) + third * vec3f(powers.across.zz, powers.along.z);
    if peak.share > 1e-8 {
        // u turns by what it is seen to turn from both roots, each less than half a circle.
        let a = constant.xy + (linear + square.xy * start) * start;
        let b = constant.xy + (linear + square.xy * end) * end;
        let turn = atan2(plane_cross(a, b), dot(a, b));
        let from_near = plane_cross(q * start - constant.xy, q * end - constant.xy);
        let from_far = plane_cross(square.xy * start - q, square.xy * end - q);
        let over = select(0.0, sign(from_near), from_near * from_far > 0.0 && turn * from_near < 0.0);
        added.z += 0.5 * peak.share * (turn + TAU * over);
    }
    *sum += added;
}

// Adds an arc that lies above the horizon, for a viewer above it. `stretch`: the geometric mean of the alphas over each of them, and that mean. Over a closed outline that runs
// counter-clockwise as seen from the shading point the sum is, by `ggx_mean`, the integral of D(h) h dh.
fn add_ggx_arc(sum: ptr<function, vec3f>, arc: CircularArc, viewer: vec3f, stretch: vec3f) {
    let constant = (viewer + arc.middle) * stretch;
    let half_linear = arc.tangent * stretch;
    let square = (viewer + arc.opposite) * stretch;
#ifdef ANISOTROPIC
    // Stretched half vectors can come near the normal twice along an arc, but not along pieces as short as these.
    let pieces = max(ceil(2.0 * arc.half_angle / min(stretch.x, stretch.y)), 1.0);
    var start = -arc.end;
    for (var piece = 1.0; piece <= pieces; piece += 1.0) {
        let end = select(arc.end, tan(arc.half_angle * (piece / pieces - 0.5)), piece < pieces);
        add_ggx_piece(sum, constant, half_linear, square, start, end);
        start = end;
    }
#else
    add_ggx_piece(sum, constant, half_linear, square, -arc.end, arc.end);
#endif
}

// The integral of D(h) h dh: its direction is the mean half vector, its cosine to the viewer the integral of D / 4 over light directions.
fn ggx_mean(sum: vec3f, stretch: vec3f) -> vec3f {
    return sum * vec3f(stretch.zz / stretch.xy, 1.0) * -INV_PI;
}
