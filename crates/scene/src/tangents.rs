//! Tangents where a file has none: Mikkelsen's tangent space, as glTF asks.

use crate::Mesh;
use glam::{Vec3, Vec4};

struct Corners<'a>(&'a mut Mesh);

impl bevy_mikktspace::Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.0.indices.len() / 3
    }
    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }
    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.0.positions[3 * face + corner].to_array()
    }
    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.0.normals[3 * face + corner].to_array()
    }
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        // The algorithm's v points up, glTF's down.
        let uv = self.0.uvs[3 * face + corner];
        [uv.x, 1.0 - uv.y]
    }
    fn set_tangent(&mut self, tangent: Option<bevy_mikktspace::TangentSpace>, face: usize, corner: usize) {
        let encoded = tangent.map(|space| Vec4::from_array(space.tangent_encoded())).filter(|tangent| tangent.is_finite());
        self.0.tangents[3 * face + corner] = encoded.unwrap_or(Vec4::ZERO);
    }
}

/// Computes tangents; vertices are unwelded, for tangents differ between triangles that share one. `false` if the mesh has no usable texture coordinates.
pub(crate) fn generate(mesh: &mut Mesh) -> bool {
    mesh.unweld();
    mesh.tangents = vec![Vec4::ZERO; mesh.positions.len()];
    let made = bevy_mikktspace::generate_tangents(&mut Corners(mesh)).is_ok();
    made && mesh.tangents.iter().any(|tangent| tangent.truncate() != Vec3::ZERO)
}
