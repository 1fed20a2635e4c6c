//! A scene on the device.
//!
//! The structs here mirror `shaders/lobelia/scene.wgsl`. All positions are in scene space (world minus [`Scene::origin`], taken in `f64`).

use crate::{AlphaMode, Camera, LightKind, Material, Sampler, Scene, SceneError, SceneTraits, Texture, TextureRef, Wrap};
use bytemuck::{Pod, Zeroable};
use encase::{ShaderType, StorageBuffer, UniformBuffer};
use glam::{DMat4, DVec3, DVec4, Mat4, Vec2, Vec3, Vec4};
use half::f16;
use std::{collections::HashMap, sync::Arc};

/// The camera of one frame, as shaders see it.
#[derive(Clone, Copy, Debug, PartialEq, ShaderType)]
pub struct ViewUniform {
    /// Reverse Z, infinite far plane: depth is `near / view depth`.
    pub clip_from_scene: Mat4,
    /// That of the frame before, without jitter differences removed.
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
    /// Unused.
    pub padding: u32,
    /// Pixels.
    pub extent: Vec2,
    /// Added to sample positions, pixels.
    pub jitter: Vec2,
}

impl ViewUniform {
    /// The view of `camera` over a picture of `extent` pixels; the aspect ratio is the picture's. `jitter` moves the sample position within each
    /// pixel, in pixels, y down.
    pub fn new(camera: &Camera, origin: DVec3, extent: [u32; 2], jitter: Vec2, frame: u32, seed: u32, previous: Option<&ViewUniform>) -> Self {
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
            padding: 0,
            extent: Vec2::new(width as f32, height as f32),
            jitter,
        }
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
struct InstanceUniform {
    scene_from_local: Mat4,
    normal_column_x: Vec4,
    normal_column_y: Vec4,
    normal_column_z: Vec4,
}

#[derive(Clone, Copy, Debug, ShaderType)]
struct MaterialUniform {
    base_color: Vec3,
    metallic: f32,
    emissive: Vec3,
    roughness: f32,
    specular: f32,
    normal_scale: f32,
    alpha_cutoff: f32,
    flags: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    tangent: [f32; 4],
    uv: [f32; 2],
}

/// A run of an index buffer drawn with one material.
#[derive(Clone, Copy, Debug)]
struct Draw {
    material: usize,
    first_index: u32,
    index_count: u32,
    base_vertex: i32,
    instance: u32,
}

/// A scene's buffers, textures and draw list.
pub struct GpuScene {
    /// Uniform [`ViewUniform`].
    pub view: wgpu::Buffer,
    /// Storage array of punctual lights, one element at least.
    pub lights: wgpu::Buffer,
    /// Number of lights.
    pub light_count: u32,
    /// Storage array of instances, indexed by `instance_index`.
    pub instances: wgpu::Buffer,
    /// Layout of material bind groups: 0 uniform material; 1 to 4 textures base colour, metallic-roughness, normal, emission; 5 to 8 their samplers.
    pub material_layout: wgpu::BindGroupLayout,
    /// Equirectangular environment radiance, scale included, `rgba16float`; one black texel without an environment.
    pub environment: wgpu::TextureView,
    /// Facts.
    pub traits: SceneTraits,
    /// The scene itself.
    pub scene: Arc<Scene>,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    materials: Vec<wgpu::BindGroup>,
    draws: Vec<Draw>,
}

const VERTEX_ATTRIBUTES: [wgpu::VertexAttribute; 4] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x4, 3 => Float32x2];

/// WebGPU's default limit on a buffer.
const MAX_BUFFER: u64 = 256 << 20;

