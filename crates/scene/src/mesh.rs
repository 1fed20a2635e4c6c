//! Triangle meshes.

use glam::{DVec3, Vec2, Vec3, Vec4};

/// An indexed triangle mesh. All arrays but `indices` have one element per vertex, or none where they say so.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Local coordinates.
    pub positions: Vec<Vec3>,
    /// Unit; flat where the file has none.
    pub normals: Vec<Vec3>,
    /// Unit xyz and handedness w = +-1; all 0 where no normal map needs them.
    pub tangents: Vec<Vec4>,
    /// (0, 0) is the top left corner of the image. The first of the file's sets that the material's textures read.
    pub uvs: Vec<Vec2>,
    /// The other set of texture coordinates that the material's textures read; empty where all read the same.
    pub second_uvs: Vec<Vec2>,
    /// Linear colour and alpha, each in [0, 1], that the base colour is multiplied with; empty where the file has none.
    pub colors: Vec<Vec4>,
    /// Three per triangle.
    pub indices: Vec<u32>,
    /// Index into the scene's materials.
    pub material: usize,
}

/// A triangle in scene space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Corners, metres.
    pub positions: [Vec3; 3],
    /// Index into the scene's instances.
    pub instance: usize,
    /// Index into the scene's materials.
    pub material: usize,
}

impl Mesh {
    /// Gives every triangle its own three vertices.
    pub(crate) fn unweld(&mut self) {
        let order: Vec<usize> = self.indices.iter().map(|index| *index as usize).collect();
        fn pick<T: Copy>(values: &mut Vec<T>, order: &[usize]) {
            if !values.is_empty() {
                *values = order.iter().map(|index| values[*index]).collect();
            }
        }
        pick(&mut self.positions, &order);
        pick(&mut self.normals, &order);
        pick(&mut self.tangents, &order);
        pick(&mut self.uvs, &order);
        pick(&mut self.second_uvs, &order);
        pick(&mut self.colors, &order);
        self.indices = (0..order.len() as u32).collect();
    }

    /// Takes away triangles without area and returns how many there were.
    pub(crate) fn drop_degenerate(&mut self) -> usize {
        let before = self.indices.len();
        let kept: Vec<u32> = self
            .indices
            .chunks_exact(3)
            .filter(|corners| {
                let [a, b, c] = [0, 1, 2].map(|corner| self.positions[corners[corner] as usize].as_dvec3());
                (b - a).cross(c - a).length_squared() > 0.0
            })
            .flatten()
            .copied()
            .collect();
        self.indices = kept;
        (before - self.indices.len()) / 3
    }

    /// Gives every triangle its own normal.
    pub(crate) fn flat_normals(&mut self) {
        self.normals.clear();
        self.unweld();
        self.set_flat_normals();
    }

    /// As [`Mesh::flat_normals`], for triangles that share no vertex and stand in order.
    pub(crate) fn set_flat_normals(&mut self) {
        self.normals = self
            .positions
            .chunks_exact(3)
            .flat_map(|corners| {
                let [a, b, c] = [corners[0], corners[1], corners[2]].map(|corner| corner.as_dvec3());
                [(b - a).cross(c - a).normalize_or_zero().as_vec3(); 3]
            })
            .collect();
    }

    /// Replaces zero normals by those of the triangles around them, weighted by area, and returns how many there were.
    pub(crate) fn mend_normals(&mut self) -> usize {
        let zero: Vec<bool> = self.normals.iter().map(|normal| *normal == Vec3::ZERO).collect();
        let count = zero.iter().filter(|zero| **zero).count();
        if count == 0 {
            return 0;
        }
        let mut sums = vec![DVec3::ZERO; self.normals.len()];
        for corners in self.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|corner| self.positions[corners[corner] as usize].as_dvec3());
            for corner in corners {
                sums[*corner as usize] += (b - a).cross(c - a);
            }
        }
        for ((normal, zero), sum) in self.normals.iter_mut().zip(zero).zip(sums) {
            if zero {
                // Where triangles cancel, or none is left, any direction is as good as another.
                *normal = sum.try_normalize().unwrap_or(DVec3::Y).as_vec3();
            }
        }
        count
    }

    /// Fills what no file gave with zeros, so that all arrays are as long as the positions but those that may be empty.
    pub(crate) fn fill(&mut self) {
        let count = self.positions.len();
        self.uvs.resize(count, Vec2::ZERO);
        self.tangents.resize(count, Vec4::ZERO);
        self.normals.resize(count, Vec3::ZERO);
    }
}
