//! `vpl-gather` against the sum in f64.

use crate::given::{EXTENT, Given, PIXELS, Pixel, Random, light, pack_unit, position, run, turn, unpack_unit, view};
use glam::{DVec3, Vec3};
use lobelia::{
    frame::VirtualLight,
    graph::{Gpu, testing::gpu},
    scene::{Ndf, Scene},
};
use lobelia_lobes::brdf::{Brdf, Distribution};

struct Case {
    scene: Scene,
    specular: bool,
    normal_map: bool,
    clamp: Option<f64>,
    /// Of the gathering, and of the visibility if there is one.
    interleave: u32,
    visibility: Option<u32>,
    given: Given,
}

struct Surface {
    normal: DVec3,
    geometric: DVec3,
    brdf: Brdf,
}

impl Case {
    fn new(ndf: Ndf, specular: bool, normal_map: bool, lights: u32, random: &mut Random) -> Self {
        let mut scene = Scene::load("builtin:cornell-diffuse").unwrap();
        scene.ndf = ndf;
        let near = f64::from(view(&scene).near);
        let pixel = |random: &mut Random| {
            let normal = (DVec3::Z + random.direction() * 0.8).normalize();
            let (color, word) = random.material();
            let geometric_normal = pack_unit((normal + random.direction() * 0.3).normalize());
            Pixel { depth: (near / (3.0 + 2.0 * random.next())) as f32, core: [pack_unit(normal), color], specular: word, geometric_normal }
        };
        let pixels = (0..PIXELS).map(|_| pixel(random)).collect();
        let lights = (0..lights)
            .map(|_| {
                let place = DVec3::new(2.0 * random.next() - 1.0, 2.0 * random.next() - 1.0, -2.5 * random.next());
                light(random, place, DVec3::NEG_Z)
            })
            .collect();
        let given = Given { pixels, lights, visibility: Vec::new() };
        Self { scene, specular, normal_map, clamp: None, interleave: 1, visibility: None, given }
    }

    /// All pixels on one plane that faces the camera; those right of the middle on another, a tenth nearer.
    fn flat(mut self) -> Self {
        let near = view(&self.scene).near;
        for (index, pixel) in self.given.pixels.iter_mut().enumerate() {
            pixel.depth = near / if index as u32 % EXTENT[0] < EXTENT[0] / 2 { 4.0 } else { 3.6 };
            pixel.core[0] = pack_unit(DVec3::Z);
            pixel.geometric_normal = pack_unit(DVec3::Z);
        }
        self
    }

    fn with_visibility(mut self, interleave: u32, random: &mut Random) -> Self {
        let words = (self.given.lights.len() as u32).div_ceil(interleave * interleave).div_ceil(32) as usize;
        self.given.visibility = (0..words * PIXELS).map(|_| random.word()).collect();
        self.visibility = Some(interleave);
        self
    }

    fn surface(&self, core: [u32; 2], word: u32, geometric: u32) -> Surface {
        let root =
            DVec3::new(f64::from(core[1] & 2047) / 2047.0, f64::from((core[1] >> 11) & 2047) / 2047.0, f64::from(core[1] >> 22) / 1023.0);
        let [roughness, metallic, specular] = match self.specular {
            true => [f64::from(word & 0xffff) / 65535.0, f64::from((word >> 16) & 255) / 255.0, f64::from(word >> 24) / 255.0],
            false => [1.0, 0.0, 0.0],
        };
        let distribution = if self.scene.ndf == Ndf::Phong { Distribution::Phong } else { Distribution::Ggx };
        let normal = unpack_unit(core[0]);
        let geometric = if self.normal_map { unpack_unit(geometric) } else { normal };
        Surface { normal, geometric, brdf: Brdf::new(root * root, metallic, roughness, specular, distribution) }
    }

    fn pixel_surface(&self, index: usize) -> (Surface, DVec3) {
        let pixel = &self.given.pixels[index];
        (self.surface(pixel.core, pixel.specular, pixel.geometric_normal), position(&view(&self.scene), index, pixel.depth))
    }

