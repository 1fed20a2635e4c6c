// Cosine lobes integrated over the solid angle of an outline, along the outline.
//
// Polar integration about the lobe's axis turns (n+1) times the integral of max(u.r, 0)^n into W less the sum of J over the edges (`lobelia::edge_integral`): J is
// the integral of z^(n+1) over the azimuth about the axis, W is 2 pi if the axis lies inside the outline, else 0. The light need not be cut
// at the lobe's own horizon: J is 0 there and beyond. Both know on which side of an edge the axis is by the same number, so they jump together. That there is
// nothing to cut, and so no corner to store, is a design of this project.
#define_import_path lobelia::axial_moment

#import lobelia::edge_integral::{edge_j, edge_power}
#import lobelia::light_outline::GreatArc

struct AxialMoment {
    // Sum of J with signs.
    sum: f32,
    // Azimuth that the outline walks about the axis.
    walked: f32,
    // Integral of z^n along the edges, times their normals: for the moment about two axes.
    vector: vec3f,
}

// An edge as the lobe sees it.
struct LobeEdge {
    s: f32,
    // Part of the edge before the lobe's horizon.
    low: f32,
    high: f32,
    // +1 where the axis is on the inner side.
    sign: f32,
    walked: f32,
    normal: vec3f,
}

fn lobe_edge(arc: GreatArc, axis: vec3f) -> LobeEdge {
    var edge: LobeEdge;
    edge.normal = cross(arc.start, arc.tangent);
    let along = dot(arc.start, axis);
    let across = dot(arc.tangent, axis);
    let side = dot(edge.normal, axis);
    edge.sign = select(1.0, -1.0, side > 0.0);
    // An axis on the edge is on its inner side; azimuth and J then see the same thing.
    edge.s = clamp(abs(side), 1e-7, 1.0);
    var low = -atan2(across, along);
    var high = low + arc.length;
    if high > 4.71238898 {
        low -= 6.28318531;
        high -= 6.28318531;
    }
    edge.low = clamp(low, -1.57079633, 1.57079633);
    edge.high = clamp(high, -1.57079633, 1.57079633);
    let towards = vec2f(cos(low), sin(low));
    let away = vec2f(cos(high), sin(high));
    edge.walked = edge.sign * atan2(edge.s * sin(arc.length), towards.y * away.y + edge.s * edge.s * towards.x * away.x);
    return edge;
}

// Adds an edge to the moment of order n.
fn add_moment_edge(moment: ptr<function, AxialMoment>, arc: GreatArc, axis: vec3f, n: f32) {
    if arc.length <= 0.0 {
        return;
    }
    let edge = lobe_edge(arc, axis);
    (*moment).walked += edge.walked;
    if edge.high > edge.low {
        (*moment).sum += edge.sign * edge_j(edge.s, edge.low, edge.high, n + 1.0);
    }
}

// Adds an edge to what the moment about two axes takes beside that of order n + 1.
fn add_power_edge(moment: ptr<function, AxialMoment>, arc: GreatArc, axis: vec3f, n: f32) {
    if arc.length <= 0.0 {
        return;
    }
    let edge = lobe_edge(arc, axis);
    if edge.high > edge.low {
        (*moment).vector += edge.normal * edge_power(edge.s, edge.low, edge.high, n);
    }
}

// (n+1) / (2 pi) times the moment: the share of the lobe that the light fills, 0 to 1 and a few millionths.
fn lobe_fraction(moment: AxialMoment) -> f32 {
    // Once around the axis, not at all, or around the opposite direction; in between only with the axis on a corner.
    let turns = moment.walked * 0.159154943;
    let whole = round(turns);
    let inside = select(turns, max(whole, 0.0), abs(turns - whole) < 1e-4);
    return max(inside - moment.sum * 0.159154943, 0.0);
}

// Integral of max(u.axis, 0)^n (u.w) from the moment of order n + 1 and the sum of `add_power_edge` for n. Exact but for the edges (Lecocq et al. 2017 take one
// lobe for the product).
fn two_axis_moment(moment: AxialMoment, axis: vec3f, w: vec3f, n: f32) -> f32 {
    let across = w - axis * dot(w, axis);
    return max((dot(w, axis) * lobe_fraction(moment) * 6.28318531 - dot(moment.vector, across)) / (n + 2.0), 0.0);
}
