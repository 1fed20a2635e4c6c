// Microfacet lobes integrated over the solid angle of an outline, along the outline: exact but for the quadrature, whatever the distribution.
// The twin in `f64`: `crates/lobes/src/area_light/half_vector.rs`.
//
// Over a region of light directions i, the integral of D(h) / (4 h.v) di is that of D(h) dh over their half vectors. Polar integration about the normal makes
// it one along the edge: the integral of H(z) d theta, with the radial primitive H of D, z = n.h, and the azimuth theta about n. There is nothing to fit, and
// no split to find (Lecocq et al. 2017 approximate the edges by great circles). Along with it goes the integral of D(h) h dh, whose direction is where
// everything else in the reflectance is evaluated. Both are designs of this project.
//
// Everything is in the frame of the surface: z along the normal, the viewer in the half plane y = 0, x >= 0.
//
// Flags: HALF_VECTOR_NODES_TWO, _FOUR, _SIX; three quadrature nodes on each side without. Those of `lobelia::radial_primitive`.
#define_import_path lobelia::half_vector_integral

#import lobelia::light_outline::GreatArc
#import lobelia::math::log_one_plus
#import lobelia::radial_primitive::radial_primitive

struct HalfVectorSum {
    // Integral of D(h) dh.
    whole: f32,
    // Integral of D(h) h dh.
    mean: vec3f,
}

// Where along the arc the half vector is nearest to the normal: Newton steps from where the mirror direction is nearest.
fn half_vector_foot(arc: GreatArc, viewer: vec3f) -> f32 {
    let mirror = vec3f(-viewer.x, 0.0, viewer.z);
    var foot = atan2(dot(mirror, arc.tangent), dot(mirror, arc.start));
    // Beyond an end, the end that is nearer around the circle.
    if foot < 0.0 && -foot > foot + 6.28318531 - arc.length || foot > arc.length && foot - arc.length <= 6.28318531 - foot {
        foot = arc.length;
    }
    foot = clamp(foot, 0.0, arc.length);
    for (var step = 0; step < 2; step++) {
        let q = arc.start * cos(foot) + arc.tangent * sin(foot);
        let d = arc.tangent * cos(foot) - arc.start * sin(foot);
        let square = 2.0 + 2.0 * dot(q, viewer);
        let height = q.z + viewer.z;
        let slope = d.z * square - height * dot(viewer, d);
        let bend = -q.z * square + d.z * dot(viewer, d) + height * dot(viewer, q);
        if bend < 0.0 {
            foot -= clamp(slope / bend, -0.5, 0.5);
        } else {
            foot += 0.3 * sign(slope);
        }
    }
    return clamp(foot, 0.0, arc.length);
}

// What of the primitives is constant along an edge: integrated in closed form, so that the quadrature has only to find the rest. Far from the lobe that is next to
// nothing, and whether edges cancel there depends on rounding alone.
struct ConstantPart {
    whole: f32,
    along: f32,
    across: f32,
}

// A half vector that is not unit, and its place relative to the normal.
struct PlacedHalfVector {
    p: vec3f,
    square: f32,
    // Sine squared times `square`.
    across: f32,
    z: f32,
    // 1 - z, which z does not tell near the normal.
    om: f32,
}

fn half_vector_at(q: vec3f, viewer: vec3f) -> PlacedHalfVector {
    var place: PlacedHalfVector;
    place.p = q + viewer;
    place.square = max(dot(place.p, place.p), 1e-12);
    place.across = max(dot(place.p.xy, place.p.xy), 1e-14 * place.square);
    place.z = clamp(place.p.z * inverseSqrt(place.square), 0.0, 1.0);
    place.om = place.across / (place.square * (1.0 + place.z));
    return place;
}

// All of the primitives at the foot where that is far outside the lobe, nothing where the lobe is cut: there they are 0 at the normal, and turn with the azimuth.
fn constant_part(foot: PlacedHalfVector, alpha: f32) -> ConstantPart {
    let primitive = radial_primitive(alpha, foot.om, foot.z);
    let ratio = foot.om / (4.0 * alpha * alpha);
    let share = ratio * ratio / (1.0 + ratio * ratio);
    let sine_squared = foot.across / foot.square;
    return ConstantPart(share * primitive.whole * foot.om, share * primitive.along * foot.om, share * primitive.across * sine_squared * sqrt(sine_squared));
}