    /// What light `light` adds to a pixel; `None` where rounding decides on which side of a surface a direction is.
    fn contribution(&self, index: usize, light: &VirtualLight) -> Option<DVec3> {
        let (x, at) = self.pixel_surface(index);
        let y = self.surface(light.core.to_array(), light.specular, light.geometric_normal);
        let offset = light.position.as_dvec3() - at;
        let (l, v, s) =
            (offset.normalize(), (view(&self.scene).position.as_dvec3() - at).normalize(), light.direction_to_source.as_dvec3());
        let sides = |surface: &Surface, a: DVec3, b: DVec3| {
            [surface.normal.dot(a), surface.normal.dot(b), surface.geometric.dot(a), surface.geometric.dot(b)]
        };
        let (at_x, at_y) = (sides(&x, l, v), sides(&y, s, -l));
        if at_x.iter().chain(&at_y).any(|cosine| cosine.abs() < 1e-4) {
            return None;
        }
        if at_x[2] * at_x[3] < 0.0 || at_y[2] * at_y[3] < 0.0 {
            return Some(DVec3::ZERO);
        }
        // Light leaves the area that the geometric normal gives, and only where the shading normal reflects it.
        let geometry = if at_y[1] > 0.0 { at_x[0].max(0.0) * at_y[3].max(0.0) / offset.length_squared() } else { 0.0 };
        let geometry = geometry.min(self.clamp.unwrap_or(f64::INFINITY));
        Some(x.brdf.evaluate(x.normal, l, v) * y.brdf.evaluate(y.normal, s, -l) * light.flux.as_dvec3() * geometry)
    }

    fn subset(&self, index: usize, k: u32) -> u32 {
        (index as u32 % EXTENT[0]) % k + k * ((index as u32 / EXTENT[0]) % k)
    }

    fn sees(&self, index: usize, light: u32) -> bool {
        let Some(k) = self.visibility else { return true };
        let order = light / (k * k);
        self.given.visibility[order as usize / 32 * PIXELS + index] >> (order % 32) & 1 == 1
    }

    /// Sum over the lights that a pixel knows.
    fn own_sum(&self, index: usize) -> Option<DVec3> {
        let k = self.interleave;
        let mut sum = DVec3::ZERO;
        for (number, light) in (0u32..).zip(&self.given.lights) {
            if number % (k * k) == self.subset(index, k) && self.sees(index, number) {
                sum += self.contribution(index, light)?;
            }
        }
        Some(sum)
    }

    /// The radiance that must come out: for interleaved gathering the mean over the block around the pixel, times the number of subsets.
    fn expected(&self) -> Vec<Option<DVec3>> {
        let sums: Vec<Option<DVec3>> = (0..PIXELS).map(|index| self.own_sum(index)).collect();
        let k = self.interleave as i32;
        if k == 1 {
            return sums;
        }
        let [width, height] = EXTENT.map(|side| side as i32);
        let filtered = |index: usize| {
            let (x, y) = (index as i32 % width, index as i32 / width);
            let (mut total, mut count) = (DVec3::ZERO, 0);
            for (near_x, near_y) in (0..k * k).map(|subset| (subset % k, subset / k)) {
                let (mut weighted, mut weights) = (DVec3::ZERO, 0.0);
                for (dx, dy) in [(near_x, near_y), (near_x - k, near_y), (near_x, near_y - k), (near_x - k, near_y - k)] {
                    let (other_x, other_y) = (x + dx, y + dy);
                    let same_side = (other_x < width / 2) == (x < width / 2);
                    let weight = f64::from((k - dx.abs()) * (k - dy.abs()));
                    if (0..width).contains(&other_x) && (0..height).contains(&other_y) && same_side && weight > 0.0 {
                        weighted += sums[(other_y * width + other_x) as usize]? * weight;
                        weights += weight;
                    }
                }
                if weights > 0.0 {
                    total += weighted / weights;
                    count += 1;
                }
            }
            Some(total * f64::from(k * k) / f64::from(count))
        };
        (0..PIXELS).map(filtered).collect()
    }

