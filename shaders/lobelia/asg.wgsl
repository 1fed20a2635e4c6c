// Anisotropic spherical Gaussians (ASG), max(w.axis, 0) exp(-eta_x (w.tangent)^2 - eta_y (w.bitangent)^2), and their products with SGs and ASGs.
// Bandwidths and sharpness are in [0, 1e8]. The twins in `f64`, exact integrals and sources: `crates/lobes/src/asg.rs` and `asg_product.rs`.
#define_import_path lobelia::asg

#import lobelia::math::{PI, erf, erf_mean, safe_normalize}

struct AnisotropicSphericalGaussian {
    // Orthonormal, of either handedness.
    tangent: vec3f,
    bitangent: vec3f,
    axis: vec3f,
    eta_x: f32,
    eta_y: f32,
    // Value at the axis.
    amplitude: f32,
}

// The product of an ASG and an SG of amplitude 1 as a lobe about its true peak.
struct AsgPeak {
    // Unit direction of the peak in the ASG's frame.
    local: vec3f,
    // Logarithm of the value there, without the ASG's cosine.
    log_amplitude: f32,
    // Bandwidths of the tangent Gaussian. Twice the larger is the sharpness of the product where it is sharpest.
    eta_larger: f32,
    eta_smaller: f32,
    // Variance, under the tangent Gaussian, of the cosine to the ASG's axis.
    cosine_variance: f32,
}

// A direction in the lobe's frame: tangent, bitangent, axis.
fn asg_to_local(lobe: AnisotropicSphericalGaussian, direction: vec3f) -> vec3f {
    return vec3f(dot(lobe.tangent, direction), dot(lobe.bitangent, direction), dot(lobe.axis, direction));
}

// Value of a lobe of amplitude 1 in a direction of its frame. Relative error 2e-6 + 3e-7 x for a value of exp(-x).
fn asg_evaluate(eta_x: f32, eta_y: f32, local: vec3f) -> f32 {
    return max(local.z, 0.0) * exp(-eta_x * local.x * local.x - eta_y * local.y * local.y);
}

// Integral over the sphere, accurate: within 1.4 %, exact where both bandwidths are 0 or large. Rounding adds 1e-6. A form of this project.
fn asg_integral(eta_x: f32, eta_y: f32) -> f32 {
    let larger = max(eta_x, eta_y);
    let smaller = min(eta_x, eta_y);
    let half = half_sides(larger, smaller);
    return PI * erf_mean(half.x * sqrt(larger)) * erf_mean(half.y * sqrt(smaller));
}

// Half sides of the rectangle of area pi that stands for the unit disk under a Gaussian, along the larger bandwidth and along the smaller one.
fn half_sides(larger: f32, smaller: f32) -> vec2f {
    let t = larger - smaller;
    let half_y = 0.886226925 + 0.113773075 * t / (t + 4.0);
    return vec2f(0.785398163 / half_y, half_y);
}

// Integral over the sphere, fast: for bandwidths of at least 8 (0.034 %); infinite where one is 0.
fn asg_integral_fast(eta_x: f32, eta_y: f32) -> f32 {
    return PI / (sqrt(eta_x) * sqrt(eta_y));
}

// Where the product of an ASG and an SG is largest on the ASG's hemisphere, and how it curves there: three Newton steps on the Lagrange multiplier that keeps
// the peak on the sphere. An axis below the horizon counts as one in it there. A form of this project.
fn asg_sg_peak(eta_x: f32, eta_y: f32, axis_local: vec3f, sharpness: f32) -> AsgPeak {
    let v = vec3f(axis_local.xy, max(axis_local.z, 1e-6)) * sharpness;
    let lowest = max(v.z, 1e-12);
    let twice = vec3f(2.0 * eta_x, 2.0 * eta_y, 0.0);
    var mu = lowest;
    for (var step = 0; step < 3; step++) {
        let m = twice + mu;
        let w = v / m;
        let n_squared = dot(w, w);
        let slope = dot(w, w / m);
        if slope > 0.0 {
            mu = max(mu + (sqrt(n_squared) - 1.0) * n_squared / slope, lowest);
        }
    }
    let m = twice + mu;
    let local = safe_normalize(v / m, vec3f(0.0, 0.0, 1.0));
    let d = local - axis_local;
    let square = local * local;
    let log_amplitude = -0.5 * sharpness * dot(d, d) - eta_x * square.x - eta_y * square.y;
    let spread = square.x / m.x + square.y / m.y;
    let cosine_variance = spread / max(square.z + mu * spread, 1e-30);
    let scale = max(max(m.x, m.y), m.z);
    let q = m / scale;
    let determinant = q.y * q.z * square.x + q.x * q.z * square.y + q.x * q.y * square.z;
    // 1 - x^2 as y^2 + z^2, which does not cancel at an axis.
    let trace = dot(q, square.yxx + square.zzy);
    let larger = 0.5 * (0.5 * trace + sqrt(max(0.25 * trace * trace - determinant, 0.0)));
    return AsgPeak(local, log_amplitude, scale * larger, scale * (determinant / (4.0 * larger)), cosine_variance);
}

