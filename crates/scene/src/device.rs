//! A scene on the device.
//!
//! The structs here mirror `shaders/lobelia/scene.wgsl`. All positions are in scene space (world minus [`Scene::origin`], taken in `f64`).

mod material;
#[cfg(test)]
mod tests;
mod uniform;

pub use uniform::ViewUniform;

use crate::{Scene, SceneError, SceneTraits};
use bytemuck::{Pod, Zeroable};
use encase::ShaderType;
use material::{Materials, environment_view, material_layout};
use std::{cell::Cell, sync::Arc};
use uniform::{area_light_bytes, instance_bytes, light_bytes, view_bytes};

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
    /// Storage array of area lights (`lobelia::area_light::AreaLight`), one element at least.
    pub area_lights: wgpu::Buffer,
    /// Storage array of `vec4f`: corners of flat lights in scene space, one element at least. They run counter-clockwise as seen from the side that emits.
    pub area_light_vertices: wgpu::Buffer,
    /// Number of area lights.
    pub area_light_count: u32,
    /// Storage array of instances, indexed by `instance_index`.
    pub instances: wgpu::Buffer,
    /// Layout of material bind groups: 0 uniform material; 1 to 4 textures base colour, metallic-roughness, normal, emission; 5 to 8 their samplers.
    pub material_layout: wgpu::BindGroupLayout,
    /// Equirectangular environment radiance, scale and [`GpuScene::pre_exposure`] included, `rgba16float`; one black texel without an environment.
    pub environment: wgpu::TextureView,
    /// Facts.
    pub traits: SceneTraits,
    /// The scene itself.
    pub scene: Arc<Scene>,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    materials: Vec<wgpu::BindGroup>,
    draws: Vec<Draw>,
    /// The last view, without what does not move the camera, and how often it or the scene changed.
    seen: Cell<Option<ViewUniform>>,
    version: Cell<u64>,
    pre_exposure: f32,
    seen_size: f64,
}

const VERTEX_ATTRIBUTES: [wgpu::VertexAttribute; 4] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x4, 3 => Float32x2];

/// WebGPU's default limit on a buffer, bytes.
const MAX_BUFFER: u64 = 256 << 20;

/// WebGPU's default limit on what one storage binding sees, bytes.
const MAX_STORAGE: u64 = 128 << 20;

impl GpuScene {
    /// Uploads a scene.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: Arc<Scene>) -> Result<Self, SceneError> {
        let (vertex_data, index_data, ranges) = geometry(&scene);
        let buffer = |label: &str, bytes: &[u8], usage: wgpu::BufferUsages| -> Result<wgpu::Buffer, SceneError> {
            let size = (bytes.len().max(16) as u64).next_multiple_of(16);
            let limit = if usage.contains(wgpu::BufferUsages::STORAGE) { MAX_STORAGE } else { MAX_BUFFER };
            if size > limit {
                let what = format!("its {label} take {} MiB; at most {} MiB fit a WebGPU buffer", size >> 20, limit >> 20);
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
        let seen = scene.seen_points();
        let pre_exposure = scene.pre_exposure_for(&seen);
        let seen_size = scene.size_of(seen);
        let lights = buffer("lights", &light_bytes(&scene, pre_exposure), wgpu::BufferUsages::STORAGE)?;
        let (area_lights, area_light_vertices) = area_light_bytes(&scene, pre_exposure);
        let area_lights = buffer("area lights", &area_lights, wgpu::BufferUsages::STORAGE)?;
        let area_light_vertices = buffer("corners of area lights", &area_light_vertices, wgpu::BufferUsages::STORAGE)?;
        let instances = buffer("instances", &instance_bytes(&scene), wgpu::BufferUsages::STORAGE)?;
        let material_layout = material_layout(device);
        let materials = Materials::new(device, queue, &scene).bind_groups(device, queue, &material_layout, &scene, pre_exposure);
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
            area_lights,
            area_light_vertices,
            area_light_count: scene.area_lights.len() as u32,
            instances,
            material_layout,
            environment: environment_view(device, queue, &scene, pre_exposure),
            traits: scene.traits(),
            vertices,
            indices,
            materials,
            draws,
            scene,
            seen: Cell::new(None),
            version: Cell::new(0),
            pre_exposure,
            seen_size,
        })
    }

    /// What radiance, flux and everything else in proportion to light is multiplied by on the device: a power of two, [`Scene::pre_exposure`] of the scene as
    /// it was uploaded. It stays the same as long as this lives, animations included, so that histories keep their meaning.
    pub fn pre_exposure(&self) -> f32 {
        self.pre_exposure
    }

    /// [`Scene::seen_size`] of the scene as it was uploaded, metres: what lengths are small or large against.
    pub fn seen_size(&self) -> f64 {
        self.seen_size
    }

    /// How often scene or camera changed. What a pass has gathered over frames is of another picture if this is not what it was.
    pub fn picture_version(&self) -> u64 {
        self.version.get()
    }

    /// The camera of the next frame, if one was set: without jitter, frame and seed.
    pub fn camera(&self) -> Option<ViewUniform> {
        self.seen.get()
    }

    /// Writes the camera of the next frame.
    pub fn set_view(&self, queue: &wgpu::Queue, view: &ViewUniform) {
        let camera = view.camera_only();
        if self.seen.replace(Some(camera)) != Some(camera) {
            self.version.set(self.version.get() + 1);
        }
        queue.write_buffer(&self.view, 0, &view_bytes(&ViewUniform { pre_exposure: self.pre_exposure, ..*view }));
    }

    /// Takes over a scene that [`Scene::set_time`] moved: instances and lights are written anew. It must be the same scene otherwise.
    pub fn update(&mut self, queue: &wgpu::Queue, scene: Arc<Scene>) {
        queue.write_buffer(&self.lights, 0, &light_bytes(&scene, self.pre_exposure));
        let (area_lights, area_light_vertices) = area_light_bytes(&scene, self.pre_exposure);
        queue.write_buffer(&self.area_lights, 0, &area_lights);
        queue.write_buffer(&self.area_light_vertices, 0, &area_light_vertices);
        queue.write_buffer(&self.instances, 0, &instance_bytes(&scene));
        self.version.set(self.version.get() + 1);
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
