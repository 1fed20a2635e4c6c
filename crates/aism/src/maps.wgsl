// Draws imperfect shadow maps: chooses points on the scene's surface for each light, splats them, and closes holes.
//
// A light's map is a pyramid of square levels, finest first.

#import lobelia::hemi_octahedral::{hemi_octahedral_decode, hemi_octahedral_encode, hemi_octahedral_norm}
#import lobelia::math::{PI, perpendicular, safe_normalize}
#import lobelia::octahedral::octahedral_unpack
#import lobelia::sampling::{hash, r2_point, unit_float}
#import lobelia::scene::{View, scene_position}
#import lobelia::virtual_lights::{VirtualLight, virtual_light_normal}

struct Settings {
    light_count: u32,
    interleave: u32,
    // Texels, a power of two.
    resolution: u32,
    // Points per light.
    points: u32,
    triangle_count: u32,
    // Patches that each light weighs.
    candidates: u32,
    seed: u32,
    // Pixels that each light looks at to see where receivers are; 0: receivers are not looked at.
    view_samples: u32,
    // Of the scene, m^2.
    area: f32,
    // Radius of a point's disk in radii of its share of the surface.
    spread: f32,
    // Texel widths.
    bias: f32,
    padding: f32,
}

// Changes from dispatch to dispatch.
struct Range {
    // The lights of this dispatch; the first has the first map.
    first_light: u32,
    end_light: u32,
    padding_a: u32,
    padding_b: u32,
}

