//! Numbers out of buffers, checked against what is really there.

use super::read_uri;
use crate::SceneError;
use gltf::accessor::{DataType, Dimensions};
use std::path::Path;

/// The bytes of all buffers.
pub(crate) struct Buffers(Vec<Vec<u8>>);

impl Buffers {
    pub fn load(gltf: &gltf::Gltf, shown: &str, folder: Option<&Path>) -> Result<Self, SceneError> {
        let mut buffers = Vec::new();
        for buffer in gltf.buffers() {
            let fail = |message: String| SceneError::content(shown, format!("buffer {}: {message}", buffer.index()));
            let bytes = match buffer.source() {
                gltf::buffer::Source::Bin => gltf.blob.clone().ok_or_else(|| fail("the file has no binary chunk".into()))?,
                gltf::buffer::Source::Uri(uri) => read_uri(uri, folder).map_err(fail)?,
            };
            if bytes.len() < buffer.length() {
                return Err(fail(format!("{} bytes are declared, but only {} are there", buffer.length(), bytes.len())));
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
    fn elements<T>(
        &self,
        shown: &str,
        accessor: &gltf::Accessor<'_>,
        width: usize,
        convert: impl Fn(DataType, bool, &[u8]) -> T,
    ) -> Result<Vec<T>, SceneError> {
        let fail = |message: String| SceneError::content(shown, format!("accessor {}: {message}", accessor.index()));
        let found = match accessor.dimensions() {
            Dimensions::Scalar => 1,
            Dimensions::Vec2 => 2,
            Dimensions::Vec3 => 3,
            Dimensions::Vec4 | Dimensions::Mat2 => 4,
            Dimensions::Mat3 => 9,
            Dimensions::Mat4 => 16,
        };
        if found != width {
            return Err(fail(format!("it has {found} numbers per element, but {width} are needed")));
        }
        if accessor.sparse().is_some() {
            return Err(fail("it is sparse, which is not supported; write it out densely".into()));
        }
        let view = accessor.view().ok_or_else(|| fail("it has no buffer view".into()))?;
        let bytes = self.view(shown, &view)?;
        let component = accessor.data_type().size();
        let element = component * width;
        let stride = view.stride().unwrap_or(element);
        let (count, offset) = (accessor.count(), accessor.offset());
        if stride < element {
            return Err(fail(format!("its stride of {stride} bytes is less than an element of {element}")));
        }
        let last = count.checked_sub(1).and_then(|last| last.checked_mul(stride)).and_then(|last| last.checked_add(element));
        let end = last.and_then(|last| last.checked_add(offset));
        if end.is_none_or(|end| end > bytes.len()) {
            return Err(fail(format!("{count} elements of {element} bytes do not fit into the {} bytes of buffer view {}", bytes.len(), view.index())));
        }
        let mut values = Vec::with_capacity(count * width);
        for index in 0..count {
            let start = offset + index * stride;
            for number in bytes[start..start + element].chunks_exact(component) {
                values.push(convert(accessor.data_type(), accessor.normalized(), number));
            }
        }
        Ok(values)
    }

    /// Floats of an accessor, `width` per element.
    pub fn floats(&self, shown: &str, accessor: &gltf::Accessor<'_>, width: usize) -> Result<Vec<f32>, SceneError> {
        self.elements(shown, accessor, width, |kind, normalized, bytes| match (kind, bytes) {
            (DataType::F32, [a, b, c, d]) => f32::from_le_bytes([*a, *b, *c, *d]),
            (DataType::U8, [a]) => f32::from(*a) / if normalized { 255.0 } else { 1.0 },
            (DataType::I8, [a]) => (f32::from(*a as i8) / if normalized { 127.0 } else { 1.0 }).max(if normalized { -1.0 } else { f32::MIN }),
            (DataType::U16, [a, b]) => f32::from(u16::from_le_bytes([*a, *b])) / if normalized { 65535.0 } else { 1.0 },
            (DataType::I16, [a, b]) => {
                (f32::from(i16::from_le_bytes([*a, *b])) / if normalized { 32767.0 } else { 1.0 }).max(if normalized { -1.0 } else { f32::MIN })
            }
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