impl GpuScene {
    /// Uploads a scene.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: Arc<Scene>) -> Result<Self, SceneError> {
        let (vertex_data, index_data, ranges) = geometry(&scene);
        let buffer = |label: &str, bytes: &[u8], usage: wgpu::BufferUsages| -> Result<wgpu::Buffer, SceneError> {
            let size = (bytes.len().max(16) as u64).next_multiple_of(16);
            if size > MAX_BUFFER {
                let what = format!("its {label} take {} MiB; at most {} MiB fit a WebGPU buffer", size >> 20, MAX_BUFFER >> 20);
                return Err(SceneError::content(&scene.name, what));
            }
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            let buffer = device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false });
            queue.write_buffer(&buffer, 0, bytes);
            Ok(buffer)
        };
        let vertices = buffer("vertices", bytemuck::cast_slice(&vertex_data), wgpu::BufferUsages::VERTEX)?;
        let indices = buffer("indices", bytemuck::cast_slice(&index_data), wgpu::BufferUsages::INDEX)?;
        let view = buffer("view", &vec![0; ViewUniform::min_size().get() as usize], wgpu::BufferUsages::UNIFORM)?;
        let lights = buffer("lights", &light_bytes(&scene), wgpu::BufferUsages::STORAGE)?;
        let instances = buffer("instances", &instance_bytes(&scene), wgpu::BufferUsages::STORAGE)?;
        let material_layout = material_layout(device);
        let materials = Materials::new(device, queue, &scene).bind_groups(device, queue, &material_layout, &scene);
        let mut draws: Vec<Draw> = scene
            .instances
            .iter()
            .enumerate()
            .map(|(instance, placed)| {
                let (first_index, index_count, base_vertex) = ranges[placed.mesh];
                Draw { material: scene.meshes[placed.mesh].material, first_index, index_count, base_vertex, instance: instance as u32 }
            })
            .collect();
        // Changes of bind group cost more than anything else in a draw list.
        draws.sort_by_key(|draw| draw.material);
        Ok(Self {
            view,
            lights,
            light_count: scene.lights.len() as u32,
            instances,
            material_layout,
            environment: environment_view(device, queue, &scene),
            traits: scene.traits(),
            vertices,
            indices,
            materials,
            draws,
            scene,
        })
    }

    /// Writes the camera of the next frame.
    pub fn set_view(&self, queue: &wgpu::Queue, view: &ViewUniform) {
        let mut bytes = UniformBuffer::new(Vec::<u8>::new());
        if bytes.write(view).is_ok() {
            queue.write_buffer(&self.view, 0, bytes.as_ref());
        }
    }

    /// Takes over a scene that [`Scene::set_time`] moved: instances and lights are written anew. It must be the same scene otherwise.
    pub fn update(&mut self, queue: &wgpu::Queue, scene: Arc<Scene>) {
        queue.write_buffer(&self.lights, 0, &light_bytes(&scene));
        queue.write_buffer(&self.instances, 0, &instance_bytes(&scene));
        self.scene = scene;
    }

    /// Position (location 0), normal (1), tangent (2), texture coordinates (3), interleaved.
    pub fn vertex_layout() -> wgpu::VertexBufferLayout<'static> {
        wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &VERTEX_ATTRIBUTES,
        }
    }

    /// Draws everything; the pipeline and its other groups are set by the caller. Materials are bound at `material_group`.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, material_group: u32) {
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        let mut bound = None;
        for draw in &self.draws {
            if bound != Some(draw.material) {
                pass.set_bind_group(material_group, &self.materials[draw.material], &[]);
                bound = Some(draw.material);
            }
            let indices = draw.first_index..draw.first_index + draw.index_count;
            pass.draw_indexed(indices, draw.base_vertex, draw.instance..draw.instance + 1);
        }
    }
}

/// First index, index count, base vertex.
type Range = (u32, u32, i32);

/// All meshes in one vertex and one index buffer.
fn geometry(scene: &Scene) -> (Vec<Vertex>, Vec<u32>, Vec<Range>) {
    let (mut vertices, mut indices, mut ranges) = (Vec::new(), Vec::new(), Vec::new());
    for mesh in scene.meshes.iter() {
        ranges.push((indices.len() as u32, mesh.indices.len() as u32, vertices.len() as i32));
        indices.extend_from_slice(&mesh.indices);
        for vertex in 0..mesh.positions.len() {
            vertices.push(Vertex {
                position: mesh.positions[vertex].to_array(),
                normal: mesh.normals[vertex].to_array(),
                tangent: mesh.tangents[vertex].to_array(),
                uv: mesh.uvs[vertex].to_array(),
            });
        }
    }
    (vertices, indices, ranges)
}