    fn render(&self, gpu: &Gpu) -> Vec<DVec3> {
        let _turn = turn();
        let clamp = self.clamp.map_or("none".to_owned(), |clamp| format!("{clamp:?}"));
        let count = self.given.lights.len();
        let visibility =
            self.visibility.map_or(String::new(), |k| format!(r#""visibility": given_visibility(lights: {count}, interleave: {k}),"#));
        let text = format!(
            r#"(passes: {{
                "surfaces": given_gbuffer(specular: {}, normal_map: {}),
                "lights": given_lights(count: {count}),
                {visibility}
                "indirect": vpl_gather(clamp: {clamp}, clamp_unit: metre, interleave: {}),
            }}, output: "indirect.radiance")"#,
            self.specular, self.normal_map, self.interleave
        );
        let runner = run(gpu, &text, &self.scene, &self.given, &[], 0).unwrap();
        let image = runner.read_image(gpu, "indirect.radiance").unwrap().to_f32_rgba();
        image.into_iter().map(|[r, g, b, _]| DVec3::new(r.into(), g.into(), b.into())).collect()
    }

    /// Largest relative error over clear pixels, beyond half a step of the smallest halves.
    fn worst(&self, found: &[DVec3]) -> f64 {
        let (mut worst, mut clear, mut lit) = (0.0f64, 0, 0);
        for (expected, found) in self.expected().into_iter().zip(found) {
            let Some(expected) = expected else { continue };
            clear += 1;
            lit += u32::from(expected.max_element() > 1e-3);
            for channel in 0..3 {
                let excess = ((found[channel] - expected[channel]).abs() - 2e-7).max(0.0);
                let error = if excess == 0.0 { 0.0 } else { excess / expected[channel] };
                worst = worst.max(if error.is_nan() { f64::INFINITY } else { error });
            }
        }
        assert!(clear > PIXELS / 3 && lit > 100, "{clear} pixels are clear, {lit} lit");
        worst
    }
}

/// Half floats are exact to 4.9e-4; the rest is the rounding of 32-bit floats in lobes of alpha 0.02 and wider.
const TOLERANCE: f64 = 2e-3;

#[test]
fn the_sum_is_that_of_the_formula() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(1);
    let mut overall = 0.0f64;
    for (ndf, specular, normal_map) in
        [(Ndf::Ggx, true, true), (Ndf::Ggx, true, false), (Ndf::Ggx, false, true), (Ndf::Ggx, false, false), (Ndf::Phong, true, true)]
    {
        // Not a multiple of 32, nor of anything else.
        let open = Case::new(ndf, specular, normal_map, 70, &mut random);
        overall = overall.max(open.worst(&open.render(gpu)));
        let shadowed = Case::new(ndf, specular, normal_map, 70, &mut random).with_visibility(1, &mut random);
        overall = overall.max(shadowed.worst(&shadowed.render(gpu)));
    }
    println!("largest relative error {overall:.1e}");
    assert!(overall < TOLERANCE, "{overall}");
}

#[test]
fn clamp_bounds_the_geometry_term() {
    let Some(gpu) = gpu() else { return };
    let mut case = Case::new(Ndf::Ggx, true, false, 40, &mut Random(2));
    let free = case.render(gpu);
    case.clamp = Some(0.05);
    let bounded = case.render(gpu);
    assert!(case.worst(&bounded) < TOLERANCE);
    // It did something, and the comparison sees when it does not.
    assert!(case.worst(&free) > 0.5);
}

#[test]
fn interleaved_gathering_adds_up_all_subsets() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(3);
    for (k, visibility) in [(2, None), (3, Some(3)), (4, Some(1)), (8, Some(8))] {
        let mut case = Case::new(Ndf::Ggx, true, false, 200, &mut random).flat();
        case.interleave = k;
        if let Some(visibility) = visibility {
            case = case.with_visibility(visibility, &mut random);
        }
        let error = case.worst(&case.render(gpu));
        assert!(error < TOLERANCE, "interleave {k}, visibility {visibility:?}: {error}");
    }
}