// One quadrature node: integrand times the derivative of phi.
fn half_vector_node(sum: ptr<function, HalfVectorSum>, arc: GreatArc, edge: EdgeSide, viewer: vec3f, alpha: f32, place: f32, weight: f32) {
    let e = exp(place);
    let square_place = place * place;
    // Over a short edge both exponentials are 1 but for rounding.
    let near = place * (1.0 + square_place * (0.166666667 + square_place * (0.00833333333 + square_place * 0.000198412698)));
    let phi = edge.foot + edge.width * select(0.5 * (e - 1.0 / e), near, abs(place) < 0.7);
    let q = arc.start * cos(phi) + arc.tangent * sin(phi);
    let d = arc.tangent * cos(phi) - arc.start * sin(phi);
    let h = half_vector_at(q, viewer);
    let primitive = radial_primitive(alpha, h.om, h.z);
    // d theta.
    let turn = (h.p.x * d.y - h.p.y * d.x) * (weight * edge.width * 0.5 * (e + 1.0 / e)) / h.across;
    let sine_squared = h.across / h.square;
    let across = primitive.across * sine_squared * sqrt(sine_squared) - edge.constant.across;
    (*sum).whole -= (primitive.whole * h.om - edge.constant.whole) * turn;
    (*sum).mean -= vec3f(h.p.xy * (inverseSqrt(h.across) * across * turn), (primitive.along * h.om - edge.constant.along) * turn);
}

// What the quadrature shares along an edge.
struct EdgeSide {
    foot: f32,
    width: f32,
    constant: ConstantPart,
}

// Gauss-Legendre in nu, phi = foot + width sinh nu, between 0 and `to`, whichever is larger: always in the direction of travel.
fn half_vector_side(sum: ptr<function, HalfVectorSum>, arc: GreatArc, edge: EdgeSide, viewer: vec3f, alpha: f32, to: f32) {
    let span = abs(to);
#ifdef HALF_VECTOR_NODES_TWO
    half_vector_node(sum, arc, edge, viewer, alpha, 0.211324865 * to, 0.5 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.788675135 * to, 0.5 * span);
#else
#ifdef HALF_VECTOR_NODES_FOUR
    half_vector_node(sum, arc, edge, viewer, alpha, 0.0694318442 * to, 0.173927423 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.330009478 * to, 0.326072577 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.669990522 * to, 0.326072577 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.930568156 * to, 0.173927423 * span);
#else
#ifdef HALF_VECTOR_NODES_SIX
    half_vector_node(sum, arc, edge, viewer, alpha, 0.0337652429 * to, 0.0856622462 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.169395307 * to, 0.180380787 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.380690407 * to, 0.233956967 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.619309593 * to, 0.233956967 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.830604693 * to, 0.180380787 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.966234757 * to, 0.0856622462 * span);
#else
    half_vector_node(sum, arc, edge, viewer, alpha, 0.112701665 * to, 0.277777778 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.5 * to, 0.444444444 * span);
    half_vector_node(sum, arc, edge, viewer, alpha, 0.887298335 * to, 0.277777778 * span);
#endif
#endif
#endif
}

// arsinh for x >= 0, without cancellation: relative error 5e-7.
fn arsinh_positive(x: f32) -> f32 {
    return log_one_plus(x + x * x / (1.0 + sqrt(1.0 + x * x)));
}

// Adds what is constant from the foot to an end, in closed form: the azimuth between them, and its sine and cosine. `sign` is that of the direction of travel.
fn add_constant_part(sum: ptr<function, HalfVectorSum>, constant: ConstantPart, foot: PlacedHalfVector, end: PlacedHalfVector, sign: f32) {
    let a = foot.p.xy * inverseSqrt(foot.across);
    let b = end.p.xy * inverseSqrt(end.across);
    let turn = sign * atan2(a.x * b.y - a.y * b.x, dot(a, b));
    (*sum).whole -= constant.whole * turn;
    (*sum).mean -= vec3f(constant.across * sign * vec2f(b.y - a.y, a.x - b.x), constant.along * turn);
}

// Adds an edge that lies above the horizon. Sums over a closed outline that runs counter-clockwise as seen from the shading point; one that runs clockwise
// gives the negative. The viewer is above the horizon.
fn add_half_vector_edge(sum: ptr<function, HalfVectorSum>, arc: GreatArc, viewer: vec3f, alpha: f32) {
    if arc.length <= 0.0 {
        return;
    }
    var edge: EdgeSide;
    edge.foot = half_vector_foot(arc, viewer);
    let d = arc.tangent * cos(edge.foot) - arc.start * sin(edge.foot);
    let foot = half_vector_at(arc.start * cos(edge.foot) + arc.tangent * sin(edge.foot), viewer);
    // Along the edge the lobe is as wide as its distance from the normal, or its own width where it is nearer.
    let reach = foot.across + alpha * alpha * foot.square;
    edge.width = clamp(sqrt(reach / max(dot(d.xy, d.xy), 1e-12)), 1e-5, 1e3);
    edge.constant = constant_part(foot, alpha);
    let before = arsinh_positive(edge.foot / edge.width);
    let after = arsinh_positive((arc.length - edge.foot) / edge.width);
    if before > 0.0 {
        half_vector_side(sum, arc, edge, viewer, alpha, -before);
        add_constant_part(sum, edge.constant, foot, half_vector_at(arc.start, viewer), -1.0);
    }
    if after > 0.0 {
        half_vector_side(sum, arc, edge, viewer, alpha, after);
        let last = arc.start * cos(arc.length) + arc.tangent * sin(arc.length);
        add_constant_part(sum, edge.constant, foot, half_vector_at(last, viewer), 1.0);
    }
}
