//! What flows on an edge.
//!
//! A [`Resource`] is a Rust type named for what it *means* (a G-buffer, virtual lights, radiance), not for its format. It is made of one or
//! more [`Part`]s: textures and buffers that the run owns. While planning only its [`Resource::Shape`] exists, so a whole graph can be
//! checked without a device; when it runs, the pass receives the resource itself with the parts in hand.

use std::fmt::Debug;

/// A typed value that passes exchange.
///
/// Implementors live outside this crate: the graph knows no concrete resource.
pub trait Resource: Sized + 'static {
    /// The type's name, as users read it in errors and in `lobelia passes`.
    const NAME: &'static str;
    /// One sentence: meaning, space and unit.
    const DOC: &'static str;
    /// What must be known to allocate the parts and to specialise whoever reads them: extents, counts, which optional parts exist.
    type Shape: Clone + Debug + PartialEq + Send + Sync + 'static;

    /// The textures and buffers that a resource of this shape consists of. Names are unique within the resource.
    fn parts(shape: &Self::Shape) -> Vec<Part>;

    /// Assembles the resource from allocated parts; called by the run, never by a pass.
    fn assemble(shape: &Self::Shape, parts: &PartSet) -> Self;
}

/// One texture or buffer of a resource.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Name within the resource, such as `depth`.
    pub name: &'static str,
    /// What is allocated.
    pub kind: PartKind,
    /// Which numbers may stand in it; the safety net counts what is not allowed.
    pub values: Values,
    /// Which channels of a texel, or which 32-bit words of a record of [`Values::Records`], are in proportion to the scene's light: bit `i` for the `i`-th. They are
    /// stored times [`crate::World::pre_exposure`]; whoever reads them back gets them without it.
    pub light: u64,
}

impl Part {
    /// A two-dimensional texture with one mip level and one layer.
    pub fn texture(name: &'static str, format: wgpu::TextureFormat, extent: [u32; 2], usage: wgpu::TextureUsages) -> Self {
        Self::layered_texture(name, format, extent, 1, usage)
    }

    /// A two-dimensional texture array. `layers` >= 1; one layer is viewed as a plain 2-D texture by [`TexturePart::view`] unless
    /// [`Part::always_array`] is called.
    pub fn layered_texture(
        name: &'static str,
        format: wgpu::TextureFormat,
        extent: [u32; 2],
        layers: u32,
        usage: wgpu::TextureUsages,
    ) -> Self {
        Self {
            name,
            kind: PartKind::Texture(TextureShape { format, extent, layers, mips: 1, usage, array: layers > 1 }),
            values: Values::Any,
            light: 0,
        }
    }

    /// A buffer of `bytes` (rounded up to a multiple of 16, at least 16).
    pub fn buffer(name: &'static str, bytes: u64, usage: wgpu::BufferUsages) -> Self {
        Self {
            name,
            kind: PartKind::Buffer(BufferShape { bytes: bytes.max(1).next_multiple_of(16), usage }),
            values: Values::Any,
            light: 0,
        }
    }

    /// Makes the whole-texture view an array view even for a single layer.
    pub fn always_array(mut self) -> Self {
        if let PartKind::Texture(texture) = &mut self.kind {
            texture.array = true;
        }
        self
    }

    /// Sets the number of mip levels (>= 1).
    pub fn mips(mut self, mips: u32) -> Self {
        if let PartKind::Texture(texture) = &mut self.kind {
            texture.mips = mips.max(1);
        }
        self
    }

    /// States which numbers the part may hold.
    pub fn values(mut self, values: Values) -> Self {
        self.values = values;
        self
    }

    /// States which channels or words are in proportion to the scene's light; see [`Part::light`].
    pub fn light(mut self, mask: u64) -> Self {
        self.light = mask;
        self
    }

    /// Memory in bytes, without the driver's own padding.
    pub fn bytes(&self) -> u64 {
        match &self.kind {
            PartKind::Texture(texture) => texture.bytes(),
            PartKind::Buffer(buffer) => buffer.bytes,
        }
    }
}