/// Each block has all lights, along edges too: no pattern of period k is left of equal pixels.
#[test]
fn equal_pixels_come_out_equal() {
    let Some(gpu) = gpu() else { return };
    let mut case = Case::new(Ndf::Ggx, true, false, 64, &mut Random(4)).flat();
    // Far lights, so that neighbours differ by their lights only.
    for light in &mut case.given.lights {
        light.position *= Vec3::new(300.0, 300.0, -300.0);
        light.flux *= 90_000.0;
    }
    let first = case.given.pixels[0];
    case.given
        .pixels
        .iter_mut()
        .for_each(|pixel| *pixel = Pixel { specular: first.specular | 0xffff, core: [pixel.core[0], 0x7fff_ffff], ..first });
    case.interleave = 4;
    let found = case.render(gpu);
    let at = |x: usize, y: usize| found[y * EXTENT[0] as usize + x].y;
    let mean = at(16, 12);
    let spread = (0..32).flat_map(|x| (0..24).map(move |y| (x, y))).map(|(x, y)| (at(x, y) / mean - 1.0).abs()).fold(0.0, f64::max);
    assert!(mean > 0.0 && spread < 0.02, "{mean} {spread}");
}

/// The comparisons above can fail.
#[test]
fn a_wrong_sum_is_seen() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(5);
    let mut case = Case::new(Ndf::Ggx, true, true, 70, &mut random).with_visibility(1, &mut random);
    let found = case.render(gpu);
    assert!(case.worst(&found) < TOLERANCE);
    case.given.visibility[5] ^= 0xffff_ffff;
    assert!(case.worst(&found) > 0.05, "bits of one pixel turned over");
    case.given.visibility[5] ^= 0xffff_ffff;
    case.scene.ndf = Ndf::Phong;
    assert!(case.worst(&found) > 0.1, "another distribution");
    case.scene.ndf = Ndf::Ggx;
    case.normal_map = false;
    assert!(case.worst(&found) > 0.1, "no test of sides");
    case.normal_map = true;
    let last = case.given.lights.len() - 1;
    case.given.lights[last].flux *= 1.5;
    assert!(case.worst(&found) > TOLERANCE, "the last light is brighter");
}

/// Any bits in the packed words, lights upon pixels, of no and of absurd strength: the safety net in [`run`] finds nothing that must not be.
#[test]
fn extremes_stay_finite() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(6);
    for round in 0..12 {
        let ndf = if round % 2 == 0 { Ndf::Ggx } else { Ndf::Phong };
        let mut case = Case::new(ndf, true, round % 3 == 0, 64, &mut random);
        for pixel in &mut case.given.pixels {
            let depth = [pixel.depth, 0.0, 1e-7, 1.0][(random.next() * 4.0) as usize];
            // The camera sees from no surface's back; the rest is any.
            *pixel = Pixel {
                depth,
                core: [random.word(), random.word()],
                specular: random.word() & 0xffff_0000,
                geometric_normal: random.word(),
            };
        }
        let camera = view(&case.scene);
        for (index, light) in case.given.lights.iter_mut().enumerate() {
            let pixel = (random.next() * PIXELS as f64) as usize;
            let on = position(&camera, pixel, case.given.pixels[pixel].depth.max(1e-7));
            light.position = if index % 2 == 0 { on.as_vec3() } else { (on + random.direction() * 1e-6).as_vec3() };
            light.flux = Vec3::splat([1e24, 1e-30, 0.0, 1.0][index % 4]) * Vec3::new(1.0, 0.0, 0.5);
            light.core.x = random.word();
            light.core.y = random.word();
            light.specular = random.word() & 0xffff_0000;
            light.geometric_normal = random.word();
            light.direction_to_source = random.direction().as_vec3();
        }
        case.clamp = (round % 4 == 1).then_some(0.0);
        case.interleave = [1, 4][round / 2 % 2];
        let found = case.render(gpu);
        assert!(found.iter().all(|radiance| radiance.min_element() >= 0.0 && radiance.max_element() <= 65504.0));
    }
}

#[test]
fn nothing_seen_is_black() {
    let Some(gpu) = gpu() else { return };
    let mut case = Case::new(Ndf::Ggx, true, false, 33, &mut Random(7));
    case.given.pixels.iter_mut().for_each(|pixel| pixel.depth = 0.0);
    assert!(case.render(gpu).iter().all(|radiance| *radiance == DVec3::ZERO));
}
