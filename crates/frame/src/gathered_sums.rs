use lobelia_graph::Gpu;
use wgpu::{TextureFormat, TextureUsages, TextureView};

/// Sums in 32-bit floats that a pass keeps for every pixel while it goes through its lights: a texture for each channel, since `r32float` is what every device can
/// both read and write. A texture has no largest binding, so pictures may be as large as the device has textures.
pub struct GatheredSums {
    /// `r32float`.
    pub red: TextureView,
    /// `r32float`.
    pub green: TextureView,
    /// `r32float`.
    pub blue: TextureView,
}

impl GatheredSums {
    /// Allocates them.
    pub fn new(gpu: &Gpu, extent: [u32; 2]) -> Self {
        let channel = |label| {
            let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: extent[0], height: extent[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: TextureFormat::R32Float,
                usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        Self { red: channel("gathered red"), green: channel("gathered green"), blue: channel("gathered blue") }
    }
}
