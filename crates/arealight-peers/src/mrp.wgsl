
#import lobelia::brdf::evaluate_specular

#ifdef SPECULAR
// The point of a segment that is nearest to another.
fn nearest_on_segment(start: vec3f, to: vec3f, at: vec3f) -> vec3f {
    let along = to - start;
    return start + along * clamp(dot(at - start, along) / max(dot(along, along), 1e-30), 0.0, 1.0);
}

// A point light in place of the light: at `point`, of the light's radiance times `solid_angle`, for a lobe that is as wide as `radius` at its distance makes it.
fn representative(brdf: Brdf, frame: SurfaceFrame, point: vec3f, solid_angle: f32, radius: f32) -> vec3f {
    let distance = length(point);
    let direction = point / max(distance, 1e-20);
    if !(direction.z > 0.0) {
        return vec3f(0.0);
    }
    let wide = clamp(brdf.alpha + 0.5 * radius / max(distance, 1e-20), 0.0, 1.0);
    let normalization = (brdf.alpha / wide) * (brdf.alpha / wide);
    let f = evaluate_specular(brdf, NORMAL, direction, frame.viewer, direction.z, frame.viewer.z);
    return f * (normalization * direction.z * solid_angle);
}
#endif

fn light_from(index: u32, brdf: Brdf, frame: SurfaceFrame, pixel: vec2u) -> vec3f {
    let outline = area_light_outline(lights[index], frame, SIDES);
    if outline.count < 3u {
        return vec3f(0.0);
    }
    let last = corner(outline, frame, outline.count - 1u);
    var previous = last;
    let first = corner(outline, frame, 0u);
    // Twice the area, as a vector away from the surface.
    var area = vec3f(0.0);
    for (var place = 0u; place < outline.count; place++) {
        let next = corner(outline, frame, place);
        area -= cross(previous - first, next - first);
        previous = next;
    }
    var sent = brdf.diffuse * mapped_irradiance(outline, frame, NO_MAP);
#ifdef SPECULAR
    let size = 0.5 * length(area);
    let facing = area / max(2.0 * size, 1e-30);
    let ray = vec3f(-frame.viewer.x, 0.0, frame.viewer.z);
    // Where the mirror ray meets the light's plane; where it does not, a far point in its direction along the plane.
    let descent = dot(ray, facing);
    let height = dot(first, facing);
    let met = select(ray * 1e4 * length(first), ray * (height / max(descent, 1e-6)), descent > 1e-6 && height > 0.0);
    var nearest = first;
    var inside = true;
    previous = last;
    for (var place = 0u; place < outline.count; place++) {
        let next = corner(outline, frame, place);
        let candidate = nearest_on_segment(previous, next, met);
        let offset = candidate - met;
        let best = nearest - met;
        nearest = select(nearest, candidate, dot(offset, offset) < dot(best, best));
        previous = next;
    }
    // A point is inside if the outline walks around it.
    var crossings = 0u;
    let axis_a = normalize(corner(outline, frame, 1u) - first);
    let axis_b = cross(facing, axis_a);
    let target_point = vec2f(dot(met, axis_a), dot(met, axis_b));
    previous = last;
    for (var place = 0u; place < outline.count; place++) {
        let next = corner(outline, frame, place);
        let a = vec2f(dot(previous, axis_a), dot(previous, axis_b)) - target_point;
        let b = vec2f(dot(next, axis_a), dot(next, axis_b)) - target_point;
        if (a.y > 0.0) != (b.y > 0.0) && a.x - a.y * (b.x - a.x) / (b.y - a.y) > 0.0 {
            crossings += 1u;
        }
        previous = next;
    }
    let point = select(nearest, met, crossings % 2u == 1u && descent > 1e-6 && height > 0.0);
    let square = max(dot(point, point), 1e-20);
    let solid_angle = min(size * abs(dot(point, facing)) * inverseSqrt(square) / square, 6.28318531);
    sent += representative(brdf, frame, point, solid_angle, sqrt(size * 0.318309886));
#endif
    return sent;
}
