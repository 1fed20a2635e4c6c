//! One primitive to one mesh, and to what moves its vertices.

use super::{accessor::Buffers, material::UvSets};
use crate::{
    Mesh, SceneError, TextureRef,
    pose::{Influences, Rest, Target},
    tangents,
};
use glam::{Vec2, Vec3, Vec4};
use gltf::{Accessor, Semantic, mesh::Mode};

/// What a primitive gives.
#[derive(Default)]
pub(crate) struct Read {
    /// Nothing, if there is nothing to draw.
    pub rest: Option<Rest>,
    /// What is not done as the file asks.
    pub warnings: Vec<String>,
    /// How many triangles had no area.
    pub dropped: usize,
}

/// How a primitive's material reads it.
pub(crate) struct Reading<'a> {
    pub uv_sets: UvSets,
    /// Whether any texture is read.
    pub textured: bool,
    pub normal_map: Option<&'a TextureRef>,
}

/// Where numbers are read from, and where they stand.
struct Source<'a> {
    buffers: &'a Buffers,
    shown: &'a str,
    at: &'a str,
}

impl Source<'_> {
    fn fail(&self, message: String) -> SceneError {
        SceneError::content(self.shown, format!("{}: {message}", self.at))
    }

    /// Numbers of an accessor, `width` per vertex, all finite.
    fn numbers(&self, name: &str, accessor: &Accessor<'_>, width: usize) -> Result<Vec<f32>, SceneError> {
        let numbers = self.buffers.floats(self.shown, accessor, width)?;
        match numbers.iter().position(|number| !number.is_finite()) {
            Some(place) => Err(self.fail(format!("{name} of vertex {} is {}", place / width, numbers[place]))),
            None => Ok(numbers),
        }
    }

    /// As [`Source::numbers`] for an attribute that a primitive may lack; one row for each of `count` vertices.
    fn attribute(
        &self,
        primitive: &gltf::Primitive<'_>,
        semantic: &Semantic,
        width: usize,
        count: usize,
    ) -> Result<Option<Vec<f32>>, SceneError> {
        let Some(accessor) = primitive.get(semantic) else { return Ok(None) };
        let name = semantic.to_string();
        let numbers = self.numbers(&name, &accessor, width)?;
        self.same_length(&name, numbers.len() / width, count)?;
        Ok(Some(numbers))
    }

    fn same_length(&self, name: &str, length: usize, count: usize) -> Result<(), SceneError> {
        if length == count { Ok(()) } else { Err(self.fail(format!("{name} has {length} elements, POSITION has {count}"))) }
    }

    /// Three numbers for each vertex of a morph target.
    fn deltas(&self, target: usize, name: &str, accessor: Option<Accessor<'_>>, count: usize) -> Result<Vec<Vec3>, SceneError> {
        let Some(accessor) = accessor else { return Ok(Vec::new()) };
        let name = format!("{name} of morph target {target}");
        let numbers = self.numbers(&name, &accessor, 3)?;
        self.same_length(&name, numbers.len() / 3, count)?;
        Ok(numbers.chunks_exact(3).map(Vec3::from_slice).collect())
    }

    fn targets(&self, primitive: &gltf::Primitive<'_>, count: usize) -> Result<Vec<Target>, SceneError> {
        primitive
            .morph_targets()
            .enumerate()
            .map(|(index, target)| {
                Ok(Target {
                    positions: self.deltas(index, "POSITION", target.positions(), count)?,
                    normals: self.deltas(index, "NORMAL", target.normals(), count)?,
                    tangents: self.deltas(index, "TANGENT", target.tangents(), count)?,
                })
            })
            .collect()
    }

    /// Joints and weights of all sets; also how many vertices have no weight at all and follow the first joint that they name.
    fn influences(&self, primitive: &gltf::Primitive<'_>, count: usize) -> Result<Option<(Influences, usize)>, SceneError> {
        let mut sets = Vec::new();
        for set in 0.. {
            let joints = self.attribute(primitive, &Semantic::Joints(set), 4, count)?;
            let weights = self.attribute(primitive, &Semantic::Weights(set), 4, count)?;
            match (joints, weights) {
                (Some(joints), Some(weights)) => sets.push((joints, weights)),
                (None, None) => break,
                _ => return Err(self.fail(format!("of JOINTS_{set} and WEIGHTS_{set} only one is there"))),
            }
        }
        if sets.is_empty() {
            return Ok(None);
        }
        let mut out = Influences { per_vertex: 4 * sets.len(), ..Influences::default() };
        let mut without = 0;
        for vertex in 0..count {
            let row = 4 * vertex..4 * vertex + 4;
            let mut pairs: Vec<(f32, f64)> = sets
                .iter()
                .flat_map(|(joints, weights)| {
                    joints[row.clone()].iter().copied().zip(weights[row.clone()].iter().map(|w| f64::from(*w).max(0.0)))
                })
                .collect();
            let total: f64 = pairs.iter().map(|(_, weight)| weight).sum();
            if total > 0.0 {
                pairs.iter_mut().for_each(|(_, weight)| *weight /= total);
            } else {
                pairs[0].1 = 1.0;
                without += 1;
            }
            for (joint, weight) in pairs {
                // What does not count may be anything.
                if weight > 0.0 && !(joint >= 0.0 && joint.fract() == 0.0 && joint <= 65535.0) {
                    return Err(self.fail(format!("JOINTS of vertex {vertex} is {joint}, but must be a whole number")));
                }
                out.joints.push(if weight > 0.0 { joint as u32 } else { 0 });
                out.weights.push(weight as f32);
            }
        }
        Ok(Some((out, without)))
    }

    /// Linear colours with alpha, each number cut off to [0, 1].
    fn colors(&self, primitive: &gltf::Primitive<'_>, count: usize) -> Result<Vec<Vec4>, SceneError> {
        let semantic = Semantic::Colors(0);
        let width = match primitive.get(&semantic) {
            Some(accessor) if accessor.dimensions() == gltf::accessor::Dimensions::Vec3 => 3,
            _ => 4,
        };
        let numbers = self.attribute(primitive, &semantic, width, count)?.unwrap_or_default();
        let color = |row: &[f32]| Vec4::new(row[0], row[1], row[2], row.get(3).copied().unwrap_or(1.0)).clamp(Vec4::ZERO, Vec4::ONE);
        Ok(numbers.chunks_exact(width).map(color).collect())
    }
}

