//! Surfaces as the passes shade them: textures, normal maps, both sides (see the conventions of `lobelia::surface` in WGSL).

use crate::geometry::{Geometry, Hit, Segment};
use glam::{DVec2, DVec3, DVec4, Vec2};
use lobelia_lobes::{
    brdf::{Brdf, Distribution},
    tonemap::srgb_decode,
};
use lobelia_scene::{Material, Mesh, Ndf, Sampler, Scene, Texture, TextureRef, Wrap};

/// A point of a surface, seen from somewhere.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Scene space, metres.
    pub position: DVec3,
    /// Unit shading normal with the normal map, on the viewer's side.
    pub normal: DVec3,
    /// Unit interpolated normal, on the viewer's side.
    pub geometric_normal: DVec3,
    /// Unit normal of the triangle, on the side of its front.
    pub true_normal: DVec3,
    /// Reflectance.
    pub brdf: Brdf,
    /// Radiance that leaves towards the viewer by emission.
    pub emitted: DVec3,
    /// Whether `emitted` is a colour that only the eye sees, and the surface reflects nothing.
    pub unlit: bool,
}

/// A point of a triangle, as its vertices give it.
#[derive(Clone, Copy, Debug)]
struct Interpolated {
    /// Both sets of texture coordinates.
    uvs: [DVec2; 2],
    color: DVec4,
}

/// Reads a scene's surfaces.
pub struct Surfaces {
    distribution: Distribution,
    textures: Vec<Decoded>,
}

/// A texture as linear numbers for both ways of reading it.
struct Decoded {
    size: [i64; 2],
    raw: Vec<[f32; 4]>,
    linear: Vec<[f32; 4]>,
}

impl Decoded {
    fn new(texture: &Texture) -> Self {
        let table: Vec<f32> = (0..=255u32).map(|value| srgb_decode(f64::from(value) / 255.0) as f32).collect();
        let texel = |bytes: &[u8]| [0, 1, 2, 3].map(|channel| f32::from(bytes[channel]) / 255.0);
        let decoded = |bytes: &[u8]| {
            [table[usize::from(bytes[0])], table[usize::from(bytes[1])], table[usize::from(bytes[2])], f32::from(bytes[3]) / 255.0]
        };
        Self {
            size: [i64::from(texture.width), i64::from(texture.height)],
            raw: texture.rgba.chunks_exact(4).map(texel).collect(),
            linear: texture.rgba.chunks_exact(4).map(decoded).collect(),
        }
    }

    fn sample(&self, sampler: Sampler, uv: DVec2, srgb: bool) -> DVec4 {
        let texels = if srgb { &self.linear } else { &self.raw };
        let fetch = |x: i64, y: i64| {
            let (x, y) = (wrapped(x, self.size[0], sampler.wrap_u), wrapped(y, self.size[1], sampler.wrap_v));
            let [r, g, b, a] = texels[(y * self.size[0] + x) as usize];
            DVec4::new(r.into(), g.into(), b.into(), a.into())
        };
        // Far outside the image whole numbers no longer fit; what repeats may as well start anew.
        let uv = if uv.is_finite() { DVec2::new(uv.x % 65536.0, uv.y % 65536.0) } else { DVec2::ZERO };
        let at = uv * DVec2::new(self.size[0] as f64, self.size[1] as f64);
        if sampler.nearest {
            return fetch(at.x.floor() as i64, at.y.floor() as i64);
        }
        let at = at - 0.5;
        let (low, part) = (at.floor(), at - at.floor());
        let (x, y) = (low.x as i64, low.y as i64);
        let top = fetch(x, y).lerp(fetch(x + 1, y), part.x);
        top.lerp(fetch(x, y + 1).lerp(fetch(x + 1, y + 1), part.x), part.y)
    }
}

fn wrapped(index: i64, size: i64, wrap: Wrap) -> i64 {
    match wrap {
        Wrap::Repeat => index.rem_euclid(size),
        Wrap::Clamp => index.clamp(0, size - 1),
        Wrap::Mirror => {
            let turn = index.rem_euclid(2 * size);
            if turn < size { turn } else { 2 * size - 1 - turn }
        }
    }
}

impl Surfaces {
    /// Decodes the scene's textures.
    pub fn new(scene: &Scene) -> Self {
        let distribution = match scene.ndf {
            Ndf::Ggx => Distribution::Ggx,
            Ndf::Phong => Distribution::Phong,
        };
        Self { distribution, textures: scene.textures.iter().map(Decoded::new).collect() }
    }

    fn texel(&self, texture: Option<TextureRef>, at: &Interpolated, srgb: bool) -> DVec4 {
        let [first, second] = at.uvs;
        texture
            .map_or(DVec4::ONE, |reference| self.textures[reference.texture].sample(reference.sampler, reference.uv(first, second), srgb))
    }

    /// Colour and alpha of a material's texture and the mesh's vertices.
    fn base(&self, material: &Material, at: &Interpolated) -> DVec4 {
        self.texel(material.base_color_texture, at, true) * at.color
    }

    /// Whether a material's cut-out has a hole at a point.
    fn is_cut_out(&self, material: &Material, at: &Interpolated) -> bool {
        match material.alpha_mode {
            lobelia_scene::AlphaMode::Opaque => false,
            lobelia_scene::AlphaMode::Mask { cutoff } => self.base(material, at).w < f64::from(cutoff),
        }
    }

