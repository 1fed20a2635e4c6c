//! Random outlines, and the walk along them that passes do.

use glam::DVec3;
use lobelia::lobes::sampling::{hash, unit_float};

/// Corners of a row.
pub const CORNERS: usize = 10;

/// An outline as the device gets it: corners, in w of the first their number.
pub type Row = [[f32; 4]; CORNERS];

/// Structs and the walk: `walk_row` calls `piece` for every arc above the horizon.
pub const WALK: &str = "
struct Row { corners: array<vec4f, 10> }
fn walk_row(row: Row) {
    var walk: OutlineWalk;
    let count = u32(row.corners[0].w);
    var previous = row.corners[count - 1u].xyz;
    var index = 0u;
    while index < count || walk.waits {
        var line: OutlineLine;
        if walk.waits {
            line = take_horizon(&walk);
        } else {
            let next = row.corners[index].xyz;
            index += 1u;
            line = walk_outline(&walk, previous, next, index == count);
            previous = next;
        }
        if any(line.start != line.to) { piece(great_arc(line.start, line.to)); }
    }
}
";

/// Numbers in [0, 1) that follow each other.
pub struct Numbers(u32, u32);

impl Numbers {
    pub fn new(index: u32) -> Self {
        Self(index, 0)
    }

    pub fn next(&mut self) -> f64 {
        self.1 += 1;
        unit_float(hash(self.0 ^ hash(self.1)))
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub fn direction(&mut self) -> DVec3 {
        let (z, azimuth) = (self.between(-1.0, 1.0), self.between(0.0, std::f64::consts::TAU));
        DVec3::new((1.0 - z * z).sqrt() * azimuth.cos(), (1.0 - z * z).sqrt() * azimuth.sin(), z)
    }
}

/// A light near the direction `towards`: three to ten corners, every third outline a star; sizes from 1e-3 to 10 times its distance. Corners are exact
/// in 32 bits, and run counter-clockwise as seen from the origin.
pub fn outline(numbers: &mut Numbers, towards: DVec3, spread: f64) -> Vec<DVec3> {
    let center = (towards + numbers.direction() * spread).normalize_or(DVec3::Z) * 10f64.powf(numbers.between(-1.0, 1.0));
    let (a, b) = numbers.direction().any_orthonormal_pair();
    let size = center.length() * 10f64.powf(numbers.between(-3.0, 1.0));
    let (a, b) = (a * size, b * size * 10f64.powf(numbers.between(-1.0, 0.0)));
    let star = numbers.next() < 1.0 / 3.0;
    let count = if star { CORNERS } else { 3 + (numbers.next() * 6.0) as usize };
    let mut corners: Vec<DVec3> = (0..count)
        .map(|index| {
            let angle = std::f64::consts::TAU * (index as f64 + 0.6 * numbers.next()) / count as f64;
            let radius = if star && index % 2 == 1 { 0.35 } else { 1.0 };
            (center + (a * angle.cos() + b * angle.sin()) * radius).as_vec3().as_dvec3()
        })
        .collect();
    let normal: DVec3 = (0..count).map(|index| (corners[index] - corners[0]).cross(corners[(index + 1) % count] - corners[0])).sum();
    // Counter-clockwise seen from the origin is left-handed about the line of sight.
    if normal.dot(center) > 0.0 {
        corners.reverse();
    }
    corners
}

pub fn row(corners: &[DVec3]) -> Row {
    let mut row = [[0.0; 4]; CORNERS];
    for (slot, corner) in row.iter_mut().zip(corners) {
        *slot = corner.as_vec3().extend(0.0).to_array();
    }
    row[0][3] = corners.len() as f32;
    row
}
