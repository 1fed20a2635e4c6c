//! The traversal of `visibility.wgsl` on the device, held against every triangle in f64.
#![allow(clippy::unwrap_used)]

use glam::{DVec3, Vec3};
use lobelia_graph::{Gpu, testing::gpu};
use lobelia_scene::Triangle;
use lobelia_shaders::{Flags, Source};
use lobelia_visibility::Hierarchy;

/// The pass's own source with one more entry point, so that what is tested is what runs.
const SEGMENTS_WGSL: &str = concat!(
    include_str!("../src/visibility.wgsl"),
    "
struct Segment { start: vec3f, padding_a: f32, end: vec3f, padding_b: f32 }
@group(1) @binding(0) var<storage, read> segments: array<Segment>;
@group(1) @binding(1) var<storage, read_write> hits: array<u32>;
@compute @workgroup_size(64)
fn trace_segments(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&segments) {
        hits[id.x] = u32(blocked(segments[id.x].start, segments[id.x].end));
    }
}"
);

type Segment = [Vec3; 2];

/// Whether the device finds something on each segment.
fn traced(gpu: &Gpu, triangles: &[Triangle], segments: &[Segment]) -> Vec<bool> {
    let hierarchy = Hierarchy::build(triangles);
    let source = Source { path: "crates/visibility/tests/segments.wgsl", text: SEGMENTS_WGSL };
    let pipeline = gpu.compute_pipeline("segments", source, "trace_segments", &Flags::new()).unwrap();
    let buffer = |bytes: &[u8], usage: wgpu::BufferUsages| {
        let usage = usage | wgpu::BufferUsages::COPY_DST;
        let buffer =
            gpu.device().create_buffer(&wgpu::BufferDescriptor { label: None, size: bytes.len() as u64, usage, mapped_at_creation: false });
        gpu.queue().write_buffer(&buffer, 0, bytes);
        buffer
    };
    let settings = [0, 1, (hierarchy.nodes.len() / 2) as u32, 0];
    let rows: Vec<[f32; 8]> = segments.iter().map(|[a, b]| [a.x, a.y, a.z, 0.0, b.x, b.y, b.z, 0.0]).collect();
    let group_0 = pipeline
        .bindings(0)
        .raw_buffer("settings", &buffer(bytemuck::cast_slice(&settings), wgpu::BufferUsages::UNIFORM))
        .raw_buffer("nodes", &buffer(bytemuck::cast_slice(&hierarchy.nodes), wgpu::BufferUsages::STORAGE))
        .raw_buffer("triangles", &buffer(bytemuck::cast_slice(&hierarchy.triangles), wgpu::BufferUsages::STORAGE))
        .build(gpu)
        .unwrap();
    let hits = buffer(&vec![0xff; 4 * segments.len()], wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let segments_buffer = buffer(bytemuck::cast_slice(&rows), wgpu::BufferUsages::STORAGE);
    let group_1 = pipeline.bindings(1).raw_buffer("segments", &segments_buffer).raw_buffer("hits", &hits).build(gpu).unwrap();
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(pipeline.raw());
    pass.set_bind_group(0, &group_0, &[]);
    pass.set_bind_group(1, &group_1, &[]);
    pass.dispatch_workgroups((segments.len() as u32).div_ceil(64), 1, 1);
    drop(pass);
    gpu.queue().submit([encoder.finish()]);
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&hits).unwrap());
    assert!(words.iter().all(|word| *word <= 1), "a segment was left out");
    words.into_iter().map(|word| word == 1).collect()
}

/// How clearly a segment meets a triangle: positive by so much (relative to the triangle and the segment) inside, negative by so much outside.
/// `None` for a triangle without area or a segment in its plane.
fn margin(triangle: &Triangle, [start, end]: &Segment) -> Option<f64> {
    let [a, b, c] = triangle.positions.map(|corner| corner.as_dvec3());
    let (start, direction) = (start.as_dvec3(), (*end - *start).as_dvec3());
    let normal = (b - a).cross(c - a);
    let slope = normal.dot(direction);
    let size = (b - a).length_squared().max((c - a).length_squared());
    if slope.abs() <= 1e-9 * size * direction.length() {
        let apart = normal.dot(a - start).abs() > 1e-6 * normal.length() * (start - a).length();
        return apart.then_some(f64::NEG_INFINITY);
    }
    let t = normal.dot(a - start) / slope;
    let place = start + direction * t;
    let weight = |from: DVec3, to: DVec3| (to - from).cross(place - from).dot(normal) / normal.length_squared();
    Some(t.min(1.0 - t).min(weight(a, b)).min(weight(b, c)).min(weight(c, a)))
}