    /// The surface at a hit; `None` in the hole of a cut-out.
    pub(crate) fn at(&self, scene: &Scene, geometry: &Geometry, segment: &Segment, hit: &Hit) -> Option<Surface> {
        let triangle = &geometry.triangles[hit.triangle];
        let instance = &scene.instances[triangle.instance];
        let mesh = &scene.meshes[instance.mesh];
        let material = &scene.materials[triangle.material];
        let (weights, position) = geometry.locate(hit.triangle, segment);
        let (face, frame) = (&geometry.faces[hit.triangle], &geometry.frames[triangle.instance]);
        let corner = face.vertices.map(|vertex| vertex as usize);
        let uv = &interpolated(mesh, face.vertices, weights);
        if self.is_cut_out(material, uv) {
            return None;
        }
        let local: DVec3 = corner.iter().zip(weights).map(|(vertex, weight)| mesh.normals[*vertex].as_dvec3() * weight).sum();
        let tangent: DVec4 = corner
            .iter()
            .zip(weights)
            .map(|(vertex, weight)| mesh.tangents.get(*vertex).copied().unwrap_or_default().as_dvec4() * weight)
            .sum();
        let to_viewer = -segment.direction;
        let true_normal = face.normal;
        let unturned = (frame.normal * local).normalize_or(to_viewer);
        let mut shading = unturned;
        if let (Some(_), true) = (material.normal_texture, tangent.w != 0.0 && material.normal_scale != 0.0) {
            let scale = f64::from(material.normal_scale);
            let texel = self.texel(material.normal_texture, uv, false).truncate();
            let t = (texel * 2.0 - 1.0) * DVec3::new(scale, scale, 1.0);
            let axis = (frame.linear * tangent.truncate()).normalize_or_zero();
            let handedness = tangent.w.signum() * if frame.mirrored { -1.0 } else { 1.0 };
            shading = (axis * t.x + unturned.cross(axis) * handedness * t.y + unturned * t.z).normalize_or(unturned);
        }
        let side = if unturned.dot(to_viewer) >= 0.0 { 1.0 } else { -1.0 };
        let base = material.base_color.as_dvec3() * self.base(material, uv).truncate();
        let (normal, geometric_normal) = (shading * side, unturned * side);
        if material.unlit {
            let brdf = Brdf::new(DVec3::ZERO, 0.0, 1.0, 0.0, self.distribution);
            return Some(Surface { position, normal, geometric_normal, true_normal, brdf, emitted: base, unlit: true });
        }
        let rough = self.texel(material.metallic_roughness_texture, uv, false);
        let roughness = (f64::from(material.roughness) * rough.y).clamp(0.0, 1.0);
        let metallic = (f64::from(material.metallic) * rough.z).clamp(0.0, 1.0);
        let (specular, dielectric) = (f64::from(material.specular), material.dielectric);
        // In f32 0.04 is not 0.04.
        let brdf = if dielectric == Material::DIELECTRIC {
            Brdf::new(base, metallic, roughness, specular, self.distribution)
        } else {
            Brdf::with_dielectric(base, metallic, roughness, specular, dielectric.as_dvec4(), self.distribution)
        };
        let emitted = if true_normal.dot(to_viewer) > 0.0 {
            material.emissive.as_dvec3() * self.texel(material.emissive_texture, uv, true).truncate()
        } else {
            DVec3::ZERO
        };
        Some(Surface { position, normal, geometric_normal, true_normal, brdf, emitted, unlit: false })
    }

    /// Mean emitted radiance of a triangle over its front: what an emissive triangle is sampled by.
    pub(crate) fn mean_emission(&self, scene: &Scene, geometry: &Geometry, triangle: usize) -> DVec3 {
        let material = &scene.materials[geometry.triangles[triangle].material];
        if !material.emits() {
            return DVec3::ZERO;
        }
        let points = [[1.0 / 3.0; 3], [0.6, 0.2, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6]];
        let colour: DVec3 = points
            .iter()
            .map(|weights| self.texel(material.emissive_texture, &self.uv(scene, geometry, triangle, *weights), true).truncate())
            .sum();
        material.emissive.as_dvec3() * colour / points.len() as f64
    }

    /// Emitted radiance at a point of a triangle's front.
    pub(crate) fn emission(&self, scene: &Scene, geometry: &Geometry, triangle: usize, weights: [f64; 3]) -> DVec3 {
        let material = &scene.materials[geometry.triangles[triangle].material];
        material.emissive.as_dvec3() * self.texel(material.emissive_texture, &self.uv(scene, geometry, triangle, weights), true).truncate()
    }

    fn uv(&self, scene: &Scene, geometry: &Geometry, triangle: usize, weights: [f64; 3]) -> Interpolated {
        let mesh = &scene.meshes[scene.instances[geometry.triangles[triangle].instance].mesh];
        interpolated(mesh, geometry.faces[triangle].vertices, weights)
    }
}

fn interpolated(mesh: &Mesh, vertices: [u32; 3], weights: [f64; 3]) -> Interpolated {
    let corners = || vertices.iter().map(|vertex| *vertex as usize).zip(weights);
    let uv = |set: &[Vec2]| corners().map(|(vertex, weight)| set.get(vertex).copied().unwrap_or(Vec2::ZERO).as_dvec2() * weight).sum();
    let second = if mesh.second_uvs.is_empty() { DVec2::ZERO } else { uv(&mesh.second_uvs) };
    let color =
        if mesh.colors.is_empty() { DVec4::ONE } else { corners().map(|(vertex, weight)| mesh.colors[vertex].as_dvec4() * weight).sum() };
    Interpolated { uvs: [uv(&mesh.uvs), second], color }
}
