//! One primitive to one mesh.

use super::accessor::Buffers;
use crate::{Mesh, SceneError, tangents};
use glam::{Vec2, Vec3, Vec4};
use gltf::{Semantic, mesh::Mode};

/// What a primitive gives.
#[derive(Default)]
pub(crate) struct Read {
    /// Nothing, if there is nothing to draw.
    pub mesh: Option<Mesh>,
    /// What is not done as the file asks.
    pub warnings: Vec<String>,
    /// How many triangles had no area.
    pub dropped: usize,
}

/// Reads a primitive; `at` says where it stands.
pub(crate) fn read(
    buffers: &Buffers,
    shown: &str,
    at: &str,
    primitive: &gltf::Primitive<'_>,
    needs_tangents: bool,
) -> Result<Read, SceneError> {
    let fail = |message: String| SceneError::content(shown, format!("{at}: {message}"));
    let mut warnings = Vec::new();
    if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        warnings.push("points and lines are not drawn".to_owned());
        return Ok(Read { warnings, ..Read::default() });
    }
    if primitive.morph_targets().len() > 0 {
        warnings.push("morph targets are ignored".to_owned());
    }
    let numbers = |semantic: &Semantic, width: usize| -> Result<Option<Vec<f32>>, SceneError> {
        let Some(accessor) = primitive.get(semantic) else { return Ok(None) };
        let numbers = buffers.floats(shown, &accessor, width)?;
        match numbers.iter().position(|number| !number.is_finite()) {
            Some(place) => Err(fail(format!("{} of vertex {} is {}", semantic.to_string(), place / width, numbers[place]))),
            None => Ok(Some(numbers)),
        }
    };
    let positions = numbers(&Semantic::Positions, 3)?.ok_or_else(|| fail("it has no POSITION".into()))?;
    let mut mesh = Mesh { positions: positions.chunks_exact(3).map(Vec3::from_slice).collect(), ..Mesh::default() };
    let count = mesh.positions.len();
    let same_length = |name: &str, length: usize| {
        if length == count { Ok(()) } else { Err(fail(format!("{name} has {length} elements, POSITION has {count}"))) }
    };
    let normals = numbers(&Semantic::Normals, 3)?;
    if let Some(normals) = &normals {
        same_length("NORMAL", normals.len() / 3)?;
        mesh.normals = normals.chunks_exact(3).map(|normal| Vec3::from_slice(normal).as_dvec3().normalize_or_zero().as_vec3()).collect();
    }
    if let Some(uvs) = numbers(&Semantic::TexCoords(0), 2)? {
        same_length("TEXCOORD_0", uvs.len() / 2)?;
        mesh.uvs = uvs.chunks_exact(2).map(Vec2::from_slice).collect();
    }
    if primitive.get(&Semantic::Colors(0)).is_some() {
        warnings.push("vertex colours are ignored".to_owned());
    }
    // Tangents mean nothing without the normals they belong to (glTF 2.0, section 3.7.2.1).
    let tangents = if needs_tangents && normals.is_some() { numbers(&Semantic::Tangents, 4)? } else { None };
    if let Some(tangents) = &tangents {
        same_length("TANGENT", tangents.len() / 4)?;
        mesh.tangents = tangents.chunks_exact(4).map(unit_tangent).collect();
    }
    let indices = match primitive.indices() {
        Some(accessor) => buffers.indices(shown, &accessor)?,
        None => (0..u32::try_from(count).map_err(|_| fail("it has more than 2^32 vertices".into()))?).collect(),
    };
    if let Some(index) = indices.iter().find(|index| **index as usize >= count) {
        return Err(fail(format!("index {index} is out of range: it has {count} vertices")));
    }
    mesh.indices = triangles(primitive.mode(), &indices);
    let dropped = mesh.drop_degenerate();
    if mesh.indices.is_empty() {
        return Ok(Read { mesh: None, warnings, dropped });
    }
    if normals.is_none() {
        mesh.flat_normals();
    } else if let missing @ 1.. = mesh.mend_normals() {
        warnings.push(format!("{at}: {missing} normals are zero and replaced by those of their triangles"));
    }
    if needs_tangents && tangents.is_none() && (mesh.uvs.is_empty() || !tangents::generate(&mut mesh)) {
        warnings.push(format!("{at}: its normal map is ignored, for it has no usable texture coordinates"));
    }
    mesh.fill();
    Ok(Read { mesh: Some(mesh), warnings, dropped })
}

/// Unit, with a handedness of 1 or -1; all 0, which stands for none, where it has no direction.
fn unit_tangent(numbers: &[f32]) -> Vec4 {
    let tangent = Vec4::from_slice(numbers);
    match tangent.truncate().as_dvec3().try_normalize() {
        Some(axis) => axis.as_vec3().extend(1f32.copysign(tangent.w)),
        None => Vec4::ZERO,
    }
}

/// Strips and fans to triangles.
fn triangles(mode: Mode, indices: &[u32]) -> Vec<u32> {
    match mode {
        Mode::TriangleStrip => {
            let windows = indices.windows(3).enumerate();
            windows
                .flat_map(
                    |(place, corners)| {
                        if place % 2 == 0 { [corners[0], corners[1], corners[2]] } else { [corners[1], corners[0], corners[2]] }
                    },
                )
                .collect()
        }
        Mode::TriangleFan => indices.windows(2).skip(1).flat_map(|pair| [indices[0], pair[0], pair[1]]).collect(),
        _ => indices.chunks_exact(3).flatten().copied().collect(),
    }
}