/// Reads a primitive; `at` says where it stands.
pub(crate) fn read(
    buffers: &Buffers,
    shown: &str,
    at: &str,
    primitive: &gltf::Primitive<'_>,
    reading: &Reading<'_>,
) -> Result<Read, SceneError> {
    let source = Source { buffers, shown, at };
    let mut warnings = Vec::new();
    if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        warnings.push("points and lines are not drawn".to_owned());
        return Ok(Read { warnings, ..Read::default() });
    }
    let accessor = primitive.get(&Semantic::Positions).ok_or_else(|| source.fail("it has no POSITION".into()))?;
    let positions = source.numbers("POSITION", &accessor, 3)?;
    let mut mesh = Mesh { positions: positions.chunks_exact(3).map(Vec3::from_slice).collect(), ..Mesh::default() };
    let count = mesh.positions.len();
    let normals = source.attribute(primitive, &Semantic::Normals, 3, count)?;
    if let Some(normals) = &normals {
        mesh.normals = normals.chunks_exact(3).map(|normal| Vec3::from_slice(normal).as_dvec3().normalize_or_zero().as_vec3()).collect();
    }
    let uvs = |set: u32| -> Result<Option<Vec<Vec2>>, SceneError> {
        let numbers = source.attribute(primitive, &Semantic::TexCoords(set), 2, count)?;
        Ok(numbers.map(|numbers| numbers.chunks_exact(2).map(Vec2::from_slice).collect()))
    };
    let UvSets { first, second } = reading.uv_sets;
    for (set, kept) in [(Some(first), &mut mesh.uvs), (second, &mut mesh.second_uvs)] {
        let Some(set) = set else { continue };
        match uvs(set)? {
            Some(numbers) => *kept = numbers,
            None if reading.textured => warnings.push(format!("{at}: its material reads TEXCOORD_{set}, which it does not have")),
            None => {}
        }
    }
    mesh.colors = source.colors(primitive, count)?;
    // Tangents mean nothing without the normals they belong to (glTF 2.0, section 3.7.2.1).
    let needs_tangents = reading.normal_map.is_some();
    let tangents = if needs_tangents && normals.is_some() { source.attribute(primitive, &Semantic::Tangents, 4, count)? } else { None };
    if let Some(tangents) = &tangents {
        mesh.tangents = tangents.chunks_exact(4).map(unit_tangent).collect();
    }
    let indices = match primitive.indices() {
        Some(accessor) => buffers.indices(shown, &accessor)?,
        None => (0..u32::try_from(count).map_err(|_| source.fail("it has more than 2^32 vertices".into()))?).collect(),
    };
    if let Some(index) = indices.iter().find(|index| **index as usize >= count) {
        return Err(source.fail(format!("index {index} is out of range: it has {count} vertices")));
    }
    mesh.indices = triangles(primitive.mode(), &indices);
    let targets = source.targets(primitive, count)?;
    let influences = source.influences(primitive, count)?;
    if let Some((_, without @ 1..)) = influences {
        warnings.push(format!("{at}: {without} vertices have no weight and follow the first joint that they name"));
    }
    let mut rest = Rest { targets, influences: influences.map(|(influences, _)| influences), ..Rest::default() };
    // A triangle without area may have one when joints and targets have moved it.
    let dropped = if rest.can_move() { 0 } else { mesh.drop_degenerate() };
    if mesh.indices.is_empty() {
        return Ok(Read { warnings, dropped, rest: None });
    }
    // The vertex of the file that each vertex was: triangles that share none are made below.
    let mut from: Option<Vec<u32>> = None;
    if normals.is_none() {
        from = Some(mesh.indices.clone());
        mesh.flat_normals();
        rest.flat = true;
    } else if let missing @ 1.. = mesh.mend_normals() {
        warnings.push(format!("{at}: {missing} normals are zero and replaced by those of their triangles"));
    }
    if let (Some(map), true) = (reading.normal_map, tangents.is_none()) {
        let textured = !if map.uv_set == crate::UvSet::Second { &mesh.second_uvs } else { &mesh.uvs }.is_empty();
        let order = mesh.indices.clone();
        if textured {
            from = Some(from.map_or_else(|| order.clone(), |from| order.iter().map(|vertex| from[*vertex as usize]).collect()));
            rest.normal_map = Some(*map);
        }
        if !(textured && tangents::generate(&mut mesh, map)) {
            warnings.push(format!("{at}: its normal map is ignored, for it has no usable texture coordinates"));
        }
    }
    mesh.fill();
    if let (Some(from), true) = (from, rest.can_move()) {
        rest.pick(&from);
    }
    rest.mesh = mesh;
    Ok(Read { rest: Some(rest), warnings, dropped })
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