// Integral of an ASG times an SG, both of amplitude 1; the SG's axis is in the ASG's frame. Accurate: within 5 % of the largest value over axes, for bandwidths and
// sharpness in [0, 1e8] and all axes, those below the ASG's horizon too; 2 % from a sharpness of 10 on. Rounding adds 1e-5 + 8e-7 x for a value of exp(-x). A form of
// this project.
fn asg_sg_integral(eta_x: f32, eta_y: f32, axis_local: vec3f, sharpness: f32) -> f32 {
    return asg_sg_integral_of_peak(eta_x, eta_y, axis_local, sharpness, asg_sg_peak(eta_x, eta_y, axis_local, sharpness));
}

// The same for callers that have the peak of the same lobes: a broad SG over the disk, a narrow one about the peak, a blend between sharpnesses of 4 and 8.
fn asg_sg_integral_of_peak(eta_x: f32, eta_y: f32, axis_local: vec3f, sharpness: f32, peak: AsgPeak) -> f32 {
    let t = clamp(0.25 * (sharpness - 4.0), 0.0, 1.0);
    let share = t * t * (3.0 - 2.0 * t);
    var integral = 0.0;
    if share > 0.0 {
        integral = share * asg_sg_integral_about_peak(axis_local, sharpness, peak);
    }
    if share < 1.0 {
        integral += (1.0 - share) * asg_sg_integral_over_disk(eta_x, eta_y, axis_local, sharpness);
    }
    return integral;
}

// For an SG of sharpness 4 and above: the tangent Gaussian at the peak, times the mean of the ASG's clamped cosine under it, and what the sphere's curvature takes.
fn asg_sg_integral_about_peak(axis_local: vec3f, sharpness: f32, peak: AsgPeak) -> f32 {
    // An axis below the horizon makes the lobe fall off from there.
    let slope = max(-sharpness * axis_local.z, 0.0) * sqrt(peak.cosine_variance);
    let fall = 1.0 + 1.2533 * slope + slope * slope;
    let z = peak.local.z;
    let cosine = 0.5 * (z + sqrt(z * z + 0.636619772 * peak.cosine_variance / (fall * fall)));
    let eta = max(vec2f(peak.eta_larger, peak.eta_smaller), vec2f(1e-10));
    let within = 1.0 - exp(-eta);
    let variance = 0.5 / eta * max(within * within, vec2f(0.5));
    let pull = max(sharpness * dot(axis_local, peak.local), 0.0);
    let curvature = 1.0 + pull / 8.0 * (3.0 * dot(variance, variance) + 2.0 * variance.x * variance.y);
    return cosine / curvature * exp(peak.log_amplitude) * asg_integral(peak.eta_larger, peak.eta_smaller);
}

// About the variance of a coordinate within the unit disk under a Gaussian of bandwidth c.
fn disk_variance(c: vec2f) -> vec2f {
    return 1.0 / (2.0 * c + 3.5808);
}

