// The radius of every virtual spherical light: the distance to its k-th nearest neighbour, so that the disk it stands for holds k lights.
//
// One invocation a light, which looks at all others; lights are shared by a workgroup 64 at a time.

#import lobelia::virtual_lights::VirtualLight

struct Settings {
    light_count: u32,
    interleave: u32,
    visibility_interleaved: u32,
    samples: u32,
    least_distance_squared: f32,
    radius_scale: f32,
    neighbours: u32,
    // 1: a light's own radius counts, where it has one.
    given: u32,
    seed: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

struct Range {
    first_word: u32,
    end_word: u32,
    chunk_word: u32,
    first: u32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<uniform> range: Range;
@group(0) @binding(2) var<storage, read> virtual_lights: array<VirtualLight>;
@group(0) @binding(3) var<storage, read_write> radii: array<f32>;

const MOST_NEIGHBOURS: u32 = 32u;
const FAR: f32 = 3e38;

// Position, and 1 where the light shines.
var<workgroup> others: array<vec4f, 64>;

@compute @workgroup_size(64)
fn nearest(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let index = (range.first_word + group.x) * 64u + local;
    let own = virtual_lights[min(index, settings.light_count - 1u)];
    // Squared distances to the nearest so far, in rising order.
    var found: array<f32, 32>;
    for (var k = 0u; k < MOST_NEIGHBOURS; k++) {
        found[k] = FAR;
    }
    for (var base = 0u; base < settings.light_count; base += 64u) {
        workgroupBarrier();
        var other = vec4f(0.0);
        if base + local < settings.light_count {
            let light = virtual_lights[base + local];
            other = vec4f(light.position, select(0.0, 1.0, any(light.flux > vec3f(0.0))));
        }
        others[local] = other;
        workgroupBarrier();
        for (var slot = 0u; slot < 64u; slot++) {
            let candidate = others[slot];
            let offset = candidate.xyz - own.position;
            var squared = min(dot(offset, offset), 0.5 * FAR);
            if candidate.w == 1.0 && base + slot != index && squared < found[settings.neighbours - 1u] {
                for (var k = 0u; k < settings.neighbours; k++) {
                    let smaller = min(found[k], squared);
                    squared = max(found[k], squared);
                    found[k] = smaller;
                }
            }
        }
    }
    if index < settings.light_count {
        var radius = 0.0;
        for (var k = 0u; k < settings.neighbours; k++) {
            if found[k] < FAR {
                // Fewer lights than neighbours: as though they went on as densely.
                radius = sqrt(found[k] * f32(settings.neighbours) / f32(k + 1u));
            }
        }
        if settings.given == 1u && own.radius > 0.0 {
            radius = own.radius;
        }
        radii[index] = clamp(radius * settings.radius_scale, 0.0, 1e15);
    }
}
