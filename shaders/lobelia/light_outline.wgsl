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

fn rim_point(rim: Rim, f: f32) -> vec3f {
    return rim.center + rim.axis_a * cos(f) + rim.axis_b * sin(f);
}

// The part of a rim above the horizon: first and last angle, and whether that is all of it. None where they are equal.
struct VisibleRim {
    start: f32,
    end: f32,
    whole: bool,
}

fn visible_rim(rim: Rim) -> VisibleRim {
    // Height is center.z + reach cos(f - middle).
    let reach = length(vec2f(rim.axis_a.z, rim.axis_b.z));
    let middle = atan2(rim.axis_b.z, rim.axis_a.z);
    if rim.center.z >= reach {
        return VisibleRim(middle - 3.14159265, middle + 3.14159265, true);
    }
    // The language allows `acos` an error of 7e-5.
    let half = atan2(sqrt(max((reach - rim.center.z) * (reach + rim.center.z), 0.0)), -rim.center.z);
    return VisibleRim(middle - half, middle + half, false);
}

// Corner of the regular polygon of `sides` corners that has the rim's area: an inscribed one loses light, 2.6 % of it with sixteen corners.
fn rim_corner(rim: Rim, corner: u32, sides: u32) -> vec3f {
    let turn = 6.28318531 / f32(sides);
    let f = turn * f32(corner);
    let scale = sqrt(turn / sin(turn));
    return rim.center + (rim.axis_a * cos(f) + rim.axis_b * sin(f)) * scale;
}

// The quad that stands for a rim and turns with the mirror direction: its corners are those at f = 0, pi/2, pi and 3 pi/2 of what this returns. `spread` is sqrt(2 / (n + 2)) for a lobe of
// exponent n; at 1 areas are equal. Lecocq et al. 2017, algorithm 3 with its errata; an error of 10 to 25 % in the lobe.
fn spinning_quad(rim: Rim, mirror: vec3f, spread: f32) -> Rim {
    // Coordinates in which the rim is the unit circle, up to a factor.
    let normal = cross(rim.axis_a, rim.axis_b);
    let third = normal * inverseSqrt(max(length(normal), 1e-30));
    let to_x = cross(rim.axis_b, third);
    let to_y = cross(third, rim.axis_a);
    let point = -vec3f(dot(rim.center, to_x), dot(rim.center, to_y), dot(rim.center, normal));
    let ray = vec3f(dot(mirror, to_x), dot(mirror, to_y), dot(mirror, normal));
    let blend = spread * abs(point.z) / max(length(point), 1e-30);
    let size = 1.0 - blend + blend * 1.25331414;
    // (1 - spread) times where the ray meets the plane plus spread times the foot of the point, scaled so that a ray that misses gives its own direction.
    let towards = max(-ray.z * sign(point.z), 0.0);
    let direction = safe_normalize(vec3f(point.xy * towards + ray.xy * ((1.0 - spread) * abs(point.z)), 0.0), vec3f(1.0, 0.0, 0.0));
    let first = rim.axis_a * direction.x + rim.axis_b * direction.y;
    let second = rim.axis_b * direction.x - rim.axis_a * direction.y;
    return Rim(rim.center, first * size, second * size);
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

// A straight line; both ends are one point where there is none.
struct OutlineLine {
    start: vec3f,
    to: vec3f,
}

// The walk along an outline that leaves out what is below the horizon: every edge gives the line of it that is above, and may leave one along the horizon, over which the
// outline was away, to be taken next. Lines come one at a time, so that what is done with them stands in one place. No corners are stored, so an outline has as many as it
// likes, and need not be convex: lines of the horizon that are walked both ways cancel. Begin with all zero:
//
//     while index < count || walk.waits {
//         var line: OutlineLine;
//         if walk.waits {
//             line = take_horizon(&walk);
//         } else {
//             line = walk_outline(&walk, corner(index - 1), corner(index), index + 1 == count);
//             index += 1;
//         }
//         add(line);
//     }
struct OutlineWalk {
    // Where the outline first came up, if it began below.
    first: vec3f,
    began_below: bool,
    // Where it last went down.
    last: vec3f,
    is_below: bool,
    // Where the line of the horizon from `last` ends, if one waits.
    horizon: vec3f,
    waits: bool,
}

fn take_horizon(walk: ptr<function, OutlineWalk>) -> OutlineLine {
    (*walk).waits = false;
    return OutlineLine((*walk).last, (*walk).horizon);
}

// `closes`: this is the last edge.
fn walk_outline(walk: ptr<function, OutlineWalk>, start: vec3f, to: vec3f, closes: bool) -> OutlineLine {
    let starts = start.z > 0.0;
    let ends = to.z > 0.0;
    var line: OutlineLine;
    if starts && ends {
        line = OutlineLine(start, to);
    } else if starts {
        line = OutlineLine(start, horizon_crossing(start, to));
        (*walk).last = line.to;
        (*walk).is_below = true;
    } else if ends {
        line = OutlineLine(horizon_crossing(start, to), to);
        if (*walk).is_below {
            (*walk).horizon = line.start;
            (*walk).waits = true;
            (*walk).is_below = false;
        } else {
            (*walk).first = line.start;
            (*walk).began_below = true;
        }
    }
    if closes && (*walk).began_below && (*walk).is_below {
        (*walk).horizon = (*walk).first;
        (*walk).waits = true;
    }
    return line;
}
