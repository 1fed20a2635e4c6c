
#import lobelia::anisotropic_ggx::{anisotropic_alphas, anisotropic_ggx_distribution, anisotropic_ggx_visibility}
#import lobelia::area_light::{AREA_LIGHT_DISK, AREA_LIGHT_POLYGON}
#import lobelia::brdf::{evaluate_brdf, fresnel}
#import lobelia::direction_sampling::sample_cone
#import lobelia::sampling::{hash, r2_point, unit_float}

#ifdef POLYGON_LIGHTS
// First triangle and number of triangles of every light; corners as places in `corners`.
@group(0) @binding(11) var<storage, read> ranges: array<vec2u>;
@group(0) @binding(12) var<storage, read> triangles: array<vec4u>;
#endif

// Unit direction and what a sample there counts: 1 over its density, sr.
struct LightSample {
    direction: vec3f,
    weight: f32,
}

#ifdef POLYGON_LIGHTS
struct SphericalTriangle {
    a: vec3f,
    b: vec3f,
    c: vec3f,
    // Corners that are not unit, for triangles too small to have angles.
    far_a: vec3f,
    far_b: vec3f,
    far_c: vec3f,
    solid_angle: f32,
}

// Solid angles below this are sampled by area: the sum of angles less pi has no digits left.
const SMALL: f32 = 1e-3;

fn spherical_triangle(index: u32, frame: SurfaceFrame) -> SphericalTriangle {
    var triangle: SphericalTriangle;
    let place = triangles[index];
    triangle.far_a = to_frame(frame, corners[place.x].xyz - frame.position);
    triangle.far_b = to_frame(frame, corners[place.y].xyz - frame.position);
    triangle.far_c = to_frame(frame, corners[place.z].xyz - frame.position);
    triangle.a = safe_normalize(triangle.far_a, NORMAL);
    triangle.b = safe_normalize(triangle.far_b, NORMAL);
    triangle.c = safe_normalize(triangle.far_c, NORMAL);
    // Van Oosterom and Strackee 1983; the product from differences, which small triangles keep.
    let product = abs(dot(triangle.far_a, cross(triangle.far_b - triangle.far_a, triangle.far_c - triangle.far_a)))
        / max(length(triangle.far_a) * length(triangle.far_b) * length(triangle.far_c), 1e-30);
    let cosines = 1.0 + dot(triangle.a, triangle.b) + dot(triangle.b, triangle.c) + dot(triangle.c, triangle.a);
    triangle.solid_angle = 2.0 * atan2(product, cosines);
    return triangle;
}

// Uniform over the solid angle (Arvo 1995, Stratified Sampling of Spherical Triangles).
fn sample_spherical_triangle(triangle: SphericalTriangle, u: vec2f) -> LightSample {
    if triangle.solid_angle < SMALL {
        let root = sqrt(u.x);
        let at = triangle.far_a * (1.0 - root) + triangle.far_b * (root * (1.0 - u.y)) + triangle.far_c * (root * u.y);
        let square = max(dot(at, at), 1e-30);
        let normal = 0.5 * cross(triangle.far_b - triangle.far_a, triangle.far_c - triangle.far_a);
        return LightSample(at * inverseSqrt(square), abs(dot(normal, at)) * inverseSqrt(square) / square);
    }
    let ab = normalize(cross(triangle.a, triangle.b));
    let ac = normalize(cross(triangle.a, triangle.c));
    let cos_alpha = clamp(dot(ab, ac), -1.0, 1.0);
    let sin_alpha = sqrt(max(1.0 - cos_alpha * cos_alpha, 0.0));
    let phi = u.x * triangle.solid_angle - acos(cos_alpha);
    let s = sin(phi);
    let t = cos(phi);
    let p = t - cos_alpha;
    let v = s + sin_alpha * dot(triangle.a, triangle.b);
    let below = (v * s + p * t) * sin_alpha;
    let q = clamp(((v * t - p * s) * cos_alpha - v) / select(below, 1e-20, abs(below) < 1e-20), -1.0, 1.0);
    let towards_c = safe_normalize(triangle.c - triangle.a * dot(triangle.c, triangle.a), NORMAL);
    let far = triangle.a * q + towards_c * sqrt(max(1.0 - q * q, 0.0));
    let z = 1.0 - u.y * (1.0 - dot(far, triangle.b));
    let side = safe_normalize(far - triangle.b * dot(far, triangle.b), NORMAL);
    return LightSample(safe_normalize(triangle.b * z + side * sqrt(max(1.0 - z * z, 0.0)), NORMAL), triangle.solid_angle);
}

