//! Numbers out of buffers, checked against what is really there.

use super::read_uri;
use crate::SceneError;
use gltf::accessor::{
    DataType,
    sparse::{IndexType, Sparse},
};
use std::path::Path;

/// Where elements lie in a buffer view, bytes.
#[derive(Clone, Copy)]
struct Layout {
    offset: usize,
    stride: usize,
    element: usize,
    count: usize,
}

/// Most bytes that all buffers together may have.
const MAX_BYTES: usize = 1 << 30;

/// The bytes of all buffers.
pub(crate) struct Buffers(Vec<Vec<u8>>);

impl Buffers {
    pub fn load(gltf: &mut gltf::Gltf, shown: &str, folder: Option<&Path>) -> Result<Self, SceneError> {
        let mut blob = gltf.blob.take();
        let mut buffers = Vec::new();
        let mut total = 0;
        for buffer in gltf.buffers() {
            let fail = |message: String| SceneError::content(shown, format!("buffer {}: {message}", buffer.index()));
            let bytes = match buffer.source() {
                gltf::buffer::Source::Bin if buffer.index() > 0 => {
                    return Err(fail("it has no uri; only buffer 0 may be the binary chunk".into()));
                }
                gltf::buffer::Source::Bin => blob.take().ok_or_else(|| fail("it has no uri and the file no binary chunk".into()))?,
                gltf::buffer::Source::Uri(uri) => read_uri(uri, folder).map_err(fail)?,
            };
            if bytes.len() < buffer.length() {
                return Err(fail(format!("{} bytes are declared, but only {} are there", buffer.length(), bytes.len())));
            }
            total += bytes.len();
            if total > MAX_BYTES {
                return Err(fail(format!("the buffers have more than {MAX_BYTES} bytes")));
            }
            buffers.push(bytes);
        }
        Ok(Self(buffers))
    }

    /// The bytes of a view.
    pub fn view(&self, shown: &str, view: &gltf::buffer::View<'_>) -> Result<&[u8], SceneError> {
        let buffer = &self.0[view.buffer().index()];
        let end = view.offset().checked_add(view.length());
        end.and_then(|end| buffer.get(view.offset()..end)).ok_or_else(|| {
            let what = format!(
                "buffer view {}: bytes {} to {} lie outside of buffer {}, which has {}",
                view.index(),
                view.offset(),
                view.offset().saturating_add(view.length()),
                view.buffer().index(),
                buffer.len()
            );
            SceneError::content(shown, what)
        })
    }

    /// Elements of an accessor, each as `width` numbers. Integers that are marked as normalised become [0, 1] or [-1, 1].
    fn elements<T: Copy>(
        &self,
        shown: &str,
        accessor: &gltf::Accessor<'_>,
        width: usize,
        convert: impl Fn(DataType, bool, &[u8]) -> T,
    ) -> Result<Vec<T>, SceneError> {
        let fail = |message: String| SceneError::content(shown, format!("accessor {}: {message}", accessor.index()));
        let found = accessor.dimensions().multiplicity();
        if found != width {
            return Err(fail(format!("it has {found} numbers per element, but {width} are needed")));
        }
        let view = accessor.view().ok_or_else(|| fail("it has no buffer view".into()))?;
        let component = accessor.data_type().size();
        let element = component * width;
        let stride = view.stride().unwrap_or(element);
        if stride < element {
            return Err(fail(format!("its stride of {stride} bytes is less than an element of {element}")));
        }
        let layout = Layout { offset: accessor.offset(), stride, element, count: accessor.count() };
        let bytes = self.run(shown, accessor, &view, layout)?;
        let number = |bytes: &[u8]| convert(accessor.data_type(), accessor.normalized(), bytes);
        let mut values: Vec<T> = Vec::with_capacity(layout.count * width);
        for start in (0..layout.count).map(|index| index * stride) {
            values.extend(bytes[start..start + element].chunks_exact(component).map(number));
        }
        if let Some(sparse) = accessor.sparse() {
            let count = sparse.count();
            let places = self.sparse_places(shown, accessor, &sparse)?;
            let layout = Layout { offset: sparse.values().offset(), stride: element, element, count };
            let bytes = self.run(shown, accessor, &sparse.values().view(), layout)?;
            for (place, bytes) in places.into_iter().zip(bytes.chunks_exact(element)) {
                let target = values.get_mut(place * width..(place + 1) * width);
                let target = target.ok_or_else(|| fail(format!("it is sparse and replaces element {place} of {}", accessor.count())))?;
                for (target, bytes) in target.iter_mut().zip(bytes.chunks_exact(component)) {
                    *target = number(bytes);
                }
            }
        }
        Ok(values)
    }

