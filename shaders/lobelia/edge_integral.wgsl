// What an edge of a light adds to the integral of a cosine lobe, at a cost that does not depend on the exponent.
//
// Along an edge the cosine to the lobe's axis is z = c cos phi, phi counted from the point of the edge's great circle nearest to the axis, c^2 + s^2 = 1 with
// s the distance of the axis from that circle's plane. With N = n + 1 and the azimuth theta about the axis, J = integral of z^N d theta. The
// twin in `f64`: `crates/lobes/src/area_light/edge_models.rs`, with the errors of each model.
//
// Flags: EDGE_PEAK for the models of Lecocq et al. 2017, corrected: a Lorentzian with a Pearson VII peak, or with EDGE_LORENTZIAN alone, or
// with EDGE_ELLIPSOID the ellipsoid and its square. Without, Owen's T function by three nodes, EDGE_NODES_TWO or EDGE_NODES_FOUR.
#define_import_path lobelia::edge_integral

#import lobelia::math::{erf, erfc, exp_minus_one, log_one_plus}

const HALF_PI: f32 = 1.57079632679;

// Of n + 1; below, the integrand is integrated as it is.
#ifdef EDGE_PEAK
const LEAST_ORDER: f32 = 3.0;
#else
const LEAST_ORDER: f32 = 7.0;
#endif

// -log(1 - x^2) for x in [0, 1], at most 32: what the logarithm of a cosine is, given the sine.
fn bend(x: f32) -> f32 {
    return min(-log_one_plus(-min(x * x, 0.99999994)), 32.0);
}

// Azimuth about the axis, in [-pi/2, pi/2].
fn edge_azimuth(s: f32, phi: f32) -> f32 {
    return atan2(sin(phi), s * max(cos(phi), 0.0));
}

// (1 - z^N) / (1 - z^2) at z = c cos phi; N / 2 at z = 1.
fn peak_integrand(s: f32, phi: f32, order: f32) -> f32 {
    let sine = sin(phi);
    let versine = min(s * s + (1.0 - s * s) * sine * sine, 1.0);
    let log_z_squared = log_one_plus(-min(versine, 0.99999994));
    if versine * order < 1e-6 {
        return 0.5 * order;
    }
    return -exp_minus_one(0.5 * order * log_z_squared) / versine;
}

// Integral of s times `peak_integrand` over [low, high] by six Gauss-Legendre nodes: for exponents below 6.
fn edge_by_nodes(s: f32, low: f32, high: f32, order: f32) -> f32 {
    let middle = 0.5 * (low + high);
    let half_width = 0.5 * (high - low);
    let a = 0.932469514 * half_width;
    let b = 0.661209386 * half_width;
    let c = 0.238619186 * half_width;
    let sum = 0.171324492 * (peak_integrand(s, middle - a, order) + peak_integrand(s, middle + a, order))
        + 0.360761573 * (peak_integrand(s, middle - b, order) + peak_integrand(s, middle + b, order))
        + 0.467913935 * (peak_integrand(s, middle - c, order) + peak_integrand(s, middle + c, order));
    return s * half_width * sum;
}

// Integral of e^(-h^2 (1 + x^2) / 2) / (1 + x^2) over [0, a].
fn owen_quadrature(h_squared: f32, a: f32) -> f32 {
    return a * owen_nodes(h_squared, a);
}

fn owen_node(h_squared: f32, x: f32) -> f32 {
    let y = 1.0 + x * x;
    return exp(-0.5 * h_squared * y) / y;
}

fn owen_nodes(h_squared: f32, a: f32) -> f32 {
#ifdef EDGE_NODES_TWO
    return 0.5 * (owen_node(h_squared, 0.211324865 * a) + owen_node(h_squared, 0.788675135 * a));
#else
#ifdef EDGE_NODES_FOUR
    return 0.173927423 * (owen_node(h_squared, 0.0694318442 * a) + owen_node(h_squared, 0.930568156 * a))
        + 0.326072577 * (owen_node(h_squared, 0.330009478 * a) + owen_node(h_squared, 0.669990522 * a));
#else
    return 0.277777778 * (owen_node(h_squared, 0.112701665 * a) + owen_node(h_squared, 0.887298335 * a)) + 0.444444444 * owen_node(h_squared, 0.5 * a);
#endif
#endif
}

// What both ends of an edge share.
struct OwenEdge {
    order: f32,
    s: f32,
    sigma: f32,
    h_squared: f32,
    // erfc(h / sqrt 2).
    tail: f32,
    power: f32,
    k: f32,
    correction: f32,
}