// Fixed for each level of the pyramid.
struct Level {
    // The finer of two levels.
    index: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: Settings;
@group(0) @binding(2) var<uniform> range: Range;
@group(0) @binding(3) var<uniform> level: Level;
@group(0) @binding(4) var<storage, read> triangles: array<vec4f>;
@group(0) @binding(5) var<storage, read> ends: array<u32>;
@group(0) @binding(6) var<storage, read> virtual_lights: array<VirtualLight>;
// Running sums of the patches' weights, light by light.
@group(0) @binding(7) var<storage, read_write> weights: array<f32>;
@group(0) @binding(8) var<storage, read_write> maps: array<atomic<u32>>;
@group(0) @binding(9) var gbuffer_depth: texture_depth_2d;
#ifdef NORMAL_MAP
@group(0) @binding(10) var gbuffer_geometric_normal: texture_2d<u32>;
#else
@group(0) @binding(10) var gbuffer_core: texture_2d<u32>;
#endif

// Texels are distances (in the norm of the map) as the bits of floats, references to another texel of the finest level, or empty, which comes last in
// order, so that the least of several is kept.
const REFERENCE: u32 = 0x80000000u;
const EMPTY: u32 = 0xffffffffu;
// Of a distance: its last bit tells that it is not to be trusted.
const GAP: u32 = 1u;

// Largest radius of a splat, texels; wider gaps are left to pulling and pushing.
const MAX_RADIUS: f32 = 3.0;

// A splat reaches every texel whose centre is this near, texels: about the texel that it falls into.
const MIN_RADIUS: f32 = 0.5;

// Points lower than this above the light's own plane, relative to their distance, are not drawn: they are the light's own surface, up to rounding, and what
// they would hide lies where no light goes.
const LEAST_HEIGHT: f32 = 2e-3;

struct Point {
    // Relative to the light, in its frame.
    position: vec3f,
    normal: vec3f,
    // Barycentric coordinates of the second and the third corner, and their gradients over the triangle's plane.
    weights: vec2f,
    gradient_b: vec3f,
    gradient_c: vec3f,
    // Of the triangle, m^2.
    area: f32,
}

struct Frame {
    origin: vec3f,
    tangent: vec3f,
    bitangent: vec3f,
    normal: vec3f,
}

fn light_frame(index: u32) -> Frame {
    let normal = virtual_light_normal(virtual_lights[index]);
    let tangent = perpendicular(normal);
    return Frame(virtual_lights[index].position, tangent, cross(normal, tangent), normal);
}

fn to_frame(frame: Frame, v: vec3f) -> vec3f {
    return vec3f(dot(v, frame.tangent), dot(v, frame.bitangent), dot(v, frame.normal));
}

// The place on the surface that an integer names; see `SurfaceCurve`.
fn surface_point(place: u32, frame: Frame) -> Point {
    var low = 0u;
    var high = settings.triangle_count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if ends[middle] > place {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    let start = select(0u, ends[max(low, 1u) - 1u], low > 0u);
    let share = f32(place - min(start, place)) / f32(max(ends[low] - start, 1u));
    // Twelve levels of subdivision: the middle child turns around, a corner child moves to its corner.
    var digits = u32(clamp(share, 0.0, 0.99999994) * 16777216.0);
    var size = 1.0;
    var moved = vec3f(0.0);
    for (var step = 0u; step < 12u; step++) {
        let digit = (digits >> 22u) & 3u;
        digits <<= 2u;
        size *= select(0.5, -0.5, digit == 0u);
        moved += size * vec3f(f32(digit == 1u), f32(digit == 2u), f32(digit == 3u));
    }
    let ab = triangles[3u * low + 1u].xyz;
    let ac = triangles[3u * low + 2u].xyz;
    let mean = (1.0 - moved.x - moved.y - moved.z) / 3.0;
    let position = triangles[3u * low].xyz + ab * (moved.y + mean) + ac * (moved.z + mean);
    let local_ab = to_frame(frame, ab);
    let local_ac = to_frame(frame, ac);
    // Edges are scaled before they are multiplied, so that neither tiny nor huge triangles leave the range of floats.
    let scale = max(max(length(ab), length(ac)), 1e-30);
    let twice_area = cross(local_ab / scale, local_ac / scale);
    let sine = max(length(twice_area), 1e-30);
    let normal = twice_area / sine;
    let gradient_b = cross(local_ac / scale, normal) / (sine * scale);
    let gradient_c = cross(normal, local_ab / scale) / (sine * scale);
    let weights = vec2f(moved.y + mean, moved.z + mean);
    return Point(to_frame(frame, position - frame.origin), normal, weights, gradient_b, gradient_c, 0.5 * sine * scale * scale);
}

fn map_stride() -> u32 {
    return (4u * settings.resolution * settings.resolution - 1u) / 3u;
}

// Where level `index` of a light's pyramid starts.
fn level_start(slot: u32, index: u32) -> u32 {
    let side = settings.resolution >> index;
    return slot * map_stride() + (settings.resolution * settings.resolution - side * side) / 3u * 4u;
}

@compute @workgroup_size(256)
fn clear(@builtin(global_invocation_id) id: vec3u) {
    if id.x < map_stride() && range.first_light + id.y < range.end_light {
        atomicStore(&maps[id.y * map_stride() + id.x], EMPTY);
    }
}

// Cells of the map in which receivers are looked for, a side.
const VIEW_CELLS: u32 = 16u;
// Weight of patches behind which no receiver was found, relative to others: samples of the view miss some.
const UNSEEN_WEIGHT: f32 = 0.1;

// Distance (in the map's norm) of the farthest receiver in each cell.
var<workgroup> farthest: array<atomic<u32>, 256>;
var<workgroup> sums: array<f32, 256>;

fn view_cell(v: vec3f) -> vec2i {
    let uv = clamp(hemi_octahedral_encode(v) * 0.5 + vec2f(0.5), vec2f(0.0), vec2f(0.9999999));
    return vec2i(uv * f32(VIEW_CELLS));
}

fn receiver_normal(pixel: vec2u) -> vec3f {
#ifdef NORMAL_MAP
    return octahedral_unpack(textureLoad(gbuffer_geometric_normal, pixel, 0).x);
#else
    return octahedral_unpack(textureLoad(gbuffer_core, pixel, 0).x);
#endif
}

// Notes where a receiver is that the light shines on.
fn note_receiver(index: u32, light: u32, frame: Frame) {
    let extent = vec2u(view.extent);
    let pixel = min(vec2u(r2_point(index, settings.seed ^ hash(light)) * view.extent), extent - vec2u(1u));
    let depth = textureLoad(gbuffer_depth, pixel, 0);
    if depth <= 0.0 {
        return;
    }
    let offset = scene_position(view, vec2f(pixel), depth) - frame.origin;
    let local = to_frame(frame, offset);
    if local.z > 0.0 && dot(offset, receiver_normal(pixel)) < 0.0 {
        let cell = view_cell(local);
        atomicMax(&farthest[u32(cell.y) * VIEW_CELLS + u32(cell.x)], bitcast<u32>(hemi_octahedral_norm(local)));
    }
}

// Whether a receiver lies behind a point, in its own cell or one next to it.
fn hides_receiver(v: vec3f) -> bool {
    let distance = 0.9 * hemi_octahedral_norm(v);
    let cell = view_cell(v);
    for (var step = 0; step < 9; step++) {
        let other = cell + vec2i(step % 3 - 1, step / 3 - 1);
        if all(other >= vec2i(0)) && all(other < vec2i(i32(VIEW_CELLS))) {
            if bitcast<f32>(atomicLoad(&farthest[u32(other.y) * VIEW_CELLS + u32(other.x)])) > distance {
                return true;
            }
        }
    }
    return false;
}

// Solid angle that a patch covers, about, times whether it can hide anything that is seen.
fn patch_weight(patch_index: u32, light: u32, frame: Frame) -> f32 {
    let width = 0xffffffffu / settings.candidates;
    let place = patch_index * width + u32(unit_float(hash(hash(light ^ settings.seed) ^ patch_index)) * f32(width));
    let point = surface_point(place, frame);
    let area = settings.area / f32(settings.candidates);
    let reach = sqrt(area);
    let squared = dot(point.position, point.position);
    if !(squared > 0.0) || point.position.z < -reach {
        return 0.0;
    }
    // One point speaks for the patch, whose other points see the light at other angles, by as much as the patch is wide.
    let distance = sqrt(squared);
    let cosine = max(abs(dot(point.normal, point.position)) / distance, min(0.3 * reach / distance, 1.0));
    let solid_angle = area * cosine / (squared + area);
    if settings.view_samples == 0u {
        return solid_angle;
    }
    let above = vec3f(point.position.xy, max(point.position.z, 0.0));
    return solid_angle * select(UNSEEN_WEIGHT, 1.0, hides_receiver(above));
}

// One workgroup a light.
@compute @workgroup_size(256)
fn weigh(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let light = range.first_light + group.x;
    let frame = light_frame(light);
    atomicStore(&farthest[local], 0u);
    workgroupBarrier();
    for (var index = local; index < settings.view_samples; index += 256u) {
        note_receiver(index, light, frame);
    }
    workgroupBarrier();
    let each = settings.candidates / 256u;
    let start = group.x * settings.candidates + local * each;
    var sum = 0.0;
    for (var index = 0u; index < each; index++) {
        sum += patch_weight(local * each + index, light, frame);
        weights[start + index] = sum;
    }
    sums[local] = sum;
    workgroupBarrier();
    for (var reach = 1u; reach < 256u; reach *= 2u) {
        var other = 0.0;
        if local >= reach {
            other = sums[local - reach];
        }
        workgroupBarrier();
        sums[local] += other;
        workgroupBarrier();
    }
    let before = select(0.0, sums[max(local, 1u) - 1u], local > 0u);
    for (var index = 0u; index < each; index++) {
        weights[start + index] += before;
    }
}

struct Choice {
    place: u32,
    // Of the surface that the point stands for, m^2; 0: no point.
    area: f32,
}

#ifdef ADAPTIVE
// Point `index` of `points` by systematic resampling: patches get points in proportion to their weights, evenly spread over each patch.
fn choose(index: u32, slot: u32, light: u32) -> Choice {
    let start = slot * settings.candidates;
    let total = weights[start + settings.candidates - 1u];
    if !(total > 0.0) {
        return Choice(0u, 0.0);
    }
    let target_sum = total * ((f32(index) + unit_float(hash(light ^ hash(settings.seed)))) / f32(settings.points));
    var low = 0u;
    var high = settings.candidates - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if weights[start + middle] > target_sum {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    let before = select(0.0, weights[start + max(low, 1u) - 1u], low > 0u);
    let weight = weights[start + low] - before;
    if !(weight > 0.0) {
        return Choice(0u, 0.0);
    }
    let width = 0xffffffffu / settings.candidates;
    let within = clamp((target_sum - before) / weight, 0.0, 0.999999);
    let area = settings.area / f32(settings.candidates) * (total / (weight * f32(settings.points)));
    return Choice(low * width + u32(within * f32(width)), area);
}
#else
// Point `index` of `points` that are spread over all surface evenly, other ones for each light.
fn choose(index: u32, slot: u32, light: u32) -> Choice {
    let width = 0xffffffffu / settings.points;
    let random = unit_float(hash(hash(light ^ settings.seed) ^ index));
    return Choice(index * width + u32(random * f32(width)), settings.area / f32(settings.points));
}
#endif

@compute @workgroup_size(64)
fn splat(@builtin(global_invocation_id) id: vec3u) {
    let light = range.first_light + id.y;
    if id.x >= settings.points || light >= range.end_light {
        return;
    }
    let frame = light_frame(light);
    let choice = choose(id.x, id.y, light);
    if !(choice.area > 0.0) {
        return;
    }
    let point = surface_point(choice.place, frame);
    let distance = length(point.position);
    if !(point.position.z > LEAST_HEIGHT * distance) || !(distance < 1e18) {
        return;
    }
    let side = f32(settings.resolution);
    let own = point.position / hemi_octahedral_norm(point.position);
    // Texels per radian, the mean of all directions: the map has 2 du dv / |p|^3 of solid angle.
    let scale = side * sqrt(0.5 * pow(dot(own, own), 1.5)) / distance;
    let radius = clamp(settings.spread * sqrt(choice.area / PI), MIN_RADIUS / scale, MAX_RADIUS / scale);
    // The map stretches directions unequally, by less than a half.
    let reach = 1.5 * radius * scale;
    let centre = (hemi_octahedral_encode(point.position) * 0.5 + vec2f(0.5)) * side;
    let low = vec2u(clamp(ceil(centre - vec2f(reach + 0.5)), vec2f(0.0), vec2f(side - 1.0)));
    let high = vec2u(clamp(floor(centre + vec2f(reach - 0.5)), vec2f(0.0), vec2f(side - 1.0)));
    let height = dot(point.normal, point.position);
    let start = level_start(id.y, 0u);
    // A disk ends where its triangle does, or shadows would grow by its radius. Where triangles are as small as disks, their neighbours are met as well.
    let overhang = 0.25 * PI * radius * radius / point.area;
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let texel = hemi_octahedral_decode((vec2f(f32(x), f32(y)) + vec2f(0.5)) * (2.0 / side) - vec2f(1.0));
            let along = height / dot(point.normal, texel);
            let offset = along * texel - point.position;
            let weights = point.weights + vec2f(dot(offset, point.gradient_b), dot(offset, point.gradient_c));
            let inside = min(min(weights.x, weights.y), 1.0 - weights.x - weights.y) >= -overhang;
            if along > 0.0 && dot(offset, offset) <= radius * radius && inside {
                atomicMin(&maps[start + y * settings.resolution + x], bitcast<u32>(along) & ~GAP);
            }
        }
    }
}

// What is behind both of two texels that face each other, by this factor, is background between them.
const GAP_DEPTH: f32 = 1.25;

// Distance in a texel beside another; infinity where there is none.
fn beside(slot: u32, place: vec2u, step: vec2i) -> f32 {
    let other = vec2i(place) + step;
    if any(other < vec2i(0)) || any(other >= vec2i(i32(settings.resolution))) {
        return 1e30;
    }
    let word = atomicLoad(&maps[level_start(slot, 0u) + u32(other.y) * settings.resolution + u32(other.x)]);
    return select(bitcast<f32>(word & ~GAP), 1e30, word >= REFERENCE);
}

// Marks texels that see background through a gap between points: three of the four pairs of neighbours that face each other are clearly nearer. Along
// a plane, however slanted, no pair is.
@compute @workgroup_size(256)
fn mark_gaps(@builtin(global_invocation_id) id: vec3u) {
    let side = settings.resolution;
    if id.x >= side * side || range.first_light + id.y >= range.end_light {
        return;
    }
    let own = level_start(id.y, 0u) + id.x;
    let word = atomicLoad(&maps[own]);
    if word >= REFERENCE {
        return;
    }
    let place = vec2u(id.x % side, id.x / side);
    let nearer_than = bitcast<f32>(word) / GAP_DEPTH;
    var pairs = 0u;
    for (var direction = 0; direction < 4; direction++) {
        let step = vec2i(min(direction, 1), select(direction - 2, 1, direction == 0));
        if max(beside(id.y, place, step), beside(id.y, place, -step)) < nearer_than {
            pairs += 1u;
        }
    }
    if pairs >= 3u {
        atomicStore(&maps[own], word | GAP);
    }
}

// The texel of the finest level that a texel of any level stands for: itself, or the one that it refers to; none: EMPTY.
fn referred(slot: u32, index: u32, place: vec2u) -> u32 {
    let word = atomicLoad(&maps[level_start(slot, index) + place.y * (settings.resolution >> index) + place.x]);
    if index == 0u && word < REFERENCE {
        if (word & GAP) != 0u {
            return EMPTY;
        }
        return REFERENCE | (place.y << 8u) | place.x;
    }
    return word;
}

// The nearer of two texels, measured in texels of the finest level from a place; the first one if they are equally near.
fn nearer(one: u32, other: u32, place: vec2f) -> u32 {
    if one == EMPTY || other == EMPTY {
        return min(one, other);
    }
    let from_one = vec2f(f32(one & 255u), f32((one >> 8u) & 255u)) + vec2f(0.5) - place;
    let from_other = vec2f(f32(other & 255u), f32((other >> 8u) & 255u)) + vec2f(0.5) - place;
    return select(one, other, dot(from_other, from_other) < dot(from_one, from_one));
}

// Each coarser texel refers to the texel nearest to its middle.
@compute @workgroup_size(256)
fn pull(@builtin(global_invocation_id) id: vec3u) {
    let side = settings.resolution >> (level.index + 1u);
    if id.x >= side * side || range.first_light + id.y >= range.end_light {
        return;
    }
    let place = vec2u(id.x % side, id.x / side);
    let middle = (vec2f(place) + vec2f(0.5)) * f32(2u << level.index);
    var best = EMPTY;
    for (var child = 0u; child < 4u; child++) {
        best = nearer(best, referred(id.y, level.index, 2u * place + vec2u(child & 1u, child >> 1u)), middle);
    }
    atomicStore(&maps[level_start(id.y, level.index + 1u) + id.x], best);
}

// Each empty texel refers to the nearest that the coarser texels around it refer to.
@compute @workgroup_size(256)
fn push(@builtin(global_invocation_id) id: vec3u) {
    let side = settings.resolution >> level.index;
    if id.x >= side * side || range.first_light + id.y >= range.end_light {
        return;
    }
    let place = vec2u(id.x % side, id.x / side);
    let own = level_start(id.y, level.index) + id.x;
    let word = atomicLoad(&maps[own]);
    if word != EMPTY && (level.index > 0u || (word & GAP) == 0u) {
        return;
    }
    // The four coarse texels around, within the border.
    let near = place / 2u;
    let step = vec2i(place & vec2u(1u)) * 2 - vec2i(1);
    let far = vec2u(clamp(vec2i(near) + step, vec2i(0), vec2i(i32(side / 2u) - 1)));
    let middle = (vec2f(place) + vec2f(0.5)) * f32(1u << level.index);
    var best = EMPTY;
    for (var corner = 0u; corner < 4u; corner++) {
        let coarse = select(near, far, vec2<bool>((corner & 1u) == 1u, corner > 1u));
        best = nearer(best, referred(id.y, level.index + 1u, coarse), middle);
    }
    atomicStore(&maps[own], select(best, word, best == EMPTY));
}
