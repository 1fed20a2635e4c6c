// Outlines of area lights as a surface sees them, and Lambert's formula along them.
//
// Everything is in the frame of the surface: the origin on it, z along the normal. An outline runs counter-clockwise as seen from the origin.
// The twins in `f64`: `crates/lobes/src/area_light/round.rs` and `lambert.rs`.
#define_import_path lobelia::light_outline

#import lobelia::math::{perpendicular, safe_normalize}

// An ellipse in space: center + axis_a cos f + axis_b sin f.
struct Rim {
    center: vec3f,
    axis_a: vec3f,
    axis_b: vec3f,
}

// The rim of a disk or ellipse, turned so that it runs counter-clockwise as seen from the origin.
fn rim_of_disk(center: vec3f, axis_a: vec3f, axis_b: vec3f) -> Rim {
    // Seen from the origin, counter-clockwise is left-handed about the direction of sight.
    let away = dot(center, cross(axis_a, axis_b)) > 0.0;
    return Rim(center, axis_a, select(axis_b, -axis_b, away));
}

// The rim at which an ellipsoid, center + axes q with |q| = 1, is seen; all zero from inside or where it has no volume. Where the ellipsoid is the unit sphere it is
// seen as a circle, and linear maps keep what is seen.
fn rim_of_ellipsoid(center: vec3f, axes: mat3x3f) -> Rim {
    let cofactors = mat3x3f(cross(axes[1], axes[2]), cross(axes[2], axes[0]), cross(axes[0], axes[1]));
    let volume = dot(axes[0], cofactors[0]);
    let unit = vec3f(dot(cofactors[0], center), dot(cofactors[1], center), dot(cofactors[2], center)) / volume;
    let distance = length(unit);
    if !(distance > 1.0 && distance < 1e15) {
        return Rim(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    }
    let inverse = 1.0 / distance;
    let near = (1.0 - inverse) * (1.0 + inverse);
    let towards = unit * inverse;
    let a = perpendicular(towards);
    let b = cross(towards, a);
    let radius = sqrt(near);
    return rim_of_disk(center * near, axes * a * radius, axes * b * radius);
}

// Corner of the regular polygon of `sides` corners that has the rim's area: an inscribed one loses light, 2.6 % of it with sixteen corners.
fn rim_corner(rim: Rim, corner: u32, sides: u32) -> vec3f {
    let turn = 6.28318531 / f32(sides);
    let f = turn * f32(corner);
    let scale = sqrt(turn / sin(turn));
    return rim.center + (rim.axis_a * cos(f) + rim.axis_b * sin(f)) * scale;
}

// An edge: directions start cos phi + tangent sin phi, phi in [0, length].
struct GreatArc {
    start: vec3f,
    tangent: vec3f,
    length: f32,
}

// The arc between two points; of length 0 where they are seen in one direction, or one of them is the origin.
fn great_arc(start: vec3f, to: vec3f) -> GreatArc {
    let direction = safe_normalize(start, vec3f(0.0, 0.0, 1.0));
    // From the points themselves: directions of a short far edge are equal but for rounding.
    let normal = cross(start, to - start);
    let size = length(normal);
    if !(size > 1e-12 * dot(start, start)) {
        return GreatArc(direction, vec3f(0.0), 0.0);
    }
    return GreatArc(direction, cross(normal / size, direction), atan2(size, dot(start, to)));
}

// What an edge above the horizon adds to the integral of cos du (Lambert 1760): half its length times the cosine of its plane's normal.
fn lambert_edge(arc: GreatArc) -> f32 {
    return -0.5 * arc.length * (arc.start.x * arc.tangent.y - arc.start.y * arc.tangent.x);
}

// Where the line between two points on either side of the horizon meets it.
fn horizon_crossing(start: vec3f, to: vec3f) -> vec3f {
    let share = start.z / (start.z - to.z);
    return vec3f(mix(start.xy, to.xy, share), 0.0);
}

// The walk along an outline that leaves out what is below the horizon: every edge gives up to two arcs above it, itself and the piece of the horizon over
// which the outline was away. No corners are stored, so an outline has as many as it likes, and need not be convex: pieces of the horizon that are walked
// both ways cancel. Begin with all zero; after the last edge, `close_outline` gives what is left.
struct OutlineWalk {
    // Where the outline first came up, if it began below.
    first: vec3f,
    began_below: bool,
    // Where it last went down.
    last: vec3f,
    is_below: bool,
}

// An arc of length 0 where both ends are one point.
struct OutlineStep {
    horizon_from: vec3f,
    horizon_to: vec3f,
    start: vec3f,
    to: vec3f,
}

fn walk_outline(walk: ptr<function, OutlineWalk>, start: vec3f, to: vec3f) -> OutlineStep {
    let starts = start.z > 0.0;
    let ends = to.z > 0.0;
    var step: OutlineStep;
    if starts && ends {
        step.start = start;
        step.to = to;
    } else if starts {
        step.start = start;
        step.to = horizon_crossing(start, to);
        (*walk).last = step.to;
        (*walk).is_below = true;
    } else if ends {
        step.start = horizon_crossing(start, to);
        step.to = to;
        if (*walk).is_below {
            step.horizon_from = (*walk).last;
            step.horizon_to = step.start;
            (*walk).is_below = false;
        } else {
            (*walk).first = step.start;
            (*walk).began_below = true;
        }
    }
    return step;
}

fn close_outline(walk: OutlineWalk) -> OutlineStep {
    var step: OutlineStep;
    if walk.began_below && walk.is_below {
        step.horizon_from = walk.last;
        step.horizon_to = walk.first;
    }
    return step;
}
