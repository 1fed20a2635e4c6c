//! A scene on the device.
//!
//! The structs here mirror `shaders/lobelia/scene.wgsl`. All positions are in scene space (world minus [`Scene::origin`], taken in `f64`).

mod material;
#[cfg(test)]
mod tests;
mod uniform;

pub use uniform::ViewUniform;

use crate::{Mesh, Scene, SceneError, SceneTraits};
use bytemuck::{Pod, Zeroable};
use encase::ShaderType;
use glam::Vec4;
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
    /// Layout of material bind groups: 0 uniform material; 1 to 4 textures base colour, metallic-roughness, normal, emission; 5 to 8 their samplers; in
    /// scenes that transform textures or have second texture coordinates, 9 uniform transforms of these four.
    pub material_layout: wgpu::BindGroupLayout,
    /// Equirectangular environment radiance, scale and [`GpuScene::pre_exposure`] included, `rgba16float`; one black texel without an environment.
    pub environment: wgpu::TextureView,
    /// Facts.
    pub traits: SceneTraits,
    /// The scene itself.
    pub scene: Arc<Scene>,
    vertices: wgpu::Buffer,
    /// Of the vertices, where the scene has them.
    second_uvs: Option<wgpu::Buffer>,
    colors: Option<wgpu::Buffer>,
    indices: wgpu::Buffer,
    /// Where each mesh is in the buffers.
    ranges: Vec<Range>,
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

const SECOND_UV_ATTRIBUTES: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![4 => Float32x2];

const COLOR_ATTRIBUTES: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![5 => Unorm16x4];

/// WebGPU's default limit on a buffer, bytes.
const MAX_BUFFER: u64 = 256 << 20;

/// WebGPU's default limit on what one storage binding sees, bytes.
const MAX_STORAGE: u64 = 128 << 20;

impl GpuScene {
    /// Uploads a scene.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: Arc<Scene>) -> Result<Self, SceneError> {
        let traits = scene.traits();
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
        let vertex = wgpu::BufferUsages::VERTEX;
        let second_uvs = traits.second_uvs.then(|| buffer("second texture coordinates", &second_uv_bytes(&scene), vertex)).transpose()?;
        let colors = traits.vertex_colors.then(|| buffer("vertex colours", &color_bytes(&scene), vertex)).transpose()?;
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
        let material_layout = material_layout(device, traits.texture_transforms);
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
            traits,
            vertices,
            second_uvs,
            colors,
            indices,
            ranges,
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

    /// Takes over a scene that [`Scene::set_time`] moved: instances, lights and the vertices of meshes that joints or morph targets moved are written
    /// anew. It must be the same scene otherwise.
    pub fn update(&mut self, queue: &wgpu::Queue, scene: Arc<Scene>) {
        queue.write_buffer(&self.lights, 0, &light_bytes(&scene, self.pre_exposure));
        let (area_lights, area_light_vertices) = area_light_bytes(&scene, self.pre_exposure);
        queue.write_buffer(&self.area_lights, 0, &area_lights);
        queue.write_buffer(&self.area_light_vertices, 0, &area_light_vertices);
        queue.write_buffer(&self.instances, 0, &instance_bytes(&scene));
        for mesh in scene.moved_meshes(&self.scene) {
            let (_, _, first_vertex) = self.ranges[mesh];
            let offset = first_vertex as u64 * size_of::<Vertex>() as u64;
            queue.write_buffer(&self.vertices, offset, bytemuck::cast_slice(&vertices(&scene.meshes[mesh])));
        }
        self.version.set(self.version.get() + 1);
        self.scene = scene;
    }

    /// Position (location 0), normal (1), tangent (2), texture coordinates (3), interleaved; then, each in a buffer of its own where the scene has them,
    /// second texture coordinates (4) and colours (5).
    pub fn vertex_layouts(&self) -> Vec<wgpu::VertexBufferLayout<'static>> {
        let layout = |array_stride: usize, attributes: &'static [wgpu::VertexAttribute]| wgpu::VertexBufferLayout {
            array_stride: array_stride as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes,
        };
        let mut layouts = vec![layout(size_of::<Vertex>(), &VERTEX_ATTRIBUTES)];
        layouts.extend(self.second_uvs.as_ref().map(|_| layout(8, &SECOND_UV_ATTRIBUTES)));
        layouts.extend(self.colors.as_ref().map(|_| layout(8, &COLOR_ATTRIBUTES)));
        layouts
    }

    /// Draws everything; the pipeline and its other groups are set by the caller. Materials are bound at `material_group`.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, material_group: u32) {
        let optional = [&self.second_uvs, &self.colors].into_iter().flatten();
        for (slot, buffer) in std::iter::once(&self.vertices).chain(optional).enumerate() {
            pass.set_vertex_buffer(slot as u32, buffer.slice(..));
        }
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
    let (mut all, mut indices, mut ranges) = (Vec::new(), Vec::new(), Vec::new());
    for mesh in scene.meshes.iter() {
        ranges.push((indices.len() as u32, mesh.indices.len() as u32, all.len() as i32));
        indices.extend_from_slice(&mesh.indices);
        all.extend(vertices(mesh));
    }
    (all, indices, ranges)
}

fn vertices(mesh: &Mesh) -> Vec<Vertex> {
    let vertex = |index: usize| Vertex {
        position: mesh.positions[index].to_array(),
        normal: mesh.normals[index].to_array(),
        tangent: mesh.tangents[index].to_array(),
        uv: mesh.uvs[index].to_array(),
    };
    (0..mesh.positions.len()).map(vertex).collect()
}

/// One pair of floats per vertex of all meshes; zeros where a mesh has no second set.
fn second_uv_bytes(scene: &Scene) -> Vec<u8> {
    let rows = scene.meshes.iter().flat_map(|mesh| (0..mesh.positions.len()).map(|vertex| mesh.second_uvs.get(vertex).copied()));
    rows.flat_map(|uv| uv.unwrap_or_default().to_array().map(f32::to_le_bytes)).flatten().collect()
}

/// Four 16-bit numbers per vertex of all meshes; white where a mesh has no colours.
fn color_bytes(scene: &Scene) -> Vec<u8> {
    let rows = scene.meshes.iter().flat_map(|mesh| (0..mesh.positions.len()).map(|vertex| mesh.colors.get(vertex).copied()));
    let channel = |value: f32| ((value.clamp(0.0, 1.0) * 65535.0).round() as u16).to_le_bytes();
    rows.flat_map(|color| color.unwrap_or(Vec4::ONE).to_array().map(channel)).flatten().collect()
}