fn owen_edge(s: f32, order: f32) -> OwenEdge {
    var edge: OwenEdge;
    edge.order = order;
    edge.s = s;
    edge.sigma = bend(s);
    edge.h_squared = order * edge.sigma;
    edge.tail = erfc(sqrt(0.5 * edge.h_squared));
    edge.power = exp(-0.5 * edge.h_squared);
    let root = sqrt(edge.sigma);
    edge.k = select(1.0 / max(s, 1e-20) - 1.0 / max(root, 1e-20), s * (0.25 + edge.sigma * 0.0729166667), edge.sigma < 0.02);
    edge.correction = s * (1.0 + 0.75 * edge.sigma) / (32.0 * order);
    return edge;
}

// J from the foot to phi in [0, pi/2]: its uniform expansion for large N, of error O(1/N^2), by Owen's T function.
fn owen_end(edge: OwenEdge, phi: f32) -> f32 {
    let square = bend(sin(phi));
    let y = sqrt(square);
    let a = y / max(sqrt(edge.sigma), 1e-18);
    let own_tail = erfc(sqrt(0.5 * edge.order) * y);
    var owen: f32;
    if a <= 1.0 {
        owen = owen_quadrature(edge.h_squared, a);
    } else {
        owen = HALF_PI * (edge.tail + own_tail - edge.tail * own_tail) - owen_quadrature(edge.order * square, 1.0 / a);
    }
    let e = sqrt(HALF_PI / edge.order) * (1.0 - own_tail);
    return owen + edge.power * (edge.k * e - edge.correction * (e - y * exp(-0.5 * edge.order * square)));
}

// A peak function, 1 at 0.
struct Peak {
    // Value at pi/2, and at a test point.
    least: f32,
    test: f32,
    // Integral.
    area: f32,
}

#ifdef EDGE_ELLIPSOID
fn ellipsoid_turn(a: f32, low: f32, high: f32) -> f32 {
    return atan2(sqrt(a) * sin(high - low), a * cos(low) * cos(high) + sin(low) * sin(high));
}

// a / (1 + (a-1) cos^2 phi), 1 at 0.
fn first_peak(a: f32, x: f32, low: f32, high: f32) -> Peak {
    let cosine = cos(x);
    return Peak(a, a / (1.0 + (a - 1.0) * cosine * cosine), sqrt(a) * ellipsoid_turn(a, low, high));
}

fn second_peak_end(b: f32, phi: f32) -> f32 {
    let cosine = cos(phi);
    return b * (b - 1.0) * sin(2.0 * phi) / (4.0 * (1.0 + (b - 1.0) * cosine * cosine));
}

// Its square, with b.
fn second_peak(b: f32, x: f32, low: f32, high: f32) -> Peak {
    let cosine = cos(x);
    let value = b / (1.0 + (b - 1.0) * cosine * cosine);
    let area = 0.5 * sqrt(b) * (b + 1.0) * ellipsoid_turn(b, low, high) - second_peak_end(b, high) + second_peak_end(b, low);
    return Peak(b * b, value * value, area);
}
#else
// 1 / (1 + a phi^2).
fn first_peak(a: f32, x: f32, low: f32, high: f32) -> Peak {
    let root = sqrt(a);
    return Peak(1.0 / (1.0 + a * HALF_PI * HALF_PI), 1.0 / (1.0 + a * x * x), (atan(root * high) - atan(root * low)) / root);
}

fn second_peak_end(b: f32, phi: f32) -> f32 {
    let root = sqrt(b);
    return 0.5 * (phi / (1.0 + b * phi * phi) + atan(root * phi) / root);
}

// 1 / (1 + b phi^2)^2.
fn second_peak(b: f32, x: f32, low: f32, high: f32) -> Peak {
    let least = 1.0 / (1.0 + b * HALF_PI * HALF_PI);
    let value = 1.0 / (1.0 + b * x * x);
    return Peak(least * least, value * value, second_peak_end(b, high) - second_peak_end(b, low));
}
#endif