// For an SG of a sharpness up to 8: projected along the ASG's axis, which takes the cosine away; the root in the exponent is its tangent in r^2 at the mean of r^2,
// the disk a rectangle, and where the lobe is round the slope goes to one side of it.
fn asg_sg_integral_over_disk(eta_x: f32, eta_y: f32, axis_local: vec3f, sharpness: f32) -> f32 {
    let height = sharpness * axis_local.z;
    let slopes = sharpness * abs(axis_local.xy);
    let eta = vec2f(eta_x, eta_y);
    let smaller = min(eta_x, eta_y);
    var bend = 0.7;
    var at = 0.0;
    for (var step = 0; step < 2; step++) {
        let v = disk_variance(max(eta + height * bend, vec2f(0.0)));
        let mean = 0.76722 * slopes * v;
        let square = mean * mean * inverseSqrt(1.0 + mean * mean * mean * mean);
        let sum = v * (1.0 - square) + square;
        at = min(sum.x + sum.y, 0.71197);
        bend = 0.5 * inverseSqrt(1.0 - at);
    }
    if smaller + height * bend < 0.0 {
        // A Gaussian that grows outwards is taken for a constant.
        bend = smaller / max(-height, 1e-30);
    }
    let root = sqrt(1.0 - at) + bend * at - at * (0.025404 + 0.13777 * at);
    let c = max(eta + height * bend, vec2f(0.0));
    let difference = 1.4251 * (c.x - c.y);
    let round_share = 1.0 / (1.0 + difference * difference);
    let v = disk_variance(c);
    let p = slopes * slopes * v;
    let kept = 1.0 - round_share;
    let turned = select(vec2f(kept * p.x, p.y + round_share * p.x), vec2f(p.x + round_share * p.y, kept * p.y), p.x >= p.y);
    let slope = sqrt(turned / v);
    let half = half_sides(max(c.x, c.y), min(c.x, c.y));
    let sides = select(half.yx, half, c.x >= c.y);
    return exp(height * root - sharpness) * bounded_gaussian(c.x, slope.x, sides.x) * bounded_gaussian(c.y, slope.y, sides.y);
}

// One node of both halves of `bounded_gaussian`.
fn gaussian_pair(eta: f32, slope: f32, x: f32) -> f32 {
    let square = eta * x * x;
    return exp(slope * x - square) + exp(-slope * x - square);
}

// Integral of exp(slope x - eta x^2) over [-half, half], for eta >= 0 and slopes of 0 to 9: four Gauss-Legendre nodes on either side for a broad Gaussian, else error
// functions.
fn bounded_gaussian(eta: f32, slope: f32, half: f32) -> f32 {
    if eta * half * half < 3.0 {
        let outer = gaussian_pair(eta, slope, 0.069431844 * half) + gaussian_pair(eta, slope, 0.930568156 * half);
        let inner = gaussian_pair(eta, slope, 0.330009478 * half) + gaussian_pair(eta, slope, 0.669990522 * half);
        return half * (0.173927423 * outer + 0.326072577 * inner);
    }
    let root = sqrt(eta);
    let shift = 0.5 * slope / root;
    return 0.886226925 / root * exp(shift * shift) * (erf(root * half - shift) + erf(root * half + shift));
}

// The same integral as Xu et al. 2013 print it: within 5.4 % for a sharpness of at least 10 and bandwidths of at least 1, wrong for broad SGs. Where bandwidths and
// sharpness are all near 0 the quotients are kept finite.
fn asg_sg_integral_printed(eta_x: f32, eta_y: f32, axis_local: vec3f, sharpness: f32) -> f32 {
    let nu = 0.5 * sharpness;
    let x = max(eta_x + nu, 1e-20);
    let y = max(eta_y + nu, 1e-20);
    let exponent = nu * (eta_x / x) * axis_local.x * axis_local.x + nu * (eta_y / y) * axis_local.y * axis_local.y;
    return PI / (sqrt(x) * sqrt(y)) * max(axis_local.z, 0.0) * exp(-exponent);
}

struct SymmetricEigen {
    // Largest first.
    values: vec3f,
    // Unit eigenvectors as columns, in the same order.
    vectors: mat3x3f,
}

// One Jacobi rotation of the rows and columns p and q of a symmetric matrix; r is the third. `off` is the entry between p and q.
struct JacobiRotation {
    cosine: f32,
    sine: f32,
    // What the rotation moves from one diagonal entry to the other.
    shift: f32,
}

fn jacobi_rotation(diagonal_p: f32, diagonal_q: f32, off: f32) -> JacobiRotation {
    if off == 0.0 {
        return JacobiRotation(1.0, 0.0, 0.0);
    }
    let difference = 0.5 * (diagonal_q - diagonal_p);
    // tan = 1 / (theta + sign(theta) sqrt(theta^2 + 1)) with theta = difference / off; written without the quotient, which may overflow.
    let tangent = off / (abs(difference) + sqrt(difference * difference + off * off)) * select(-1.0, 1.0, difference >= 0.0);
    let cosine = inverseSqrt(tangent * tangent + 1.0);
    return JacobiRotation(cosine, tangent * cosine, tangent * off);
}