/// What the device must say; `None` where rounding may decide.
fn expected(triangles: &[Triangle], segment: &Segment, tolerance: f64) -> Option<bool> {
    let margins: Vec<Option<f64>> = triangles.iter().map(|triangle| margin(triangle, segment)).collect();
    if margins.iter().flatten().any(|margin| *margin > tolerance) {
        return Some(true);
    }
    let unsure = margins.iter().zip(triangles).any(|(margin, triangle)| match margin {
        Some(margin) => *margin > -tolerance,
        // In the plane of a triangle that has one: who knows. Without area: never a hit.
        None => {
            let [a, b, c] = triangle.positions.map(|corner| corner.as_dvec3());
            (b - a).cross(c - a).length() > 1e-9 * (b - a).length_squared().max((c - a).length_squared())
        }
    });
    (!unsure).then_some(false)
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn point(&mut self, size: f32) -> Vec3 {
        (Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0) * size
    }
}

fn triangle(positions: [Vec3; 3]) -> Triangle {
    Triangle { positions, instance: 0, material: 0 }
}

/// Segments of which the device says the wrong thing, and how many were clear.
fn faults(gpu: &Gpu, triangles: &[Triangle], segments: &[Segment], tolerance: f64) -> (Vec<Segment>, usize) {
    let found = traced(gpu, triangles, segments);
    let (mut wrong, mut clear) = (Vec::new(), 0);
    for (segment, found) in segments.iter().zip(found) {
        if let Some(expected) = expected(triangles, segment, tolerance) {
            clear += 1;
            if found != expected {
                wrong.push(*segment);
            }
        }
    }
    (wrong, clear)
}

/// Soups of every size, large and small triangles, near the origin and a kilometre away.
#[test]
fn random_segments_through_random_soups() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(1);
    for (count, size, away, tolerance) in [
        (1, 1.0, 0.0, 1e-5),
        (2, 1.0, 0.0, 1e-5),
        (7, 0.5, 0.0, 1e-5),
        (300, 0.3, 0.0, 1e-5),
        (1000, 0.05, 0.0, 1e-5),
        (300, 0.3, 1e3, 2e-3),
        (300, 3e-4, -1e-3, 1e-5),
    ] {
        let scale = if size < 1e-3 { 1e-3 } else { 1.0 };
        let offset = Vec3::splat(away);
        let triangles: Vec<Triangle> = (0..count)
            .map(|_| {
                let centre = random.point(scale) + offset;
                triangle([0; 3].map(|_| centre + random.point(size)))
            })
            .collect();
        let segments: Vec<Segment> = (0..4000).map(|_| [random.point(1.5 * scale) + offset, random.point(1.5 * scale) + offset]).collect();
        let (wrong, clear) = faults(gpu, &triangles, &segments, tolerance);
        let blocked = traced(gpu, &triangles, &segments).iter().filter(|hit| **hit).count();
        println!("{count} triangles of {size} m at {away} m: {clear} of 4000 are clear, {blocked} are blocked");
        assert!(wrong.is_empty(), "{count} triangles of {size}: {} of {clear} are wrong, the first {:?}", wrong.len(), wrong[0]);
        assert!(clear > 3200 && blocked > 20 && blocked < 4000, "{clear} {blocked}");
    }
}

/// Directions with zeros in them, of both signs, through an axis-aligned grid of squares whose boxes are flat.
#[test]
fn axis_aligned_segments_through_flat_boxes() {
    let Some(gpu) = gpu() else { return };
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for level in 0..4 {
            let (u, v) = (Vec3::AXES[(axis + 1) % 3], Vec3::AXES[(axis + 2) % 3]);
            let corner = Vec3::AXES[axis] * (level as f32 * 0.5) + (u + v) * 0.125 * level as f32;
            triangles.push(triangle([corner, corner + u, corner + u + v]));
            triangles.push(triangle([corner, corner + u + v, corner + v]));
        }
    }
    let mut random = Random(2);
    let segments: Vec<Segment> = (0..3000)
        .map(|index| {
            let start = random.point(1.0) + 0.75;
            let mut end = start;
            // One or two components differ; the others are equal, so the direction has exact zeros, -0 among them.
            let axis = index % 3;
            end[axis] = 3.0 * random.next() - 0.75;
            if index % 2 == 0 {
                end[(axis + 1) % 3] = 3.0 * random.next() - 0.75;
            }
            if index % 5 == 0 { [end, start] } else { [start, end] }
        })
        .collect();
    let (wrong, clear) = faults(gpu, &triangles, &segments, 1e-6);
    assert!(wrong.is_empty(), "{} of {clear} are wrong, the first {:?}", wrong.len(), wrong[0]);
    assert!(clear > 2900);
}

