//! The safety net: poisons resources before a pass writes them, and counts afterwards what must not be there.
//!
//! Counting looks at bits, not at floats: a shader compiler may assume that no NaN exists and fold `x != x` to `false`.

use crate::{
    error::{BuildError, GpuError},
    gpu::{Gpu, MAX_STORAGE_BINDING, rows_within},
    pipeline::ComputePipeline,
    resource::{PartHandle, TextureShape, Values},
};
use lobelia_shaders::{Flags, Source};

/// What was counted in one part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Name of the pass.
    pub pass: String,
    /// `pass.port/part`.
    pub resource: String,
    /// NaN and infinities.
    pub non_finite: u64,
    /// Values below zero where that is wrong.
    pub negative: u64,
    /// Half floats that stand at the largest, 65504: most likely cut off there.
    pub saturated: u64,
}

/// Poisons and counts.
pub struct Checker {
    pipeline: ComputePipeline,
    poison: wgpu::Buffer,
    open: Vec<(Finding, wgpu::Buffer)>,
}

const SHADER: &str = include_str!("check.wgsl");

/// Bytes of the buffer that poison is copied from.
const POISON_BYTES: u64 = 4 << 20;

/// How words are to be read.
#[derive(Clone, Copy)]
struct Words {
    /// 32-bit words per record.
    stride: u32,
    /// Words that are floats.
    floats: u64,
    /// Of these, which must not be negative.
    non_negative: u64,
    /// Whether each word holds two half floats.
    halves: bool,
}

impl Checker {
    /// Creates the counting pipeline.
    pub fn new(gpu: &Gpu) -> Result<Self, BuildError> {
        let source = Source { path: "crates/graph/src/check.wgsl", text: SHADER };
        let pipeline = gpu.compute_pipeline("count values", source, "count", &Flags::new())?;
        let poison = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("poison"),
            size: POISON_BYTES,
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        gpu.queue().write_buffer(&poison, 0, &vec![0xff; POISON_BYTES as usize]);
        gpu.take_error()?;
        Ok(Self { pipeline, poison, open: Vec::new() })
    }

