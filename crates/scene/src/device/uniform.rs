//! What shaders read, laid out as `shaders/lobelia/scene.wgsl` says.

use crate::{AlphaMode, AreaShape, Camera, LightKind, Material, Scene, TextureRef, UvSet};
use encase::{ShaderType, StorageBuffer, UniformBuffer};
use glam::{DMat3, DMat4, DVec3, DVec4, Mat4, Vec2, Vec3, Vec4};

/// The camera of one frame, as shaders see it.
#[derive(Clone, Copy, Debug, PartialEq, ShaderType)]
pub struct ViewUniform {
    /// Reverse Z, infinite far plane: depth is `near / view depth`.
    pub clip_from_scene: Mat4,
    /// That of the frame before, with the jitter of that frame.
    pub previous_clip_from_scene: Mat4,
    /// Camera, scene space.
    pub position: Vec3,
    /// Metres.
    pub near: f32,
    /// Unit.
    pub forward: Vec3,
    /// Frame index.
    pub frame: u32,
    /// Times `aspect * tan(yfov / 2)`.
    pub right: Vec3,
    /// Seed of everything random.
    pub seed: u32,
    /// Times `tan(yfov / 2)`.
    pub up: Vec3,
    /// [`super::GpuScene::pre_exposure`]; [`super::GpuScene::set_view`] fills it in.
    pub pre_exposure: f32,
    /// Pixels.
    pub extent: Vec2,
    /// Added to sample positions, pixels.
    pub jitter: Vec2,
}

impl ViewUniform {
    /// The view of `camera` over a picture of `extent` pixels; the aspect ratio is the picture's. `jitter` moves the sample position within each
    /// pixel, in pixels, y down.
    pub fn new(
        camera: &Camera,
        origin: DVec3,
        extent: [u32; 2],
        jitter: Vec2,
        frame: u32,
        seed: u32,
        previous: Option<&ViewUniform>,
    ) -> Self {
        let [width, height] = extent.map(f64::from);
        let tangent = (camera.yfov / 2.0).tan();
        let (scale_x, scale_y) = (tangent * width / height, tangent);
        let position = camera.position - origin;
        let row = |axis: DVec3| axis.extend(-axis.dot(position));
        let forward = row(camera.forward);
        // What lies at pixel centre + jitter must land on the pixel centre, where the rasteriser samples.
        let x = row(camera.right) / scale_x - forward * (2.0 * f64::from(jitter.x) / width);
        let y = row(camera.up) / scale_y + forward * (2.0 * f64::from(jitter.y) / height);
        let z = DVec4::new(0.0, 0.0, 0.0, camera.near);
        let clip_from_scene = DMat4::from_cols(x, y, z, forward).transpose().as_mat4();
        Self {
            clip_from_scene,
            previous_clip_from_scene: previous.map_or(clip_from_scene, |view| view.clip_from_scene),
            position: position.as_vec3(),
            near: camera.near as f32,
            forward: camera.forward.as_vec3(),
            frame,
            right: (camera.right * scale_x).as_vec3(),
            seed,
            up: (camera.up * scale_y).as_vec3(),
            pre_exposure: 1.0,
            extent: Vec2::new(width as f32, height as f32),
            jitter,
        }
    }

    /// What is the same in all frames of a camera that stands still: not the jitter and what depends on it, nor frame and seed.
    pub(super) fn camera_only(&self) -> Self {
        let (zero, jitter) = (Mat4::ZERO, Vec2::ZERO);
        Self { clip_from_scene: zero, previous_clip_from_scene: zero, jitter, frame: 0, seed: 0, ..*self }
    }
}

#[derive(Clone, Copy, Debug, ShaderType)]
struct LightUniform {
    position: Vec3,
    kind: u32,
    direction: Vec3,
    cos_outer: f32,
    intensity: Vec3,
    spot_scale: f32,
}

#[derive(Clone, Copy, Debug, ShaderType)]
struct AreaLightUniform {
    center: Vec3,
    kind: u32,
    axis_a: Vec3,
    first_vertex: u32,
    axis_b: Vec3,
    vertex_count: u32,
    axis_c: Vec3,
    two_sided: u32,
    radiance: Vec3,
    padding: u32,
}

