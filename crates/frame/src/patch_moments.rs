use crate::{ReflectiveShadowMapShape, SamplingDensityShape};
use lobelia_graph::{BufferPart, ParamValue, Part, PartSet, PortError, Resource, Specialisation, Values};
use serde::{Deserialize, Serialize};
use wgpu::BufferUsages;

/// How the sharpness of a lobe is coded as the length of its mean direction, so that lobes can be averaged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LobeLength {
    /// `coth(sharpness) - 1/sharpness` and a corrected inverse: within 0.1 % (a form of this project).
    #[default]
    Exact,
    /// `sharpness / (1 + sharpness)` (Toksvig 2005): averages of broad lobes come out up to 67 % too flat.
    Toksvig,
    /// The cubic of Laurijssen et al. 2010, whose inverse is Banerjee et al. 2005: within 5 %.
    Banerjee,
}

impl ParamValue for LobeLength {
    fn kind() -> String {
        "exact, toksvig or banerjee".into()
    }
}

impl LobeLength {
    /// The flags of `lobelia::patch_moments`.
    pub fn specialisations(self) -> Vec<Specialisation> {
        let reason = format!("lobe_length is {}", ["exact", "toksvig", "banerjee"][self as usize]);
        vec![
            Specialisation::new("LOBE_TOKSVIG", self == Self::Toksvig, reason.clone()),
            Specialisation::new("LOBE_BANERJEE", self == Self::Banerjee, reason),
        ]
    }
}

/// Shape of [`PatchMoments`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PatchMomentsShape {
    /// Side of each face of the reflective shadow map in texels.
    pub resolution: u32,
    /// Faces of that map.
    pub faces: u32,
    /// Whether there are specular lobes.
    pub specular: bool,
    /// How their sharpness is coded.
    pub lobe_length: LobeLength,
}

impl PatchMomentsShape {
    /// The finest level that is stored: blocks of 4 x 4 texels. Finer ones are made from the map itself where they are needed.
    pub const FIRST_LEVEL: u32 = 2;

    /// Side of the finest level: `resolution`, rounded up to a power of two.
    pub fn side(&self) -> u32 {
        SamplingDensityShape { resolution: self.resolution, faces: self.faces }.side()
    }

    /// Number of levels, the two that are not stored among them; the last has one record a face.
    pub fn levels(&self) -> u32 {
        self.side().ilog2() + 1
    }

    /// Bytes of a record: 64, or 48 without specular lobes.
    pub fn record_bytes(&self) -> u64 {
        if self.specular { 64 } else { 48 }
    }

    /// Bytes of all records.
    pub fn bytes(&self) -> u64 {
        let first = u64::from(self.side() >> Self::FIRST_LEVEL).pow(2);
        u64::from(self.faces.max(1)) * ((4 * first - 1) / 3) * self.record_bytes()
    }

    /// Refuses moments of another map than the one that lights are picked from.
    pub fn check(&self, rsm: &ReflectiveShadowMapShape) -> Result<(), PortError> {
        if (self.resolution, self.faces) == (rsm.resolution, rsm.faces) {
            return Ok(());
        }
        let message = format!(
            "they are of {} faces of {} texels a side, not of the {} faces of {} of the map that lights are picked from",
            self.faces, self.resolution, rsm.faces, rsm.resolution
        );
        Err(PortError::at("moments", message).help("connect both to the same reflective shadow map"))
    }
}

/// Averages of patches over blocks of 4 x 4, 8 x 8, ... texels of a reflective shadow map: position and its variance, normal, reflected flux, and the
/// direction of specular lobes with their width.
///
/// Records lie level by level, each with its faces one after the other, row by row; `lobelia::patch_moments` gives addresses and meaning.
#[derive(Clone, Debug)]
pub struct PatchMoments {
    /// Storage array of records.
    pub moments: BufferPart,
    /// Size and options.
    pub shape: PatchMomentsShape,
}

impl Resource for PatchMoments {
    const NAME: &'static str = "PatchMoments";
    const DOC: &'static str =
        "Averages of patches over blocks of texels: position and variance, normal, reflected flux (W), specular lobe.";
    type Shape = PatchMomentsShape;

    fn parts(shape: &PatchMomentsShape) -> Vec<Part> {
        // Words: position 0-2, variance 3, diffuse 4-6, packed 7; then specular 8-10, packed 11, two spreads 12-13, or one spread 8.
        let (mask, non_negative) =
            if shape.specular { (0b0011_0111_0111_1111, 0b0011_0111_0111_1000) } else { (0b0000_0001_0111_1111, 0b0000_0001_0111_1000) };
        let values = Values::Records { stride: (shape.record_bytes() / 4) as u32, mask, non_negative };
        let flux = if shape.specular { 0b0000_0111_0111_0000 } else { 0b0000_0000_0111_0000 };
        vec![Part::buffer("moments", shape.bytes(), BufferUsages::STORAGE).values(values).light(flux)]
    }

    fn assemble(shape: &PatchMomentsShape, parts: &PartSet) -> Self {
        Self { moments: parts.buffer("moments"), shape: *shape }
    }
}
