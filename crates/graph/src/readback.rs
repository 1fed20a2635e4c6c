//! Bringing textures and buffers back.

use crate::{
    error::GpuError,
    gpu::{Gpu, MAX_STORAGE_BINDING, rows_within},
};
use half::f16;

/// Longest wait for an answer after the device's work is done.
const ANSWER: std::time::Duration = std::time::Duration::from_secs(30);

/// One image of a texture, rows tightly packed, row 0 first.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureData {
    /// Width and height in texels.
    pub extent: [u32; 2],
    /// Texel format.
    pub format: wgpu::TextureFormat,
    /// Raw texels.
    pub bytes: Vec<u8>,
}

impl TextureData {
    /// Texels as 32-bit floats, missing channels 0 and missing alpha 1. Integer formats give their numbers; sRGB formats are not linearised.
    pub fn to_f32_rgba(&self) -> Vec<[f32; 4]> {
        let texel = self.format.block_copy_size(Some(wgpu::TextureAspect::All)).or(self.format.block_copy_size(None)).unwrap_or(4) as usize;
        let channels = usize::from(self.format.components()).max(1);
        let width = texel / channels;
        let unorm = matches!(self.format.sample_type(None, None), Some(wgpu::TextureSampleType::Float { .. })) && width == 1;
        let uint = self.format.sample_type(None, None) == Some(wgpu::TextureSampleType::Uint);
        let value = |bytes: &[u8]| match bytes {
            [byte] if unorm => f32::from(*byte) / 255.0,
            [byte] => f32::from(*byte),
            [a, b] if uint => f32::from(u16::from_le_bytes([*a, *b])),
            [a, b] => f16::from_le_bytes([*a, *b]).to_f32(),
            [a, b, c, d] if uint => u32::from_le_bytes([*a, *b, *c, *d]) as f32,
            [a, b, c, d] => f32::from_le_bytes([*a, *b, *c, *d]),
            _ => 0.0,
        };
        let texels = self.bytes.chunks_exact(texel).map(|bytes| {
            let mut rgba = [0.0, 0.0, 0.0, 1.0];
            for (channel, bytes) in bytes.chunks_exact(width).take(4).enumerate() {
                rgba[channel] = value(bytes);
            }
            rgba
        });
        texels.collect()
    }

    /// The channels of `light` divided by the power of two that they were stored times, as 32-bit floats. Formats without floats stay as they are.
    pub(crate) fn without_pre_exposure(self, light: u64, pre_exposure: f32) -> Self {
        let wide = match self.format {
            _ if light == 0 || pre_exposure == 1.0 => return self,
            wgpu::TextureFormat::R16Float | wgpu::TextureFormat::R32Float => wgpu::TextureFormat::R32Float,
            wgpu::TextureFormat::Rg16Float | wgpu::TextureFormat::Rg32Float => wgpu::TextureFormat::Rg32Float,
            wgpu::TextureFormat::Rgba16Float | wgpu::TextureFormat::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
            _ => return self,
        };
        let channels = usize::from(wide.components());
        let stored = |channel: usize| if light >> channel & 1 == 1 { pre_exposure } else { 1.0 };
        let texels = self.to_f32_rgba();
        let values = texels.iter().flat_map(|texel| (0..channels).map(|channel| texel[channel] / stored(channel)));
        Self { extent: self.extent, format: wide, bytes: values.flat_map(f32::to_le_bytes).collect() }
    }

    /// The raw 32-bit words.
    pub fn to_u32(&self) -> Vec<u32> {
        self.bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
    }
}

impl Gpu {
    /// Reads a whole buffer that has `COPY_SRC`.
    pub fn read_buffer(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>, GpuError> {
        let mut encoder = self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read back") });
        let staging = self.staging(buffer.size());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        self.queue().submit([encoder.finish()]);
        self.map(&staging)
    }

    /// Reads one mip of one layer of a texture that has `COPY_SRC`.
    pub fn read_texture(&self, texture: &wgpu::Texture, mip: u32, layer: u32) -> Result<TextureData, GpuError> {
        let format = texture.format();
        let aspect = if format.is_depth_stencil_format() { wgpu::TextureAspect::DepthOnly } else { wgpu::TextureAspect::All };
        let texel = format.block_copy_size(Some(aspect)).ok_or_else(|| GpuError::ReadBack(format!("{format:?} cannot be copied")))?;
        let [width, height] = [(texture.width() >> mip).max(1), (texture.height() >> mip).max(1)];
        let row = width * texel;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let mut bytes = Vec::with_capacity(row as usize * height as usize);
        // In bands of rows, since a buffer holds less than the largest texture.
        let most = rows_within(MAX_STORAGE_BINDING, padded);
        for y in (0..height).step_by(most as usize) {
            let rows = most.min(height - y);
            let staging = self.staging(u64::from(padded) * u64::from(rows));
            let mut encoder = self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read back") });
            encoder.copy_texture_to_buffer(
                wgpu::TexelCopyTextureInfo { texture, mip_level: mip, origin: wgpu::Origin3d { x: 0, y, z: layer }, aspect },
                wgpu::TexelCopyBufferInfo {
                    buffer: &staging,
                    layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: Some(rows) },
                },
                wgpu::Extent3d { width, height: rows, depth_or_array_layers: 1 },
            );
            self.queue().submit([encoder.finish()]);
            for line in self.map(&staging)?.chunks_exact(padded as usize) {
                bytes.extend_from_slice(&line[..row as usize]);
            }
        }
        Ok(TextureData { extent: [width, height], format, bytes })
    }

    fn staging(&self, size: u64) -> wgpu::Buffer {
        self.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        })
    }

    pub(crate) fn map(&self, staging: &wgpu::Buffer) -> Result<Vec<u8>, GpuError> {
        let (sender, receiver) = std::sync::mpsc::channel();
        staging.slice(..).map_async(wgpu::MapMode::Read, move |mapped| {
            // The receiver is gone only if the wait below failed.
            let _ = sender.send(mapped);
        });
        self.wait()?;
        // Another thread that polls the same device may be the one that answers, a little after this one's wait is over.
        match receiver.recv_timeout(ANSWER) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(GpuError::ReadBack(error.to_string())),
            Err(_) => return Err(GpuError::ReadBack("the device did not answer".into())),
        }
        let view = staging.slice(..).get_mapped_range().map_err(|error| GpuError::ReadBack(error.to_string()))?;
        let bytes = view.to_vec();
        drop(view);
        staging.unmap();
        Ok(bytes)
    }
}