fn sample_polygon(index: u32, frame: SurfaceFrame, total: f32, u: vec2f) -> LightSample {
    let range = ranges[index];
    var place = u.x * total;
    for (var triangle_index = 0u; triangle_index < range.y; triangle_index++) {
        let triangle = spherical_triangle(range.x + triangle_index, frame);
        if place < triangle.solid_angle || triangle_index + 1u == range.y {
            // What is left of the number after the choice is uniform again.
            let rest = clamp(place / max(triangle.solid_angle, 1e-30), 0.0, 0.99999994);
            var sample = sample_spherical_triangle(triangle, vec2f(rest, u.y));
            sample.weight *= total / max(triangle.solid_angle, 1e-30);
            return sample;
        }
        place -= triangle.solid_angle;
    }
    return LightSample(NORMAL, 0.0);
}
#endif

fn sample_round(light: AreaLight, frame: SurfaceFrame, u: vec2f) -> LightSample {
    let center = to_frame(frame, light.center - frame.position);
    let axis_a = to_frame(frame, light.axis_a);
    let axis_b = to_frame(frame, light.axis_b);
    if light.kind == AREA_LIGHT_DISK {
        let turn = 6.28318531 * u.y;
        let at = center + (axis_a * cos(turn) + axis_b * sin(turn)) * sqrt(u.x);
        let square = max(dot(at, at), 1e-30);
        return LightSample(at * inverseSqrt(square), 3.14159265 * abs(dot(cross(axis_a, axis_b), at)) * inverseSqrt(square) / square);
    }
    // Where the light is the unit sphere it fills a cone; what the map makes of a solid angle is its determinant over the cube of a direction's length.
    let axis_c = to_frame(frame, light.axis_c);
    let determinant = dot(axis_a, cross(axis_b, axis_c));
    let unit = vec3f(dot(cross(axis_b, axis_c), center), dot(cross(axis_c, axis_a), center), dot(cross(axis_a, axis_b), center)) / determinant;
    let square = dot(unit, unit);
    let sine_squared = 1.0 / max(square, 1.0);
    let versine = sine_squared / (1.0 + sqrt(1.0 - sine_squared));
    let direction = sample_cone(unit * inverseSqrt(square), versine, u);
    let mapped = axis_a * direction.x + axis_b * direction.y + axis_c * direction.z;
    let size = length(mapped);
    return LightSample(mapped / size, 6.28318531 * versine * abs(determinant) / (size * size * size));
}

// Towards a light and a viewer above the horizon.
fn reflectance(brdf: Brdf, l: vec3f, v: vec3f) -> vec3f {
#ifdef ANISOTROPIC
    let h = safe_normalize(l + v, NORMAL);
    let alphas = anisotropic_alphas(brdf.alpha, settings.anisotropy);
    let lobe = anisotropic_ggx_distribution(alphas, h) * anisotropic_ggx_visibility(alphas, l, v);
    return brdf.diffuse + lobe * fresnel(brdf, clamp(dot(h, v), 0.0, 1.0));
#else
    return evaluate_brdf(brdf, NORMAL, NORMAL, l, v);
#endif
}

fn light_from(index: u32, brdf: Brdf, frame: SurfaceFrame, pixel: vec2u) -> vec3f {
    let light = lights[index];
    let outline = area_light_outline(light, frame, SIDES);
    if outline.count < 3u {
        return vec3f(0.0);
    }
    var total = 0.0;
#ifdef POLYGON_LIGHTS
    if light.kind == AREA_LIGHT_POLYGON {
        let range = ranges[index];
        for (var place = 0u; place < range.y; place++) {
            total += spherical_triangle(range.x + place, frame).solid_angle;
        }
    }
#endif
    let count = max(settings.first, 1u);
    let seed = hash(pixel.x ^ hash(pixel.y ^ hash(index ^ hash(view.frame ^ hash(view.seed + settings.second)))));
    var sum = vec3f(0.0);
    for (var sample_index = 0u; sample_index < count; sample_index++) {
        let u = r2_point(sample_index, seed);
        var sample: LightSample;
#ifdef POLYGON_LIGHTS
        if light.kind == AREA_LIGHT_POLYGON {
            sample = sample_polygon(index, frame, total, u);
        } else {
            sample = sample_round(light, frame, u);
        }
#else
        sample = sample_round(light, frame, u);
#endif
        let cosine = sample.direction.z;
        if cosine > 0.0 && sample.weight > 0.0 {
            sum += min(reflectance(brdf, sample.direction, frame.viewer) * (cosine * sample.weight), vec3f(MAX_FACTOR));
        }
    }
    return sum / f32(count);
}