    /// Fills a colour texture with ones in every bit, which is NaN in every float format. Depth textures are left alone: they cannot be copied to, and
    /// passes clear them.
    pub fn poison_texture(&self, encoder: &mut wgpu::CommandEncoder, texture: &wgpu::Texture, shape: &TextureShape) {
        if shape.format.is_depth_stencil_format() {
            return;
        }
        let texel = shape.format.block_copy_size(None).unwrap_or(4);
        for mip in 0..shape.mips {
            let [width, height] = shape.extent.map(|side| (side >> mip).max(1));
            let pitch = (width * texel).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
            let rows = u32::try_from(POISON_BYTES / u64::from(pitch)).unwrap_or(u32::MAX).clamp(1, height);
            for layer in 0..shape.layers {
                for y in (0..height).step_by(rows as usize) {
                    let rows = rows.min(height - y);
                    encoder.copy_buffer_to_texture(
                        wgpu::TexelCopyBufferInfo {
                            buffer: &self.poison,
                            layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch), rows_per_image: Some(rows) },
                        },
                        wgpu::TexelCopyTextureInfo {
                            texture,
                            mip_level: mip,
                            origin: wgpu::Origin3d { x: 0, y, z: layer },
                            aspect: wgpu::TextureAspect::All,
                        },
                        wgpu::Extent3d { width, height: rows, depth_or_array_layers: 1 },
                    );
                }
            }
        }
    }

    /// Fills a buffer with ones in every bit.
    pub fn poison_buffer(&self, encoder: &mut wgpu::CommandEncoder, buffer: &wgpu::Buffer) {
        let mut start = 0;
        while start < buffer.size() {
            let length = POISON_BYTES.min(buffer.size() - start);
            encoder.copy_buffer_to_buffer(&self.poison, 0, buffer, start, length);
            start += length;
        }
    }

    /// Records the counting of one part; [`Checker::collect`] brings the numbers.
    pub fn count(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        part: &PartHandle,
        values: Values,
        pass: &str,
        resource: &str,
    ) -> Result<(), BuildError> {
        match part {
            PartHandle::Buffer(buffer) => {
                let Some(words) = words_of(values, 1, false) else { return Ok(()) };
                let copy = self.scratch(gpu, buffer.buffer().size());
                encoder.copy_buffer_to_buffer(buffer.buffer(), 0, &copy, 0, buffer.buffer().size());
                let length = (buffer.buffer().size() / 4) as u32;
                self.count_words(gpu, encoder, &copy, [length, 1, length], words, pass, resource)
            }
            PartHandle::Texture(texture) => {
                let shape = texture.shape();
                let Some((channels, halves)) = float_format(shape.format) else { return Ok(()) };
                let Some(words) = words_of(values, channels, halves) else { return Ok(()) };
                let [width, height] = shape.extent;
                let row = width * shape.format.block_copy_size(None).unwrap_or(4);
                let pitch = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
                let aspect = if shape.format.is_depth_stencil_format() { wgpu::TextureAspect::DepthOnly } else { wgpu::TextureAspect::All };
                // Large pictures are counted in bands of rows that fit a binding.
                let most = rows_within(MAX_STORAGE_BINDING, pitch);
                for (layer, y) in (0..shape.layers).flat_map(|layer| (0..height).step_by(most as usize).map(move |y| (layer, y))) {
                    let height = most.min(height - y);
                    let copy = self.scratch(gpu, u64::from(pitch) * u64::from(height));
                    encoder.copy_texture_to_buffer(
                        wgpu::TexelCopyTextureInfo {
                            texture: texture.texture(),
                            mip_level: 0,
                            origin: wgpu::Origin3d { x: 0, y, z: layer },
                            aspect,
                        },
                        wgpu::TexelCopyBufferInfo {
                            buffer: &copy,
                            layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch), rows_per_image: Some(height) },
                        },
                        wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                    );
                    self.count_words(gpu, encoder, &copy, [row.div_ceil(4), height, pitch / 4], words, pass, resource)?;
                }
                Ok(())
            }
        }
    }

    fn scratch(&self, gpu: &Gpu, size: u64) -> wgpu::Buffer {
        gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("counted copy"),
            size: size.next_multiple_of(4),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// `size`: words in a row, rows, words from row to row.
    #[allow(clippy::too_many_arguments)]
    fn count_words(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        copy: &wgpu::Buffer,
        size: [u32; 3],
        words: Words,
        pass: &str,
        resource: &str,
    ) -> Result<(), BuildError> {
        let [width, height, pitch] = size;
        let halves = u64::from(words.halves);
        let split = |mask: u64| [mask as u32, (mask >> 32) as u32];
        let [floats_low, floats_high] = split(words.floats);
        let [sign_low, sign_high] = split(words.non_negative);
        let settings = [width, height, pitch, words.stride, floats_low, floats_high, sign_low, sign_high, halves as u32, 0, 0, 0];
        let uniform = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("count settings"),
            size: 48,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        gpu.queue().write_buffer(&uniform, 0, bytemuck::cast_slice(&settings));
        let counts = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("counts"),
            size: 16,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = self
            .pipeline
            .bindings(0)
            .raw_buffer("settings", &uniform)
            .raw_buffer("words", copy)
            .raw_buffer("counts", &counts)
            .build(gpu)?;
        let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("count values"), timestamp_writes: None });
        compute.set_pipeline(self.pipeline.raw());
        compute.set_bind_group(0, &group, &[]);
        // Invocations stride over the words, so a fixed number of workgroups serves any size.
        compute.dispatch_workgroups(64, 1, 1);
        drop(compute);
        self.open.push((Finding { pass: pass.into(), resource: resource.into(), non_finite: 0, negative: 0, saturated: 0 }, counts));
        Ok(())
    }

    /// After submission: the counts, in the order they were recorded.
    pub fn collect(&mut self, gpu: &Gpu) -> Result<Vec<Finding>, GpuError> {
        let mut findings: Vec<Finding> = Vec::new();
        for (finding, counts) in self.open.drain(..) {
            let bytes = gpu.read_buffer(&counts)?;
            let word = |index: usize| u64::from(u32::from_le_bytes([bytes[index], bytes[index + 1], bytes[index + 2], bytes[index + 3]]));
            let found = Finding { non_finite: word(0), negative: word(4), saturated: word(8), ..finding };
            // Layers and bands of one texture are one finding.
            match findings.last_mut() {
                Some(last) if (&last.pass, &last.resource) == (&found.pass, &found.resource) => {
                    last.non_finite += found.non_finite;
                    last.negative += found.negative;
                    last.saturated += found.saturated;
                }
                _ => findings.push(found),
            }
        }
        Ok(findings)
    }
}

/// Channels, and whether they are half floats; `None` for formats that hold no floats.
fn float_format(format: wgpu::TextureFormat) -> Option<(u32, bool)> {
    use wgpu::TextureFormat as F;
    Some(match format {
        F::R16Float => (1, true),
        F::Rg16Float => (2, true),
        F::Rgba16Float => (4, true),
        F::R32Float | F::Depth32Float => (1, false),
        F::Rg32Float => (2, false),
        F::Rgba32Float => (4, false),
        _ => return None,
    })
}

/// Masks for a texture of `channels`, or for a buffer. In four channels the last is alpha, which may have any sign.
fn words_of(values: Values, channels: u32, halves: bool) -> Option<Words> {
    let signs = match values {
        Values::Any => return None,
        Values::Records { stride, mask, non_negative } => return Some(Words { stride, floats: mask, non_negative, halves: false }),
        Values::Finite => 0,
        Values::NonNegative if channels == 4 => 0b0111,
        Values::NonNegative => (1 << channels) - 1,
    };
    // With half floats, mask bits stand for halves; a row of single halves is read in pairs.
    let (stride, floats, non_negative) = match (halves, channels) {
        (true, 1) => (1, 0b11, if signs == 0 { 0 } else { 0b11 }),
        (true, channels) => (channels / 2, (1 << channels) - 1, signs),
        (false, channels) => (channels, (1 << channels) - 1, signs),
    };
    Some(Words { stride, floats, non_negative, halves })
}