fn light_bytes(scene: &Scene) -> Vec<u8> {
    let origin = scene.origin();
    let mut lights: Vec<LightUniform> = scene
        .lights
        .iter()
        .map(|light| {
            let (kind, cos_outer, spot_scale) = match light.kind {
                LightKind::Point => (0, -1.0, 0.0),
                LightKind::Spot { inner, outer } => (1, outer.cos(), 1.0 / (inner.cos() - outer.cos()).max(0.001)),
                LightKind::Directional => (2, -1.0, 0.0),
            };
            LightUniform {
                position: (light.position - origin).as_vec3(),
                kind,
                direction: light.direction.as_vec3(),
                cos_outer,
                intensity: light.intensity,
                spot_scale,
            }
        })
        .collect();
    if lights.is_empty() {
        // An empty array cannot be bound; a dark light changes nothing.
        lights.push(LightUniform { position: Vec3::ZERO, kind: 0, direction: Vec3::NEG_Y, cos_outer: -1.0, intensity: Vec3::ZERO, spot_scale: 0.0 });
    }
    storage_bytes(&lights)
}

fn instance_bytes(scene: &Scene) -> Vec<u8> {
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

fn storage_bytes<T: ShaderType + encase::ShaderSize + encase::internal::WriteInto>(values: &[T]) -> Vec<u8> {
    let mut bytes = StorageBuffer::new(Vec::<u8>::new());
    match bytes.write(&values) {
        Ok(()) => bytes.into_inner(),
        // Writing to a Vec fails only if it cannot grow, which aborts.
        Err(_) => Vec::new(),
    }
}

fn material_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding: u32, ty: wgpu::BindingType| wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let uniform =
        wgpu::BindingType::Buffer { ty: wgpu::BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: Some(MaterialUniform::min_size()) };
    let mut entries = vec![entry(0, uniform)];
    entries.extend((1..5).map(|binding| entry(binding, texture)));
    entries.extend((5..9).map(|binding| entry(binding, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering))));
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("material"), entries: &entries })
}

/// Textures and samplers that materials share.
struct Materials {
    white: wgpu::TextureView,
    flat_normal: wgpu::TextureView,
    /// By texture and whether it is read as sRGB.
    views: HashMap<(usize, bool), wgpu::TextureView>,
    samplers: HashMap<Sampler, wgpu::Sampler>,
}

impl Materials {
    fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Self {
        let single = |rgba: [u8; 4]| {
            let texture = Texture { name: "constant".into(), width: 1, height: 1, rgba: rgba.to_vec() };
            upload(device, queue, &texture, false)
        };
        let mut views = HashMap::new();
        let mut samplers = HashMap::from([(Sampler::default(), sampler(device, Sampler::default()))]);
        for material in &scene.materials {
            for (reference, srgb) in references(material) {
                if let Some(reference) = reference {
                    views.entry((reference.texture, srgb)).or_insert_with(|| upload(device, queue, &scene.textures[reference.texture], srgb));
                    samplers.entry(reference.sampler).or_insert_with(|| sampler(device, reference.sampler));
                }
            }
        }
        Self { white: single([255; 4]), flat_normal: single([128, 128, 255, 255]), views, samplers }
    }

    fn bind_groups(&self, device: &wgpu::Device, queue: &wgpu::Queue, layout: &wgpu::BindGroupLayout, scene: &Scene) -> Vec<wgpu::BindGroup> {
        scene.materials.iter().map(|material| self.bind_group(device, queue, layout, material)).collect()
    }