// The integral that `edge_by_nodes` finds, from a peak that is fitted to the integrand's height, width and value at pi/2.
fn edge_by_peak(s: f32, low: f32, high: f32, order: f32) -> f32 {
    let c = sqrt(max((1.0 - s) * (1.0 + s), 0.0));
    let most = peak_integrand(s, 0.0, order);
    if most < 1.0 + 1e-5 {
        return s * (high - low);
    }
    let widest = 0.785398163;
    // 1 less a power of nearly 1, from what is missing to 1.
    let missing = min(s * s / (1.0 + c) + c / max(order - 3.0, 1.0), 0.99999994);
    let relative = pow(max(-exp_minus_one(2.5 * log_one_plus(-missing)), 1e-12), 0.45);
    let half_width = widest * relative;
    let share = clamp((peak_integrand(s, half_width, order) - 1.0) / (most - 1.0), 1e-6, 1.0 - 1e-6);
#ifdef EDGE_ELLIPSOID
    let tangent = tan(half_width);
    // At 1 the peak is gone, and what is left of it rounding noise.
    let a = clamp(tangent * tangent * share / (1.0 - share), 1e-12, 0.99);
    let b = min(a * (2.1 - 1.28 * relative), 0.99);
#else
    let a = max((1.0 - share - 4.0 * half_width * half_width / 9.8696044) / (share * half_width * half_width), 0.04);
    let b = 0.5 * a;
#endif
    let test = half_width + 0.3946 * widest * (1.0 - pow(1.0 - relative, 12.0));
    let first = first_peak(a, test, low, high);
    let scale = (most - 1.0) / (1.0 - first.least);
    let first_area = scale * first.area + (1.0 - scale * first.least) * (high - low);
#ifdef EDGE_LORENTZIAN
    return s * first_area;
#else
    let second = second_peak(b, test, low, high);
    let second_scale = (most - 1.0) / (1.0 - second.least);
    let second_area = second_scale * second.area + (1.0 - second_scale * second.least) * (high - low);
    let first_test = 1.0 + scale * (first.test - first.least);
    let second_test = 1.0 + second_scale * (second.test - second.least);
    let difference = second_test - first_test;
    let blend = clamp((second_test - peak_integrand(s, test, order)) / select(difference, 1e-12, abs(difference) < 1e-12), 0.0, 1.0);
    return s * mix(second_area, first_area, blend);
#endif
}

// J over [low, high] within [-pi/2, pi/2], order = n + 1 > 0. 0 where the edge lies in the plane perpendicular to the axis.
fn edge_j(s: f32, low: f32, high: f32, order: f32) -> f32 {
    if s > 0.99999994 || high <= low {
        return 0.0;
    }
    let turn = edge_azimuth(s, high) - edge_azimuth(s, low);
    // Below there is no peak to fit, or the expansion is not good.
    if order < LEAST_ORDER {
        return turn - edge_by_nodes(s, low, high, order);
    }
#ifdef EDGE_PEAK
    return turn - edge_by_peak(s, low, high, order);
#else
    let edge = owen_edge(s, order);
    return sign(high) * owen_end(edge, abs(high)) - sign(low) * owen_end(edge, abs(low));
#endif
}

// Integral of z^n over [low, high] within [-pi/2, pi/2], n >= 0: what an edge adds to the moment about two axes.
fn edge_power(s: f32, low: f32, high: f32, n: f32) -> f32 {
    return exp(-0.5 * n * bend(s)) * (sign(high) * power_end(abs(high), n) - sign(low) * power_end(abs(low), n));
}

// Integral of cos^n from 0 to phi in [0, pi/2]. Small exponents come from those that are larger by 8: (n+1) I_n = (n+2) I_(n+2) - sin cos^(n+1).
fn power_end(phi: f32, n: f32) -> f32 {
    if n >= 12.0 {
        return power_expansion(phi, n);
    }
    let cosine = max(cos(phi), 0.0);
    let square = cosine * cosine;
    var order = n + 8.0;
    var integral = power_expansion(phi, order);
    var end = sin(phi) * pow(max(cosine, 1e-30), n + 7.0);
    for (var step = 0; step < 4; step++) {
        integral = (order * integral - end) / (order - 1.0);
        order -= 2.0;
        end /= max(square, 1e-12);
    }
    return integral;
}

// The same in powers of 1/n: relative error 4e-5 at n = 10, 3e-7 at 50.
fn power_expansion(phi: f32, n: f32) -> f32 {
    let square = bend(sin(phi));
    let y = sqrt(square);
    let e = exp(-0.5 * n * square);
    let zeroth = sqrt(HALF_PI / n) * erf(sqrt(0.5 * n) * y);
    let second = (zeroth - y * e) / n;
    let fourth = (3.0 * second - y * square * e) / n;
    return zeroth - 0.25 * second + fourth / 96.0;
}
