//! Tangents where a file has none: Mikkelsen's tangent space, as glTF asks.

use crate::{Mesh, TextureRef};
use glam::{Vec2, Vec3, Vec4};

/// A mesh, and where its normal map is read: one pair of texture coordinates for each corner.
struct Corners<'a>(&'a mut Mesh, &'a [Vec2]);

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
        let uv = self.1[3 * face + corner];
        [uv.x, 1.0 - uv.y]
    }
    fn set_tangent(&mut self, tangent: Option<bevy_mikktspace::TangentSpace>, face: usize, corner: usize) {
        let encoded = tangent.map(|space| Vec4::from_array(space.tangent_encoded())).filter(|tangent| tangent.is_finite());
        self.0.tangents[3 * face + corner] = encoded.unwrap_or(Vec4::ZERO);
    }
}

/// Computes tangents along the normal map `map` as it lies on the mesh, moved, turned and scaled; vertices are unwelded, for tangents differ between
/// triangles that share one. `false` if the mesh has no usable texture coordinates.
pub(crate) fn generate(mesh: &mut Mesh, map: &TextureRef) -> bool {
    mesh.unweld();
    mesh.tangents = vec![Vec4::ZERO; mesh.positions.len()];
    let at = |uvs: &[Vec2], vertex: usize| uvs.get(vertex).copied().unwrap_or_default().as_dvec2();
    let uvs: Vec<Vec2> =
        (0..mesh.positions.len()).map(|vertex| map.uv(at(&mesh.uvs, vertex), at(&mesh.second_uvs, vertex)).as_vec2()).collect();
    let made = bevy_mikktspace::generate_tangents(&mut Corners(mesh, &uvs)).is_ok();
    made && mesh.tangents.iter().any(|tangent| tangent.truncate() != Vec3::ZERO)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use crate::{Scene, TextureRef};
    use glam::Vec4;

    /// Tangents that other programs wrote into files, generated anew.
    #[test]
    fn generated_tangents_are_those_of_files_that_have_them() {
        let root = std::env::var("LOBELIA_SHARED").unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared").into());
        for file in ["scenes/atrium/atrium.glb", "scenes/flight-helmet/FlightHelmet.gltf"] {
            let path = format!("{root}/{file}");
            if !std::path::Path::new(&path).exists() {
                eprintln!("skipped: {path} is not there (LOBELIA_SHARED names another place)");
                continue;
            }
            let scene = Scene::load(&path).unwrap();
            let (mut corners, mut same) = (0, 0);
            for mesh in scene.meshes.iter().filter(|mesh| mesh.tangents.iter().any(|tangent| *tangent != Vec4::ZERO)) {
                let mut anew = mesh.clone();
                assert!(super::generate(&mut anew, &TextureRef::default()));
                for (corner, index) in mesh.indices.iter().enumerate() {
                    let (theirs, ours) = (mesh.tangents[*index as usize], anew.tangents[corner]);
                    corners += 1;
                    // Programs differ a little where they weld vertices; the handedness must never differ.
                    same += usize::from(theirs.truncate().dot(ours.truncate()) > 0.99 && theirs.w == ours.w);
                }
            }
            assert!(corners > 10_000 && same as f64 > 0.98 * corners as f64, "{file}: {same} of {corners} tangents are the same");
        }
    }
}