// Eigenvalues and eigenvectors of the symmetric matrix with the given diagonal and off-diagonal entries (yz, xz, xy), by five sweeps of Jacobi
// rotations. Error 1e-6 of the largest eigenvalue. Entries up to 1e18.
fn symmetric_eigen(diagonal: vec3f, off_diagonal: vec3f) -> SymmetricEigen {
    var d = diagonal;
    var o = off_diagonal;
    var x = vec3f(1.0, 0.0, 0.0);
    var y = vec3f(0.0, 1.0, 0.0);
    var z = vec3f(0.0, 0.0, 1.0);
    for (var sweep = 0; sweep < 5; sweep++) {
        let xy = jacobi_rotation(d.x, d.y, o.z);
        d = vec3f(d.x - xy.shift, d.y + xy.shift, d.z);
        o = vec3f(xy.sine * o.y + xy.cosine * o.x, xy.cosine * o.y - xy.sine * o.x, 0.0);
        let turned_x = xy.cosine * x - xy.sine * y;
        y = xy.sine * x + xy.cosine * y;
        x = turned_x;
        let xz = jacobi_rotation(d.x, d.z, o.y);
        d = vec3f(d.x - xz.shift, d.y, d.z + xz.shift);
        o = vec3f(xz.sine * o.z + xz.cosine * o.x, 0.0, xz.cosine * o.z - xz.sine * o.x);
        let turned_again = xz.cosine * x - xz.sine * z;
        z = xz.sine * x + xz.cosine * z;
        x = turned_again;
        let yz = jacobi_rotation(d.y, d.z, o.x);
        d = vec3f(d.x, d.y - yz.shift, d.z + yz.shift);
        o = vec3f(0.0, yz.sine * o.z + yz.cosine * o.y, yz.cosine * o.z - yz.sine * o.y);
        let turned_y = yz.cosine * y - yz.sine * z;
        z = yz.sine * y + yz.cosine * z;
        y = turned_y;
    }
    if d.x < d.y {
        d = d.yxz;
        let swap = x;
        x = y;
        y = swap;
    }
    if d.y < d.z {
        d = d.xzy;
        let swap = y;
        y = z;
        z = swap;
    }
    if d.x < d.y {
        d = d.yxz;
        let swap = x;
        x = y;
        y = swap;
    }
    return SymmetricEigen(d, mat3x3f(x, y, z));
}

// The product of two ASGs as one lobe; its amplitude is a logarithm.
struct AsgProduct {
    lobe: AnisotropicSphericalGaussian,
    log_amplitude: f32,
}

// Product of two ASGs (Xu et al. 2013, section 4), the cosines of both taken at the new axis. As an integral within 10 % for bandwidths around 10, 1 %
// above 100; half wrong around 1. The logarithm is -69 or less where the axis is below a factor's horizon.
fn asg_product(a: AnisotropicSphericalGaussian, b: AnisotropicSphericalGaussian) -> AsgProduct {
    let diagonal = a.eta_x * a.tangent * a.tangent + a.eta_y * a.bitangent * a.bitangent + b.eta_x * b.tangent * b.tangent + b.eta_y * b.bitangent * b.bitangent;
    let off_diagonal = a.eta_x * a.tangent.yxx * a.tangent.zzy + a.eta_y * a.bitangent.yxx * a.bitangent.zzy + b.eta_x * b.tangent.yxx * b.tangent.zzy + b.eta_y * b.bitangent.yxx * b.bitangent.zzy;
    let eigen = symmetric_eigen(diagonal, off_diagonal);
    var axis = safe_normalize(eigen.vectors[2], a.axis);
    axis = select(axis, -axis, dot(axis, a.axis + b.axis) < 0.0);
    let local_a = asg_to_local(a, axis);
    let local_b = asg_to_local(b, axis);
    // The exponent at the axis is the smallest eigenvalue, but has digits that the eigenvalue has lost to the largest one.
    let exponent = a.eta_x * local_a.x * local_a.x + a.eta_y * local_a.y * local_a.y + b.eta_x * local_b.x * local_b.x + b.eta_y * local_b.y * local_b.y;
    let height = a.amplitude * b.amplitude * max(local_a.z, 0.0) * max(local_b.z, 0.0);
    let eta = max(eigen.values.xy - eigen.values.z, vec2f(0.0));
    let lobe = AnisotropicSphericalGaussian(eigen.vectors[0], eigen.vectors[1], axis, eta.x, eta.y, 1.0);
    return AsgProduct(lobe, log(max(height, 1e-30)) - exponent);
}

// Integral of the product of two ASGs; below 1e-29 counts as 0.
fn asg_asg_integral(a: AnisotropicSphericalGaussian, b: AnisotropicSphericalGaussian) -> f32 {
    let product = asg_product(a, b);
    return exp(product.log_amplitude) * asg_integral(product.lobe.eta_x, product.lobe.eta_y);
}