/// Texture or buffer.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum PartKind {
    /// A 2-D texture or texture array.
    Texture(TextureShape),
    /// A storage, uniform or vertex buffer.
    Buffer(BufferShape),
}

/// Everything that decides whether two textures can stand in for each other.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct TextureShape {
    /// Texel format.
    pub format: wgpu::TextureFormat,
    /// Width and height in texels.
    pub extent: [u32; 2],
    /// Array layers.
    pub layers: u32,
    /// Mip levels.
    pub mips: u32,
    /// How its *producer* uses it; sampling and copying are added by the run.
    pub usage: wgpu::TextureUsages,
    /// Whether the whole-texture view is an array view.
    pub array: bool,
}

impl TextureShape {
    /// Memory of all levels and layers in bytes.
    pub fn bytes(&self) -> u64 {
        let texel = u64::from(self.format.block_copy_size(None).unwrap_or(4));
        (0..self.mips)
            .map(|mip| {
                let [width, height] = self.extent;
                u64::from((width >> mip).max(1)) * u64::from((height >> mip).max(1)) * texel * u64::from(self.layers)
            })
            .sum()
    }
}

/// Size and use of a buffer.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct BufferShape {
    /// Size in bytes.
    pub bytes: u64,
    /// How its producer uses it; copying is added by the run.
    pub usage: wgpu::BufferUsages,
}

/// Which numbers a part may hold. The check counts bits, so it works where shaders assume finite maths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Values {
    /// Packed or integer data: not checked.
    Any,
    /// Floats that may have any sign but must be finite.
    Finite,
    /// Floats that must be finite and not below zero: radiance, flux, weights. Negative zero is allowed.
    NonNegative,
    /// A buffer of records of `stride` 32-bit words in which only the words whose bit is set in `mask` are floats (finite) and of these those set in
    /// `non_negative` must not be below zero. Word `i` of a record is bit `i`; a stride above 64 is not supported.
    Records {
        /// 32-bit words per record.
        stride: u32,
        /// Words that are floats.
        mask: u64,
        /// Words that are floats and must not be negative.
        non_negative: u64,
    },
}

/// Whether the holder of a part may write it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// It came through an input port.
    Read,
    /// It came through an output port.
    Write,
}

/// A texture of a resource, with no more rights than its port gives: the views of an input are created for sampling only, so the device refuses
/// to render or store into it.
#[derive(Clone, Debug)]
pub struct TexturePart {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    shape: TextureShape,
    access: Access,
    label: String,
}

impl TexturePart {
    /// Wraps a texture that the run allocated.
    pub(crate) fn new(texture: wgpu::Texture, shape: TextureShape, access: Access, label: String) -> Self {
        let view = Self::make_view(&texture, &shape, access, &label, 0, None, 0, None);
        Self { texture, view, shape, access, label }
    }

    /// A part around a texture of the caller's own, to unit-test a pass or the safety net without a graph.
    pub fn for_test(texture: wgpu::Texture, shape: TextureShape, access: Access, label: &str) -> Self {
        Self::new(texture, shape, access, label.to_owned())
    }

    #[allow(clippy::too_many_arguments)]
    fn make_view(
        texture: &wgpu::Texture,
        shape: &TextureShape,
        access: Access,
        label: &str,
        layer: u32,
        layers: Option<u32>,
        mip: u32,
        mips: Option<u32>,
    ) -> wgpu::TextureView {
        let usage = match access {
            Access::Read => wgpu::TextureUsages::TEXTURE_BINDING,
            Access::Write => shape.usage | wgpu::TextureUsages::TEXTURE_BINDING,
        };
        texture.create_view(&wgpu::TextureViewDescriptor {
            label: Some(label),
            usage: Some(usage),
            dimension: Some(if shape.array && layers.is_none() {
                wgpu::TextureViewDimension::D2Array
            } else {
                wgpu::TextureViewDimension::D2
            }),
            base_array_layer: layer,
            array_layer_count: layers,
            base_mip_level: mip,
            mip_level_count: mips,
            ..Default::default()
        })
    }

