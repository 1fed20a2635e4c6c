//! Bind groups of materials, and the textures they read.

use super::uniform::{MaterialUniform, TextureTransformsUniform, material_bytes, texture_transform_bytes};
use crate::{Material, Sampler, Scene, Texture, TextureRef, Wrap};
use encase::ShaderType;
use half::f16;
use std::collections::HashMap;

/// `transforms` is whether textures are transformed or read at second coordinates.
pub(super) fn material_layout(device: &wgpu::Device, transforms: bool) -> wgpu::BindGroupLayout {
    let entry = |binding: u32, ty: wgpu::BindingType| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let uniform =
        |size| wgpu::BindingType::Buffer { ty: wgpu::BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: Some(size) };
    let mut entries = vec![entry(0, uniform(MaterialUniform::min_size()))];
    entries.extend((1..5).map(|binding| entry(binding, texture)));
    entries.extend((5..9).map(|binding| entry(binding, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering))));
    if transforms {
        entries.push(entry(9, uniform(TextureTransformsUniform::min_size())));
    }
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("material"), entries: &entries })
}

/// Textures and samplers that materials share.
pub(super) struct Materials {
    white: wgpu::TextureView,
    flat_normal: wgpu::TextureView,
    /// By texture and whether it is read as sRGB.
    views: HashMap<(usize, bool), wgpu::TextureView>,
    samplers: HashMap<Sampler, wgpu::Sampler>,
}

impl Materials {
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Self {
        let single = |rgba: [u8; 4]| {
            let texture = Texture { name: "constant".into(), width: 1, height: 1, rgba: rgba.to_vec() };
            upload(device, queue, &texture, false)
        };
        let mut views = HashMap::new();
        let mut samplers = HashMap::from([(Sampler::default(), sampler(device, Sampler::default()))]);
        for material in &scene.materials {
            for (reference, srgb) in references(material) {
                if let Some(reference) = reference {
                    views
                        .entry((reference.texture, srgb))
                        .or_insert_with(|| upload(device, queue, &scene.textures[reference.texture], srgb));
                    samplers.entry(reference.sampler).or_insert_with(|| sampler(device, reference.sampler));
                }
            }
        }
        Self { white: single([255; 4]), flat_normal: single([128, 128, 255, 255]), views, samplers }
    }

    pub fn bind_groups(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &wgpu::BindGroupLayout,
        scene: &Scene,
        pre_exposure: f32,
    ) -> Vec<wgpu::BindGroup> {
        let transforms = scene.traits().texture_transforms;
        scene.materials.iter().map(|material| self.bind_group(device, queue, layout, material, pre_exposure, transforms)).collect()
    }

    fn bind_group(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &wgpu::BindGroupLayout,
        material: &Material,
        pre_exposure: f32,
        transforms: bool,
    ) -> wgpu::BindGroup {
        let buffer = |bytes: &[u8]| {
            let buffer = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(&material.name),
                size: bytes.len() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            queue.write_buffer(&buffer, 0, bytes);
            buffer
        };
        let uniform = buffer(&material_bytes(material, pre_exposure));
        let transforms = transforms.then(|| buffer(&texture_transform_bytes(material)));
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
        entries.extend(transforms.as_ref().map(|buffer| wgpu::BindGroupEntry { binding: 9, resource: buffer.as_entire_binding() }));
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

pub(super) fn environment_view(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene, pre_exposure: f32) -> wgpu::TextureView {
    let half = |value: f32| f16::from_f32(value.clamp(0.0, 65504.0)).to_le_bytes();
    let (extent, bytes) = match &scene.environment {
        Some(environment) => {
            let texels = environment.pixels.iter().map(|pixel| *pixel * (environment.scale * pre_exposure));
            let bytes = texels.flat_map(|pixel| [pixel.x, pixel.y, pixel.z, 1.0]).flat_map(half).collect();
            ([environment.width, environment.height], bytes)
        }
        None => ([1, 1], vec![0; 8]),
    };
    create(device, queue, "environment", extent, wgpu::TextureFormat::Rgba16Float, &bytes)
}

fn create(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &str,
    extent: [u32; 2],
    format: wgpu::TextureFormat,
    bytes: &[u8],
) -> wgpu::TextureView {
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
