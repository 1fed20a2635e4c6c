// Arcs of circles on the sphere of directions: straight edges as they are seen, and what rims of round lights are taken for.
//
// The rim of a sphere is seen as a circle. That of a disk or an ellipsoid is not, but an arc of it lies much nearer to the circle through its ends and its middle than
// to a chord. Irradiance along a circle has a closed form, and half vectors along one are quadratic up to their length (see `lobelia::ggx_half_vector`), so nothing costs
// more than along a straight edge. Both uses are designs of this project. The twin in `f64`: `crates/lobes/src/area_light/circular_arc.rs`.
#define_import_path lobelia::circular_arc

#import lobelia::light_outline::{GreatArc, Rim, VisibleRim, great_arc, rim_point}
#import lobelia::math::safe_normalize

// Unit directions (middle + 2 tangent t + opposite t^2) / (1 + t^2), |t| <= `end`: t is the tangent of half the angle from the middle.
struct CircularArc {
    middle: vec3f,
    // Opposite point of the whole circle.
    opposite: vec3f,
    // Direction of travel at the middle, as long as the circle's radius.
    tangent: vec3f,
    // Angle on the circle from the middle to the end, and the tangent of half of it, at most 1.
    half_angle: f32,
    end: f32,
}

fn arc_of_great_circle(arc: GreatArc) -> CircularArc {
    let half_angle = 0.5 * arc.length;
    let sine = sin(half_angle);
    let cosine = cos(half_angle);
    let middle = arc.start * cosine + arc.tangent * sine;
    return CircularArc(middle, -middle, arc.tangent * cosine - arc.start * sine, half_angle, sine / (1.0 + cosine));
}

// The circle through both ends of a straight line and a unit direction between them that is up to a third of the circle from both.
fn arc_through(great: CircularArc, between: vec3f) -> CircularArc {
    if great.half_angle <= 0.0 {
        return great;
    }
    // Height above the plane of the straight line, and along that line.
    let across = cross(great.middle, great.tangent);
    let height = dot(between, across);
    let place = dot(between, great.tangent);
    let sine = sin(great.half_angle);
    let cosine = cos(great.half_angle);
    // What is between cosines of small angles is known from their sines.
    let depth = (sine * sine - place * place - height * height) / (dot(between, great.middle) + cosine);
    let slope = -height / max(depth, 1e-6 * sine * sine + 1e-30);
    // Half the angle by which the arc's middle is above the straight line.
    let half_rise = -slope * (sine * sine / (1.0 + cosine)) / (1.0 + sqrt(1.0 + slope * slope * sine * sine));
    let square = half_rise * half_rise;
    let rise = vec2f(1.0 - square, 2.0 * half_rise) / (1.0 + square);
    var arc: CircularArc;
    arc.middle = great.middle * rise.x + across * rise.y;
    // Axis of the circle.
    let inverse_size = inverseSqrt(1.0 + slope * slope);
    let axis = (great.middle * slope + across) * inverse_size;
    let radius = (rise.x - slope * rise.y) * inverse_size;
    arc.opposite = axis * (2.0 * dot(axis, arc.middle)) - arc.middle;
    arc.tangent = great.tangent * radius;
    let end_sine = clamp(sine / max(radius, 1e-30), 0.0, 1.0);
    arc.end = end_sine / (1.0 + sqrt((1.0 - end_sine) * (1.0 + end_sine)));
    arc.half_angle = 2.0 * atan(arc.end);
    return arc;
}

// Arcs that make up the outline of what is visible of a rim: `count` along the rim, and the horizon where that cuts it. (As many along the rim whatever is visible: were there fewer as a light
// sets, it would jump by what they are off.)
fn rim_arc_count(visible: VisibleRim, count: u32) -> u32 {
    return select(count + 1u, count, visible.whole);
}

fn rim_arc(rim: Rim, visible: VisibleRim, place: u32, count: u32) -> CircularArc {
    let turn = (visible.end - visible.start) / f32(count);
    let start = visible.start + turn * f32(place);
    let is_horizon = place == count;
    let line = great_arc(rim_point(rim, start), rim_point(rim, select(start + turn, visible.start, is_horizon)));
    let great = arc_of_great_circle(line);
    if is_horizon {
        return great;
    }
    return arc_through(great, safe_normalize(rim_point(rim, start + 0.5 * turn), great.middle));
}

// What an arc above the horizon adds to the integral of cos du: Lambert's formula (1760), and its like along a circle.
fn irradiance_along(arc: CircularArc) -> f32 {
    let center = arc.middle + arc.opposite;
    let out = arc.middle - arc.opposite;
    let tangent = arc.tangent;
    let sine = 2.0 * arc.end / (1.0 + arc.end * arc.end);
    return -0.5 * ((out.x * tangent.y - out.y * tangent.x) * arc.half_angle + (center.x * tangent.y - center.y * tangent.x) * sine);
}