    /// All layers and mips.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// One layer and one mip as a plain 2-D view, to render into.
    pub fn layer_view(&self, layer: u32, mip: u32) -> wgpu::TextureView {
        Self::make_view(&self.texture, &self.shape, self.access, &self.label, layer, Some(1), mip, Some(1))
    }

    /// One mip of all layers.
    pub fn mip_view(&self, mip: u32) -> wgpu::TextureView {
        Self::make_view(&self.texture, &self.shape, self.access, &self.label, 0, None, mip, Some(1))
    }

    pub(crate) fn texture(&self) -> &wgpu::Texture {
        &self.texture
    }

    /// Format, extent, layers.
    pub fn shape(&self) -> &TextureShape {
        &self.shape
    }

    /// The right that the port gave.
    pub fn access(&self) -> Access {
        self.access
    }

    /// `pass.port/part`, for errors.
    pub fn label(&self) -> &str {
        &self.label
    }
}

/// A buffer of a resource. [`crate::Bindings`] refuses to bind a buffer that came through an input as writable storage.
#[derive(Clone, Debug)]
pub struct BufferPart {
    buffer: wgpu::Buffer,
    access: Access,
    label: String,
}

impl BufferPart {
    pub(crate) fn new(buffer: wgpu::Buffer, access: Access, label: String) -> Self {
        Self { buffer, access, label }
    }

    /// A part around a buffer of the caller's own, to unit-test a pass or the safety net without a graph.
    pub fn for_test(buffer: wgpu::Buffer, access: Access, label: &str) -> Self {
        Self::new(buffer, access, label.to_owned())
    }

    /// The buffer, to bind or to draw from.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// The right that the port gave.
    pub fn access(&self) -> Access {
        self.access
    }

    /// `pass.port/part`, for errors.
    pub fn label(&self) -> &str {
        &self.label
    }
}

/// An allocated part.
#[derive(Clone, Debug)]
pub enum PartHandle {
    /// A texture.
    Texture(TexturePart),
    /// A buffer.
    Buffer(BufferPart),
}

/// The allocated parts of one resource, in the order of [`Resource::parts`].
#[derive(Clone, Debug, Default)]
pub struct PartSet {
    parts: Vec<(&'static str, PartHandle)>,
}

impl PartSet {
    pub(crate) fn new(parts: Vec<(&'static str, PartHandle)>) -> Self {
        Self { parts }
    }

    /// All parts.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &PartHandle)> {
        self.parts.iter().map(|(name, handle)| (*name, handle))
    }

    /// The texture called `name`, if the shape has it.
    pub fn find_texture(&self, name: &str) -> Option<TexturePart> {
        self.parts.iter().find_map(|(part, handle)| match handle {
            PartHandle::Texture(texture) if *part == name => Some(texture.clone()),
            _ => None,
        })
    }

    /// The buffer called `name`, if the shape has it.
    pub fn find_buffer(&self, name: &str) -> Option<BufferPart> {
        self.parts.iter().find_map(|(part, handle)| match handle {
            PartHandle::Buffer(buffer) if *part == name => Some(buffer.clone()),
            _ => None,
        })
    }

    /// The texture called `name`.
    ///
    /// # Panics
    /// If [`Resource::parts`] did not list it: `parts` and `assemble` of one resource disagree, which is a defect of that type.
    pub fn texture(&self, name: &str) -> TexturePart {
        self.find_texture(name).unwrap_or_else(|| panic!("this resource lists no texture part `{name}`"))
    }

    /// The buffer called `name`.
    ///
    /// # Panics
    /// As [`PartSet::texture`].
    pub fn buffer(&self, name: &str) -> BufferPart {
        self.find_buffer(name).unwrap_or_else(|| panic!("this resource lists no buffer part `{name}`"))
    }
}
