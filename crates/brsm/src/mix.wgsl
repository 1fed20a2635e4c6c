// From ratios of contribution to flux per cell to weights of texels: `blur` brings neighbouring cells together and adds up, `add_up` ends the sum, `combine`
// multiplies the flux of every texel.

#import lobelia::sampling_density::{density_place, density_weight, sampling_density_total, storable_weight}

struct Settings {
    // Cells a side of each face: a power of two, at least 8.
    cells: u32,
    // A cell is a texel of this level of the sums of flux.
    level: u32,
    // Share of the lights that flux alone places.
    flux_share: f32,
    // 0: cells stay as they are.
    blur: u32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var flux_sums: texture_2d_array<f32>;
@group(0) @binding(2) var<storage, read> ratios: array<f32>;
@group(0) @binding(3) var<storage, read_write> blurred: array<f32>;
// Of every workgroup: shares of the flux times ratios, and shares.
@group(0) @binding(4) var<storage, read_write> partial_sums: array<vec2f>;
@group(0) @binding(5) var<storage, read_write> mean_ratio: array<f32>;
@group(0) @binding(6) var weights: texture_storage_2d_array<r32float, read_write>;

var<workgroup> sums: array<vec2f, 256>;

fn cell_index(cell: vec2u, face: u32) -> u32 {
    return (face * settings.cells + cell.y) * settings.cells + cell.x;
}

// The sum of the first `count` entries, a power of two, ends up in the first. In a fixed order, so equal input gives equal output.
fn reduce(local: u32, count: u32) {
    for (var half = count / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            sums[local] += sums[local + half];
        }
    }
    workgroupBarrier();
}

@compute @workgroup_size(8, 8)
fn blur(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let scale = 1.0 / max(sampling_density_total(flux_sums), 1e-38);
    let reach = i32(settings.blur);
    var weighted = 0.0;
    var weight = 0.0;
    for (var y = -reach; y <= reach; y++) {
        for (var x = -reach; x <= reach; x++) {
            let other = vec2i(id.xy) + vec2i(x, y);
            if all(other >= vec2i(0)) && all(other < vec2i(i32(settings.cells))) {
                let ratio = ratios[cell_index(vec2u(other), id.z)];
                if ratio >= 0.0 {
                    // Empty cells have no flux and so no say.
                    let w = f32((2 - abs(x)) * (2 - abs(y))) * (density_weight(flux_sums, other, i32(id.z), i32(settings.level)) * scale);
                    weighted += w * ratio;
                    weight += w;
                }
            }
        }
    }
    let ratio = select(-1.0, weighted / weight, weight > 0.0);
    blurred[cell_index(id.xy, id.z)] = ratio;
    let share = select(0.0, density_weight(flux_sums, vec2i(id.xy), i32(id.z), i32(settings.level)) * scale, ratio >= 0.0);
    sums[local] = vec2f(share * ratio, share);
    reduce(local, 64u);
    if local == 0u {
        partial_sums[(group.z * groups.y + group.y) * groups.x + group.x] = sums[0];
    }
}

@compute @workgroup_size(256)
fn add_up(@builtin(local_invocation_index) local: u32) {
    var own = vec2f(0.0);
    for (var index = local; index < arrayLength(&partial_sums); index += 256u) {
        own += partial_sums[index];
    }
    sums[local] = own;
    reduce(local, 256u);
    if local == 0u {
        mean_ratio[0] = select(0.0, sums[0].x / sums[0].y, sums[0].y > 0.0);
    }
}

@compute @workgroup_size(8, 8)
fn combine(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(weights)) {
        return;
    }
    let mean = mean_ratio[0];
    let place = density_place(id.xy, id.z, textureDimensions(weights).x, settings.cells << settings.level);
    let flux = textureLoad(weights, id.xy, id.z).x;
    if flux <= 0.0 {
        return;
    }
    let ratio = blurred[cell_index(place.texel >> vec2u(settings.level), place.face)];
    let known = ratio >= 0.0 && mean > 0.0 && mean < 1e30;
    let factor = select(1.0, (1.0 - settings.flux_share) * (ratio / max(mean, 1e-38)) + settings.flux_share, known);
    textureStore(weights, id.xy, id.z, vec4f(storable_weight(flux * factor), 0.0, 0.0, 0.0));
}