/// A closed sphere lets nothing out: segments from its middle aimed at edges and corners, where two or six triangles share the blame.
/// Each triangle is rounded on its own; without the slack of `segment_hits_triangle` every tenth of these slips through.
#[test]
fn edges_and_corners_are_closed() {
    let Some(gpu) = gpu() else { return };
    let (rings, sectors) = (24, 32);
    let corner = |ring: usize, sector: usize| {
        let (theta, phi) = (ring as f64 / rings as f64 * std::f64::consts::PI, sector as f64 / sectors as f64 * std::f64::consts::TAU);
        DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()).as_vec3()
    };
    let mut triangles = Vec::new();
    let mut segments = Vec::new();
    for ring in 0..rings {
        for sector in 0..sectors {
            let next = (sector + 1) % sectors;
            let [a, b, c, d] = [corner(ring, sector), corner(ring + 1, sector), corner(ring + 1, next), corner(ring, next)];
            triangles.push(triangle([a, b, c]));
            triangles.push(triangle([a, c, d]));
            let middle = Vec3::new(0.03, -0.02, 0.01);
            segments.extend([a, b, (a + b) / 2.0, (a + c) / 2.0, a * 0.3 + c * 0.7].map(|aim| [middle, middle + (aim - middle) * 2.0]));
        }
    }
    let escaped = traced(gpu, &triangles, &segments).iter().filter(|hit| !**hit).count();
    assert_eq!(escaped, 0, "of {}", segments.len());
    // One triangle less is seen.
    triangles.remove(777);
    let hole: Vec<Vec3> = {
        let (ring, sector) = (777 / 2 / sectors, 777 / 2 % sectors);
        vec![corner(ring, sector), corner(ring + 1, sector + 1), corner(ring, sector + 1)]
    };
    let through = [Vec3::ZERO, (hole[0] + hole[1] + hole[2]) / 3.0 * 2.0];
    assert_eq!(traced(gpu, &triangles, &[through, [Vec3::ZERO, -through[1]]]), [false, true]);
}

/// Triangles without area, many at one place, none at all.
#[test]
fn degenerate_scenes() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(3);
    let segments: Vec<Segment> = (0..500).map(|_| [random.point(2.0), random.point(2.0)]).collect();
    assert!(traced(gpu, &[], &segments).iter().all(|hit| !hit), "nothing blocks nothing");
    let point = triangle([Vec3::ONE; 3]);
    let line = triangle([Vec3::ZERO, Vec3::ONE, Vec3::ONE * 0.5]);
    assert!(traced(gpu, &[point, line, point], &segments).iter().all(|hit| !hit), "what has no area blocks nothing");
    let screen = triangle([Vec3::new(-9.0, -9.0, 0.1), Vec3::new(9.0, -9.0, 0.1), Vec3::new(0.0, 9.0, 0.1)]);
    let mut triangles = vec![point, line];
    triangles.extend([screen; 200]);
    let (wrong, clear) = faults(gpu, &triangles, &segments, 1e-6);
    assert!(wrong.is_empty() && clear > 400, "{wrong:?} {clear}");
    // A segment without length meets nothing, not even what it lies on.
    let on = Vec3::new(0.0, 0.0, 0.1);
    assert_eq!(traced(gpu, &triangles, &[[on, on], [on, on + Vec3::Z], [on - Vec3::Z, on]]), [false; 3], "ends do not count");
}

/// The comparison above can fail: against another soup, it does.
#[test]
fn another_scene_is_seen() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(4);
    let triangles: Vec<Triangle> = (0..50)
        .map(|_| {
            let centre = random.point(1.0);
            triangle([0; 3].map(|_| centre + random.point(0.5)))
        })
        .collect();
    let segments: Vec<Segment> = (0..2000).map(|_| [random.point(1.5), random.point(1.5)]).collect();
    let found = traced(gpu, &triangles[1..], &segments);
    let wrong = segments
        .iter()
        .zip(found)
        .filter(|(segment, found)| expected(&triangles, segment, 1e-5).is_some_and(|expected| expected != *found))
        .count();
    assert!(wrong > 5, "{wrong}");
}
