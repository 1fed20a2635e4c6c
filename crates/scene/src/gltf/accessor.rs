//! Numbers out of buffers, checked against what is really there. A buffer is read when something first asks for it.

use super::{
    compressed::{self, Packed},
    reach::Raw,
    read_uri,
};
use crate::SceneError;
use gltf::accessor::{
    DataType,
    sparse::{IndexType, Sparse},
};
use serde_json::Value;
use std::{
    cell::{Cell, OnceCell, RefCell},
    path::{Path, PathBuf},
};

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

/// Most elements of an accessor that has no bytes of its own: a file of nothing may not ask for memory without bound.
const MAX_ZEROS: usize = 1 << 24;

/// The bytes of all buffers, and how they are divided.
pub(crate) struct Buffers {
    raw: Raw,
    blob: Option<Vec<u8>>,
    folder: Option<PathBuf>,
    buffers: Vec<OnceCell<Result<Vec<u8>, String>>>,
    /// What compressed views hold, where they have been asked for.
    unpacked: Vec<OnceCell<Result<Vec<u8>, String>>>,
    meshes: Vec<OnceCell<Result<compressed::Draco, String>>>,
    total: Cell<usize>,
    warnings: RefCell<Vec<String>>,
}

/// A number of a JSON object that says how many bytes.
fn bytes_of(value: &Value, key: &str) -> Result<usize, String> {
    match value.get(key) {
        None => Ok(0),
        Some(number) => {
            let number = number.as_u64().and_then(|number| usize::try_from(number).ok());
            number.ok_or_else(|| format!("its {key} is no number of bytes"))
        }
    }
}

fn cells<T>(count: usize) -> Vec<OnceCell<T>> {
    (0..count).map(|_| OnceCell::new()).collect()
}

impl Buffers {
    /// Nothing is read yet; `folder` is where buffers of their own files lie.
    pub fn new(raw: Raw, blob: Option<Vec<u8>>, folder: Option<&Path>) -> Self {
        Self {
            buffers: cells(raw.buffers.len()),
            unpacked: cells(raw.views.len()),
            meshes: cells(raw.draco_views.len()),
            folder: folder.map(Path::to_owned),
            total: Cell::new(0),
            warnings: RefCell::default(),
            raw,
            blob,
        }
    }

    /// What a document does not hold.
    pub fn raw(&self) -> &Raw {
        &self.raw
    }

    /// Takes what was not read as it stands.
    pub fn take_warnings(&self) -> Vec<String> {
        std::mem::take(&mut self.warnings.borrow_mut())
    }

    /// The buffers and buffer views of which nothing was asked, in words; nothing if there are none.
    pub fn unread(&self) -> Option<String> {
        let unread: Vec<String> =
            (0..self.buffers.len()).filter(|buffer| self.buffers[*buffer].get().is_none()).map(|buffer| buffer.to_string()).collect();
        (!unread.is_empty()).then(|| format!("buffers that nothing drawn uses are not read: {}", unread.join(", ")))
    }

    fn buffer(&self, index: usize) -> Result<&[u8], String> {
        let (Some(cell), Some(written)) = (self.buffers.get(index), self.raw.buffers.get(index)) else {
            return Err(format!("there is no buffer {index}, but {}", self.buffers.len()));
        };
        let read = || {
            let length = bytes_of(written, "byteLength")?;
            let data = match written.get("uri").and_then(Value::as_str) {
                Some(uri) => read_uri(uri, self.folder.as_deref())?,
                None if index > 0 => return Err("it has no uri; only buffer 0 may be the binary chunk".into()),
                None => self.blob.clone().ok_or("it has no uri and the file no binary chunk")?,
            };
            // Numbers may begin like an archive by chance, but then there are enough of them.
            let stand_in = if data.len() < length { lobelia_files::stand_in(&data) } else { lobelia_files::placeholder(&data) };
            if let Some(what) = stand_in {
                return Err(what);
            }
            if data.len() < length {
                let what = if data.len() < 1024 { lobelia_files::describe(&data) } else { None };
                let what = what.map(|what| format!(" ({what})")).unwrap_or_default();
                return Err(format!("{length} bytes are declared, but only {} are there{what}", data.len()));
            }
            self.total.set(self.total.get().saturating_add(data.len()));
            if self.total.get() > MAX_BYTES {
                return Err(format!("the buffers have more than {MAX_BYTES} bytes"));
            }
            Ok(data)
        };
        let result = cell.get_or_init(read);
        result.as_deref().map_err(|message| format!("buffer {index}: {message}"))
    }