#[derive(Clone, Copy, Debug, ShaderType)]
struct InstanceUniform {
    scene_from_local: Mat4,
    normal_column_x: Vec4,
    normal_column_y: Vec4,
    normal_column_z: Vec4,
}

#[derive(Clone, Copy, Debug, ShaderType)]
pub(super) struct MaterialUniform {
    base_color: Vec3,
    metallic: f32,
    emissive: Vec3,
    roughness: f32,
    specular: f32,
    normal_scale: f32,
    alpha_cutoff: f32,
    flags: u32,
    dielectric: Vec4,
}

#[derive(Clone, Copy, Debug, ShaderType)]
struct TextureTransformUniform {
    u_row: Vec4,
    v_row: Vec4,
}

#[derive(Clone, Copy, Debug, ShaderType)]
pub(super) struct TextureTransformsUniform {
    base_color: TextureTransformUniform,
    metallic_roughness: TextureTransformUniform,
    normal: TextureTransformUniform,
    emissive: TextureTransformUniform,
}

pub(super) fn light_bytes(scene: &Scene, pre_exposure: f32) -> Vec<u8> {
    let origin = scene.origin();
    let mut lights: Vec<LightUniform> = scene
        .lights
        .iter()
        .map(|light| {
            let (kind, cos_outer, spot_scale) = match light.kind {
                LightKind::Point => (0, -1.0, 0.0),
                LightKind::Spot { inner, outer } => {
                    // In f64: cosines of small angles are nearly equal.
                    let (cos_inner, cos_outer) = (f64::from(inner).cos(), f64::from(outer).cos());
                    (1, cos_outer as f32, (1.0 / (cos_inner - cos_outer).max(0.001)) as f32)
                }
                LightKind::Directional => (2, -1.0, 0.0),
            };
            LightUniform {
                position: (light.position - origin).as_vec3(),
                kind,
                direction: light.direction.as_vec3(),
                cos_outer,
                intensity: light.intensity * pre_exposure,
                spot_scale,
            }
        })
        .collect();
    if lights.is_empty() {
        // An empty array cannot be bound; a dark light changes nothing.
        lights.push(LightUniform {
            position: Vec3::ZERO,
            kind: 0,
            direction: Vec3::NEG_Y,
            cos_outer: -1.0,
            intensity: Vec3::ZERO,
            spot_scale: 0.0,
        });
    }
    storage_bytes(&lights)
}

/// Records of the area lights, and the corners of their outlines, one element each at least.
pub(super) fn area_light_bytes(scene: &Scene, pre_exposure: f32) -> (Vec<u8>, Vec<u8>) {
    let origin = scene.origin();
    let (mut lights, mut vertices) = (Vec::new(), Vec::new());
    for light in &scene.area_lights {
        let place = light.world_from_local;
        let axes = DMat3::from_mat4(place);
        let (kind, size) = match light.shape {
            AreaShape::Quad { .. } | AreaShape::Polygon { .. } => (0, 1.0),
            AreaShape::Disk { radius } => (1, f64::from(radius)),
            AreaShape::Sphere { radius } => (2, f64::from(radius)),
        };
        let first_vertex = vertices.len() as u32;
        let mut outline = light.shape.outline().unwrap_or_default();
        if axes.determinant() < 0.0 {
            // A mirrored light still emits towards where its local -Z is.
            outline.reverse();
        }
        vertices.extend(outline.iter().map(|vertex| {
            let world = place.transform_point3(vertex.as_dvec2().extend(0.0));
            (world - origin).as_vec3().extend(0.0)
        }));
        lights.push(AreaLightUniform {
            center: (place.transform_point3(DVec3::ZERO) - origin).as_vec3(),
            kind,
            axis_a: (axes.x_axis * size).as_vec3(),
            first_vertex,
            axis_b: (axes.y_axis * size).as_vec3(),
            vertex_count: outline.len() as u32,
            axis_c: (axes.z_axis * size).as_vec3(),
            two_sided: u32::from(light.two_sided),
            radiance: light.radiance * pre_exposure,
            padding: 0,
        });
    }
    if lights.is_empty() {
        let (zero, dark) = (Vec3::ZERO, 0);
        lights.push(AreaLightUniform {
            center: zero,
            kind: dark,
            axis_a: zero,
            first_vertex: 0,
            axis_b: zero,
            vertex_count: 0,
            axis_c: zero,
            two_sided: 0,
            radiance: zero,
            padding: 0,
        });
    }
    if vertices.is_empty() {
        vertices.push(Vec4::ZERO);
    }
    (storage_bytes(&lights), storage_bytes(&vertices))
}

