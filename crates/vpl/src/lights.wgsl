// Picks virtual lights from the texels of reflective shadow maps, in proportion to reflected flux.
//
// Rows of all faces, one below the other, form one table. `sum_rows` turns each row into running sums, `sum_totals` does the same for the rows'
// totals, and `pick` inverts both by binary search with a point of a low-discrepancy sequence.

#import lobelia::brdf::{albedo_estimate, brdf_from_surface}
#import lobelia::math::luminance
#import lobelia::octahedral::octahedral_pack
#import lobelia::reflective_shadow_map::{RsmFace, rsm_direction_to_light, rsm_distance, rsm_flux, rsm_position}
#import lobelia::sampling::r2_point
#import lobelia::scene::PunctualLight
#import lobelia::surface::{PackedSurface, unpack_surface}
#import lobelia::virtual_lights::VirtualLight

struct Settings {
    resolution: u32,
    faces: u32,
    count: u32,
    seed: u32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<storage, read> faces: array<RsmFace>;
@group(0) @binding(2) var<storage, read> lights: array<PunctualLight>;
@group(0) @binding(3) var rsm_depth: texture_depth_2d_array;
@group(0) @binding(4) var rsm_core: texture_2d_array<u32>;
#ifdef SPECULAR
@group(0) @binding(5) var rsm_specular: texture_2d_array<u32>;
#endif
#ifdef NORMAL_MAP
@group(0) @binding(6) var rsm_geometric_normal: texture_2d_array<u32>;
#endif
// Running sums within each row, and of the rows' totals.
@group(0) @binding(7) var<storage, read_write> row_sums: array<f32>;
@group(0) @binding(8) var<storage, read_write> total_sums: array<f32>;
@group(0) @binding(9) var<storage, read_write> virtual_lights: array<VirtualLight>;

var<workgroup> partial: array<f32, 256>;

fn packed_texel(texel: vec2u, face: u32) -> PackedSurface {
    var packed: PackedSurface;
    packed.core = textureLoad(rsm_core, texel, face, 0).xy;
#ifdef SPECULAR
    packed.specular = textureLoad(rsm_specular, texel, face, 0).x;
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(rsm_geometric_normal, texel, face, 0).x;
#endif
    return packed;
}

fn texel_uv(texel: vec2u) -> vec2f {
    return (vec2f(texel) + vec2f(0.5)) / f32(settings.resolution);
}

// Luminance of the flux that a texel reflects, estimated; 0 where nothing is seen.
fn importance(texel: vec2u, face_index: u32) -> f32 {
    let depth = textureLoad(rsm_depth, texel, face_index, 0);
    if depth <= 0.0 {
        return 0.0;
    }
    let face = faces[face_index];
    let uv = texel_uv(texel);
    let flux = rsm_flux(face, lights[face.light], uv, f32(settings.resolution));
    if max(max(flux.x, flux.y), flux.z) <= 0.0 {
        return 0.0;
    }
    let surface = unpack_surface(packed_texel(texel, face_index));
    let to_light = rsm_direction_to_light(face, rsm_position(face, uv, depth));
    // The estimate of the specular albedo may be too low; a hundredth of the lobe's scale on top keeps every reflecting texel in play.
    let albedo = albedo_estimate(brdf_from_surface(surface), max(dot(surface.normal, to_light), 0.0)) + vec3f(0.01 * surface.specular);
    return luminance(flux * albedo);
}

// Sum of the values of all invocations before this one.
fn sum_before(local: u32, value: f32) -> f32 {
    partial[local] = value;
    workgroupBarrier();
    for (var step = 1u; step < 256u; step *= 2u) {
        var before = 0.0;
        if local >= step {
            before = partial[local - step];
        }
        workgroupBarrier();
        partial[local] += before;
        workgroupBarrier();
    }
    return select(0.0, partial[max(local, 1u) - 1u], local > 0u);
}

@compute @workgroup_size(256)
fn sum_rows(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let row = group.y * settings.resolution + group.x;
    let length = (settings.resolution + 255u) / 256u;
    let first = min(local * length, settings.resolution);
    let last = min(first + length, settings.resolution);
    var sum = 0.0;
    for (var x = first; x < last; x++) {
        sum += importance(vec2u(x, group.x), group.y);
        row_sums[row * settings.resolution + x] = sum;
    }
    let before = sum_before(local, sum);
    for (var x = first; x < last; x++) {
        row_sums[row * settings.resolution + x] += before;
    }
    if local == 255u {
        total_sums[row] = partial[255];
    }
}

@compute @workgroup_size(256)
fn sum_totals(@builtin(local_invocation_index) local: u32) {
    let rows = settings.resolution * settings.faces;
    let length = (rows + 255u) / 256u;
    let first = min(local * length, rows);
    let last = min(first + length, rows);
    var sum = 0.0;
    for (var row = first; row < last; row++) {
        sum += total_sums[row];
        total_sums[row] = sum;
    }
    let before = sum_before(local, sum);
    for (var row = first; row < last; row++) {
        total_sums[row] += before;
    }
}

// First row whose running total exceeds `target_sum`.
fn find_row(target_sum: f32, rows: u32) -> u32 {
    var low = 0u;
    var high = rows - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if total_sums[middle] > target_sum {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

fn find_column(target_sum: f32, row: u32) -> u32 {
    let start = row * settings.resolution;
    var low = 0u;
    var high = settings.resolution - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if row_sums[start + middle] > target_sum {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

@compute @workgroup_size(64)
fn pick(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= settings.count {
        return;
    }
    var light: VirtualLight;
    light.direction_to_source = vec3f(0.0, 1.0, 0.0);
    light.geometric_normal = octahedral_pack(vec3f(0.0, 1.0, 0.0));
    let rows = settings.resolution * settings.faces;
    let total = total_sums[rows - 1u];
    // Written so that NaN and infinity leave the light dark as well.
    if !(total > 0.0 && total < 3e38) {
        virtual_lights[id.x] = light;
        return;
    }
    let u = r2_point(id.x, settings.seed);
    let row = find_row(u.x * total, rows);
    let start = row * settings.resolution;
    let column = find_column(u.y * row_sums[start + settings.resolution - 1u], row);
    let face_index = row / settings.resolution;
    let texel = vec2u(column, row % settings.resolution);
    let weight = importance(texel, face_index);
    let depth = textureLoad(rsm_depth, texel, face_index, 0);
    if weight <= 0.0 || depth <= 0.0 {
        virtual_lights[id.x] = light;
        return;
    }
    let face = faces[face_index];
    let source = lights[face.light];
    let uv = texel_uv(texel);
    let packed = packed_texel(texel, face_index);
    let surface = unpack_surface(packed);
    // The texel's centre. A place spread over the texel's plane would look less regular, but at the edges of the scene half of such places lie behind
    // the next wall, where no pixel sees them. The lift is the precision to which rasterisers place triangles, 1/256 of a texel: no light may start
    // below its own surface.
    let footprint = 2.0 * length(face.right) / f32(settings.resolution) * select(rsm_distance(face, depth), 1.0, face.depth_range != 0.0);
    light.position = rsm_position(face, uv, depth) + surface.geometric_normal * (footprint / 256.0);
    light.flux = min(rsm_flux(face, source, uv, f32(settings.resolution)) * (total / (f32(settings.count) * weight)), vec3f(1e24));
    light.geometric_normal = octahedral_pack(surface.geometric_normal);
    light.direction_to_source = rsm_direction_to_light(face, light.position);
#ifdef SPECULAR
    light.specular = packed.specular;
#endif
    light.core = packed.core;
    light.source = face.light;
    virtual_lights[id.x] = light;
}