    /// The bytes from an offset on in a buffer.
    fn slice(&self, index: usize, offset: usize, length: usize) -> Result<&[u8], String> {
        let buffer = self.buffer(index)?;
        let end = offset.checked_add(length);
        end.and_then(|end| buffer.get(offset..end)).ok_or_else(|| {
            let end = offset.saturating_add(length);
            format!("bytes {offset} to {end} lie outside of buffer {index}, which has {}", buffer.len())
        })
    }

    /// The bytes of the view of an index.
    pub fn view(&self, index: usize) -> Result<&[u8], String> {
        let Some(written) = self.raw.views.get(index) else {
            return Err(format!("there is no buffer view {index}, but {}", self.raw.views.len()));
        };
        let fail = |message: String| format!("buffer view {index}: {message}");
        if let Some(packed) = Packed::of(written) {
            let unpack = || {
                let packed = packed.map_err(fail)?;
                let source = self.slice(packed.buffer, packed.offset, packed.length).map_err(fail)?;
                packed.unpack(source).map_err(fail)
            };
            return self.unpacked[index].get_or_init(unpack).as_deref().map_err(Clone::clone);
        }
        let place = |key: &str| bytes_of(written, key);
        let (buffer, offset, length) = match (place("buffer"), place("byteOffset"), place("byteLength")) {
            (Ok(buffer), Ok(offset), Ok(length)) => (buffer, offset, length),
            (Err(message), ..) | (_, Err(message), _) | (.., Err(message)) => return Err(fail(message)),
        };
        self.slice(buffer, offset, length).map_err(|message| if message.starts_with("buffer ") { message } else { fail(message) })
    }

    /// Bytes from one element to the next, if the view says so. 0 says nothing.
    fn stride(&self, view: usize) -> Result<Option<usize>, String> {
        let written = self.raw.views.get(view).ok_or_else(|| format!("there is no buffer view {view}"))?;
        let stride = bytes_of(written, "byteStride").map_err(|message| format!("buffer view {view}: {message}"))?;
        Ok(Some(stride).filter(|stride| *stride > 0))
    }

    /// The elements that Draco compressed, packed tightly in the types of the accessor; nothing if it is not one of those, or if the mesh cannot be
    /// decoded and the accessor has bytes of its own.
    fn draco(&self, accessor: &gltf::Accessor<'_>) -> Option<Result<Vec<u8>, String>> {
        let part = self.raw.draco.get(&accessor.index())?;
        let view = self.raw.draco_views[part.primitive];
        let fail = |message: String| format!("buffer view {view}: it cannot be decoded with Draco: {message}");
        match self.meshes[part.primitive].get_or_init(|| compressed::Draco::decode(self.view(view)?).map_err(fail)) {
            Ok(mesh) => Some(mesh.elements(accessor, part.attribute).map_err(fail)),
            Err(message) if accessor.view().is_some() => {
                let warning = format!("{message}; the uncompressed mesh beside it is drawn");
                let mut warnings = self.warnings.borrow_mut();
                if !warnings.contains(&warning) {
                    warnings.push(warning);
                }
                None
            }
            Err(message) => Some(Err(message.clone())),
        }
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
        let component = accessor.data_type().size();
        let element = component * width;
        let number = |bytes: &[u8]| convert(accessor.data_type(), accessor.normalized(), bytes);
        if let Some(unpacked) = self.draco(accessor) {
            let bytes = unpacked.map_err(|message| SceneError::content(shown, message))?;
            return Ok(bytes.chunks_exact(component).map(number).collect());
        }
        let count = accessor.count();
        let mut values: Vec<T> = match accessor.view() {
            Some(view) => {
                let stride = self.stride(view.index()).map_err(|message| SceneError::content(shown, message))?.unwrap_or(element);
                if stride < element {
                    return Err(fail(format!("its stride of {stride} bytes is less than an element of {element}")));
                }
                let bytes = self.run(shown, accessor, &view, Layout { offset: accessor.offset(), stride, element, count })?;
                let starts = (0..count).map(|index| index * stride);
                starts.flat_map(|start| bytes[start..start + element].chunks_exact(component)).map(number).collect()
            }
            // What has no bytes is zero (glTF 2.0, section 3.6.2.3).
            None if count > MAX_ZEROS => {
                return Err(fail(format!("it has {count} elements and no buffer view; at most {MAX_ZEROS} are read")));
            }
            None => vec![number(&[0; 4][..component]); count * width],
        };
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
        let bytes = self.view(view.index()).map_err(|message| SceneError::content(shown, message))?;
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