    fn bind_group(&self, device: &wgpu::Device, queue: &wgpu::Queue, layout: &wgpu::BindGroupLayout, material: &Material) -> wgpu::BindGroup {
        let mut bytes = UniformBuffer::new(Vec::<u8>::new());
        let _ = bytes.write(&MaterialUniform {
            base_color: material.base_color,
            metallic: material.metallic,
            emissive: material.emissive,
            roughness: material.roughness,
            specular: material.specular,
            normal_scale: if material.normal_texture.is_some() { material.normal_scale } else { 0.0 },
            alpha_cutoff: match material.alpha_mode {
                AlphaMode::Opaque => 0.0,
                AlphaMode::Mask { cutoff } => cutoff,
            },
            flags: 0,
        });
        let bytes = bytes.into_inner();
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(&material.name),
            size: bytes.len() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&uniform, 0, &bytes);
        let mut entries = vec![wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }];
        for (index, (reference, srgb)) in references(material).into_iter().enumerate() {
            let absent = if index == 2 { &self.flat_normal } else { &self.white };
            let view = reference.and_then(|reference| self.views.get(&(reference.texture, srgb))).unwrap_or(absent);
            let sampler = self.samplers.get(&reference.map(|reference| reference.sampler).unwrap_or_default());
            entries.push(wgpu::BindGroupEntry { binding: 1 + index as u32, resource: wgpu::BindingResource::TextureView(view) });
            if let Some(sampler) = sampler {
                entries.push(wgpu::BindGroupEntry { binding: 5 + index as u32, resource: wgpu::BindingResource::Sampler(sampler) });
            }
        }
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(&material.name), layout, entries: &entries })
    }
}

/// Base colour, metallic-roughness, normal, emission, each with whether it is sRGB.
fn references(material: &Material) -> [(Option<TextureRef>, bool); 4] {
    [
        (material.base_color_texture, true),
        (material.metallic_roughness_texture, false),
        (material.normal_texture, false),
        (material.emissive_texture, true),
    ]
}

fn sampler(device: &wgpu::Device, sampler: Sampler) -> wgpu::Sampler {
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
    };
    let filter = if sampler.nearest { wgpu::FilterMode::Nearest } else { wgpu::FilterMode::Linear };
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("material"),
        address_mode_u: wrap(sampler.wrap_u),
        address_mode_v: wrap(sampler.wrap_v),
        mag_filter: filter,
        min_filter: filter,
        ..Default::default()
    })
}

fn upload(device: &wgpu::Device, queue: &wgpu::Queue, texture: &Texture, srgb: bool) -> wgpu::TextureView {
    let format = if srgb { wgpu::TextureFormat::Rgba8UnormSrgb } else { wgpu::TextureFormat::Rgba8Unorm };
    create(device, queue, &texture.name, [texture.width, texture.height], format, &texture.rgba)
}

fn environment_view(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> wgpu::TextureView {
    let half = |value: f32| f16::from_f32(value.clamp(0.0, 65504.0)).to_le_bytes();
    let (extent, bytes) = match &scene.environment {
        Some(environment) => {
            let texels = environment.pixels.iter().map(|pixel| *pixel * environment.scale);
            let bytes = texels.flat_map(|pixel| [pixel.x, pixel.y, pixel.z, 1.0]).flat_map(half).collect();
            ([environment.width, environment.height], bytes)
        }
        None => ([1, 1], vec![0; 8]),
    };
    create(device, queue, "environment", extent, wgpu::TextureFormat::Rgba16Float, &bytes)
}

fn create(device: &wgpu::Device, queue: &wgpu::Queue, label: &str, extent: [u32; 2], format: wgpu::TextureFormat, bytes: &[u8]) -> wgpu::TextureView {
    let size = wgpu::Extent3d { width: extent[0], height: extent[1], depth_or_array_layers: 1 };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let pitch = extent[0] * format.block_copy_size(None).unwrap_or(4);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch), rows_per_image: Some(extent[1]) };
    queue.write_texture(texture.as_image_copy(), bytes, layout, size);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