pub(super) fn instance_bytes(scene: &Scene) -> Vec<u8> {
    let scene_from_world = DMat4::from_translation(-scene.origin());
    let instances: Vec<InstanceUniform> = scene
        .instances
        .iter()
        .map(|instance| {
            let matrix = scene_from_world * instance.world_from_local;
            let linear = glam::DMat3::from_mat4(matrix);
            let determinant = linear.determinant();
            // The cofactor matrix is the inverse transpose times the determinant: it exists for flattened instances too.
            let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
            let sign = if determinant < 0.0 { -1.0 } else { 1.0 };
            let cofactor = [y.cross(z), z.cross(x), x.cross(y)].map(|column| column * sign);
            // Only directions matter; a common scale keeps tiny and huge instances within floats.
            let largest = cofactor.iter().map(|column| column.abs().max_element()).fold(f64::MIN_POSITIVE, f64::max);
            let [cx, cy, cz] = cofactor.map(|column| (column / largest).as_vec3());
            InstanceUniform {
                scene_from_local: matrix.as_mat4(),
                normal_column_x: cx.extend(sign as f32),
                normal_column_y: cy.extend(0.0),
                normal_column_z: cz.extend(0.0),
            }
        })
        .collect();
    storage_bytes(&instances)
}

pub(super) fn view_bytes(view: &ViewUniform) -> Vec<u8> {
    uniform_bytes(view)
}

pub(super) fn material_bytes(material: &Material, pre_exposure: f32) -> Vec<u8> {
    uniform_bytes(&MaterialUniform {
        base_color: material.base_color,
        metallic: material.metallic,
        // What reflects nothing shows its base colour in the same units.
        emissive: if material.unlit { Vec3::splat(pre_exposure) } else { material.emissive * pre_exposure },
        roughness: material.roughness,
        specular: material.specular,
        normal_scale: if material.normal_texture.is_some() { material.normal_scale } else { 0.0 },
        alpha_cutoff: match material.alpha_mode {
            AlphaMode::Opaque => 0.0,
            AlphaMode::Mask { cutoff } => cutoff,
        },
        flags: u32::from(material.emits_both_ways) | u32::from(material.unlit) << 1,
        dielectric: material.dielectric,
    })
}

/// Where each texture of a material is read; the identity for those that it lacks.
pub(super) fn texture_transform_bytes(material: &Material) -> Vec<u8> {
    let [base_color, metallic_roughness, normal, emissive] = material.textures().map(|texture| {
        let TextureRef { uv_set, uv_transform: from, .. } = texture.unwrap_or_default();
        let (x, y, offset) = (from.matrix2.x_axis, from.matrix2.y_axis, from.translation);
        let set = if uv_set == UvSet::Second { 1.0 } else { 0.0 };
        TextureTransformUniform { u_row: Vec4::new(x.x, y.x, offset.x, set), v_row: Vec4::new(x.y, y.y, offset.y, 0.0) }
    });
    uniform_bytes(&TextureTransformsUniform { base_color, metallic_roughness, normal, emissive })
}

fn uniform_bytes<T: ShaderType + encase::internal::WriteInto>(value: &T) -> Vec<u8> {
    let mut bytes = UniformBuffer::new(Vec::<u8>::new());
    // Writing to a Vec fails only if it cannot grow, which aborts.
    let _ = bytes.write(value);
    bytes.into_inner()
}

fn storage_bytes<T: ShaderType + encase::ShaderSize + encase::internal::WriteInto>(values: &[T]) -> Vec<u8> {
    let mut bytes = StorageBuffer::new(Vec::<u8>::new());
    let _ = bytes.write(&values);
    bytes.into_inner()
}
