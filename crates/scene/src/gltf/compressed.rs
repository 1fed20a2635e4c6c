//! Buffer views and primitives that are compressed: `EXT_meshopt_compression`, `KHR_meshopt_compression` and `KHR_draco_mesh_compression`.

use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use gltf::accessor::DataType;
use meshoptimizer_rs::{Error as MeshoptError, Workspace, codec as meshopt};
use serde_json::Value;

/// Most bytes that one compressed view or primitive may become.
const MAX_UNPACKED: usize = 1 << 30;

/// A view that meshoptimizer's codecs compressed.
pub(crate) struct Packed {
    pub buffer: usize,
    pub offset: usize,
    pub length: usize,
    stride: usize,
    count: usize,
    mode: String,
    filter: String,
}

impl Packed {
    /// What the view's extension says; nothing if it has none.
    pub fn of(view: &Value) -> Option<Result<Self, String>> {
        let extensions = view.get("extensions")?;
        let written = ["EXT_meshopt_compression", "KHR_meshopt_compression"].iter().find_map(|name| extensions.get(name))?;
        let number = |key: &str, otherwise: Option<usize>| match written.get(key) {
            None => otherwise.ok_or_else(|| format!("its compression has no {key}")),
            Some(value) => {
                let number = value.as_u64().and_then(|number| usize::try_from(number).ok());
                number.ok_or_else(|| format!("the {key} of its compression is no whole number"))
            }
        };
        let word = |key: &str, otherwise: &str| written.get(key).and_then(Value::as_str).unwrap_or(otherwise).to_owned();
        let read = || {
            Ok(Self {
                buffer: number("buffer", None)?,
                offset: number("byteOffset", Some(0))?,
                length: number("byteLength", None)?,
                stride: number("byteStride", None)?,
                count: number("count", None)?,
                mode: word("mode", ""),
                filter: word("filter", "NONE"),
            })
        };
        Some(read())
    }

    /// The view's bytes.
    pub fn unpack(&self, source: &[u8]) -> Result<Vec<u8>, String> {
        let Self { count, stride, .. } = *self;
        if count.checked_mul(stride).is_none_or(|bytes| bytes > MAX_UNPACKED) {
            return Err(format!("its compression claims {count} elements of {stride} bytes; at most {MAX_UNPACKED} bytes are read"));
        }
        let broken = |error: MeshoptError| format!("it cannot be decoded with meshoptimizer: {error}");
        let mut space = Workspace::default();
        let mut bytes = match self.mode.as_str() {
            "ATTRIBUTES" => meshopt::decode_vertex_buffer(count, stride, source, &mut space),
            "TRIANGLES" => meshopt::decode_index_buffer(count, stride, source, &mut space),
            "INDICES" => meshopt::decode_index_sequence(count, stride, source, &mut space),
            other => return Err(format!("the mode `{other}` of its compression is none of ATTRIBUTES, TRIANGLES and INDICES")),
        }
        .map_err(broken)?;
        match self.filter.as_str() {
            "NONE" => Ok(()),
            "OCTAHEDRAL" => meshopt::decode_filter_oct(&mut bytes, count, stride, &mut space),
            "QUATERNION" => meshopt::decode_filter_quat(&mut bytes, count, stride, &mut space),
            "EXPONENTIAL" => meshopt::decode_filter_exp(&mut bytes, count, stride, &mut space),
            "COLOR" => meshopt::decode_filter_color(&mut bytes, count, stride, &mut space),
            other => return Err(format!("the filter `{other}` of its compression is not known")),
        }
        .map_err(broken)?;
        Ok(bytes)
    }
}

/// A primitive that Draco compressed.
pub(crate) struct Draco(Mesh);

impl Draco {
    pub fn decode(source: &[u8]) -> Result<Self, String> {
        let most = super::MAX_MESH_ELEMENTS as u64;
        let limits = DecodeLimits::default().with_max_points(most).with_max_faces(most).with_max_decoded_bytes(MAX_UNPACKED as u64);
        let mut mesh = Mesh::new();
        let decoded = MeshDecoder::new().decode(&mut DecoderBuffer::new(source).with_limits(limits), &mut mesh);
        decoded.map_err(|error| error.to_string())?;
        Ok(Self(mesh))
    }

    /// The elements of an accessor, packed tightly in its types; `attribute` is the attribute's identifier, and nothing stands for the indices.
    pub fn elements(&self, accessor: &gltf::Accessor<'_>, attribute: Option<u32>) -> Result<Vec<u8>, String> {
        let Some(attribute) = attribute else {
            let corners = self.0.faces().iter().flat_map(|face| face.iter().map(|point| point.0));
            return match accessor.data_type() {
                DataType::U32 => Ok(corners.flat_map(u32::to_le_bytes).collect()),
                DataType::U16 if self.0.num_points() <= 1 << 16 => Ok(corners.flat_map(|corner| (corner as u16).to_le_bytes()).collect()),
                DataType::U8 if self.0.num_points() <= 1 << 8 => Ok(corners.map(|corner| corner as u8).collect()),
                other => Err(format!("its {} vertices do not go with indices of type {other:?}", self.0.num_points())),
            };
        };
        let found = self.0.attribute_by_unique_id(attribute).ok_or_else(|| format!("it has no attribute {attribute}"))?;
        let width = accessor.dimensions().multiplicity();
        if usize::from(found.num_components()) != width {
            return Err(format!(
                "attribute {attribute} has {} numbers per element, accessor {} has {width}",
                found.num_components(),
                accessor.index()
            ));
        }
        // Whole numbers of attributes have at most 16 bits, so floats hold them.
        let values = found.read_f32s(self.0.num_points(), width);
        let mut bytes = Vec::with_capacity(values.len() * accessor.data_type().size());
        for value in values {
            match accessor.data_type() {
                DataType::F32 => bytes.extend(value.to_le_bytes()),
                DataType::U32 => bytes.extend((value as u32).to_le_bytes()),
                DataType::U16 => bytes.extend((value as u16).to_le_bytes()),
                DataType::I16 => bytes.extend((value as i16).to_le_bytes()),
                DataType::U8 => bytes.push(value as u8),
                DataType::I8 => bytes.extend((value as i8).to_le_bytes()),
            }
        }
        Ok(bytes)
    }
}