    /// The indices of those elements that a sparse accessor replaces.
    fn sparse_places(&self, shown: &str, accessor: &gltf::Accessor<'_>, sparse: &Sparse<'_>) -> Result<Vec<usize>, SceneError> {
        let indices = sparse.indices();
        let element = match indices.index_type() {
            IndexType::U8 => 1,
            IndexType::U16 => 2,
            IndexType::U32 => 4,
        };
        let layout = Layout { offset: indices.offset(), stride: element, element, count: sparse.count() };
        let bytes = self.run(shown, accessor, &indices.view(), layout)?;
        let number = |bytes: &[u8]| bytes.iter().rev().fold(0, |number, byte| number << 8 | usize::from(*byte));
        Ok(bytes.chunks_exact(element).map(number).collect())
    }

    /// The bytes from the first to the last of a run of elements in a view.
    fn run(&self, shown: &str, accessor: &gltf::Accessor<'_>, view: &gltf::buffer::View<'_>, layout: Layout) -> Result<&[u8], SceneError> {
        let Layout { offset, stride, element, count } = layout;
        let bytes = self.view(shown, view)?;
        let length = match count.checked_sub(1) {
            Some(last) => last.checked_mul(stride).and_then(|last| last.checked_add(element)),
            None => Some(0),
        };
        let end = length.and_then(|length| length.checked_add(offset));
        end.and_then(|end| bytes.get(offset..end)).ok_or_else(|| {
            let message = format!(
                "accessor {}: {count} elements of {element} bytes do not fit into the {} bytes of buffer view {}",
                accessor.index(),
                bytes.len(),
                view.index()
            );
            SceneError::content(shown, message)
        })
    }

    /// Floats of an accessor, `width` per element.
    pub fn floats(&self, shown: &str, accessor: &gltf::Accessor<'_>, width: usize) -> Result<Vec<f32>, SceneError> {
        self.elements(shown, accessor, width, |kind, normalized, bytes| match (kind, bytes) {
            (DataType::F32, [a, b, c, d]) => f32::from_le_bytes([*a, *b, *c, *d]),
            (DataType::U8, [a]) => f32::from(*a) / if normalized { 255.0 } else { 1.0 },
            (DataType::I8, [a]) => {
                (f32::from(*a as i8) / if normalized { 127.0 } else { 1.0 }).max(if normalized { -1.0 } else { f32::MIN })
            }
            (DataType::U16, [a, b]) => f32::from(u16::from_le_bytes([*a, *b])) / if normalized { 65535.0 } else { 1.0 },
            (DataType::I16, [a, b]) => (f32::from(i16::from_le_bytes([*a, *b])) / if normalized { 32767.0 } else { 1.0 })
                .max(if normalized { -1.0 } else { f32::MIN }),
            (DataType::U32, [a, b, c, d]) => u32::from_le_bytes([*a, *b, *c, *d]) as f32,
            _ => f32::NAN,
        })
    }

    /// Indices of an accessor.
    pub fn indices(&self, shown: &str, accessor: &gltf::Accessor<'_>) -> Result<Vec<u32>, SceneError> {
        if !matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32) {
            return Err(SceneError::content(shown, format!("accessor {}: indices must be unsigned integers", accessor.index())));
        }
        self.elements(shown, accessor, 1, |_, _, bytes| match bytes {
            [a] => u32::from(*a),
            [a, b] => u32::from(u16::from_le_bytes([*a, *b])),
            [a, b, c, d] => u32::from_le_bytes([*a, *b, *c, *d]),
            _ => u32::MAX,
        })
    }
}
