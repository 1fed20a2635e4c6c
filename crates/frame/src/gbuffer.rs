use lobelia_graph::{Part, PartSet, Resource, Specialisation, TexturePart, Values};
use lobelia_scene::{Ndf, SceneTraits};
use wgpu::{TextureFormat, TextureUsages};

/// Which optional parts of a packed surface exist. Each names the shader flag that switches the matching code on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SurfaceFlags {
    /// `SPECULAR`: roughness, metallic and specular scale. Off: every surface is Lambertian.
    pub specular: bool,
    /// `NORMAL_MAP`: a geometric normal beside the shading normal. Off: they are the same.
    pub normal_map: bool,
    /// `EMISSIVE`: emitted radiance. Off: none.
    pub emissive: bool,
    /// `DIELECTRIC`: reflectance of dielectrics beside roughness and metallic. Off, and without `specular`: index of refraction 1.5.
    pub dielectric: bool,
}

impl SurfaceFlags {
    /// What the scene requires.
    pub fn of(traits: &SceneTraits) -> Self {
        Self {
            specular: traits.specular,
            normal_map: traits.normal_maps,
            // What is drawn in its colour whatever the light is seen as emission is.
            emissive: traits.emissive || traits.unlit,
            dielectric: traits.specular && traits.dielectric,
        }
    }

    /// What drawing the scene's surfaces requires beside these flags, with reasons: `ALPHA_MASK`, and where the scene has them `VERTEX_COLOR`, `SECOND_UV`,
    /// `TEXTURE_TRANSFORM` and `UNLIT`.
    pub fn drawing(traits: &SceneTraits) -> Vec<Specialisation> {
        let mask = traits.alpha_mask;
        let reason = if mask { "a material is cut out by alpha" } else { "no material is cut out by alpha" };
        let mut found = vec![Specialisation::new("ALPHA_MASK", mask, reason)];
        let rare = [
            ("VERTEX_COLOR", traits.vertex_colors, "a mesh has colours"),
            ("SECOND_UV", traits.second_uvs, "a material reads two sets of texture coordinates"),
            ("TEXTURE_TRANSFORM", traits.texture_transforms, "a texture is moved, turned, scaled or read at the second set"),
            ("UNLIT", traits.unlit, "a material is drawn in its colour whatever the light"),
        ];
        found.extend(rare.into_iter().filter(|(_, on, _)| *on).map(|(name, on, reason)| Specialisation::new(name, on, reason)));
        found
    }

    fn dielectric_specialisation(self) -> Option<Specialisation> {
        self.dielectric.then(|| Specialisation::new("DIELECTRIC", true, "a dielectric's index of refraction is not 1.5"))
    }

    /// The flags with their reasons, for [`lobelia_graph::Pass::specialise`].
    pub fn specialisations(self) -> Vec<Specialisation> {
        let flag = |name, on: bool, some: &str, none: &str| Specialisation::new(name, on, if on { some } else { none });
        let mut found = vec![
            flag(
                "SPECULAR",
                self.specular,
                "a material has a specular lobe",
                "no material has a specular lobe: roughness target and lobe dropped",
            ),
            flag(
                "NORMAL_MAP",
                self.normal_map,
                "a material has a normal map",
                "no material has a normal map: geometric-normal target dropped",
            ),
            flag("EMISSIVE", self.emissive, "a material emits", "no material emits: emission target dropped"),
        ];
        found.extend(self.dielectric_specialisation());
        found
    }

    /// The flags that reflectance depends on, with their reasons: `SPECULAR`, `NORMAL_MAP`, `DIELECTRIC` where it is on, and `NDF_PHONG` for the scene's
    /// distribution.
    pub fn reflectance(self, ndf: Ndf) -> Vec<Specialisation> {
        let specular =
            if self.specular { "a material has a specular lobe" } else { "no material has a specular lobe: the lobe is dropped" };
        let normal_map =
            if self.normal_map { "a material has a normal map" } else { "no material has a normal map: the side test is dropped" };
        let mut found = vec![
            Specialisation::new("SPECULAR", self.specular, specular),
            Specialisation::new("NORMAL_MAP", self.normal_map, normal_map),
            Specialisation::new("NDF_PHONG", self.specular && ndf == Ndf::Phong, format!("the scene's distribution is {ndf}")),
        ];
        found.extend(self.dielectric_specialisation());
        found
    }
}

/// Formats of the packed surface that the G-buffer and the reflective shadow map share; `lobelia::surface` packs and unpacks them.
pub struct SurfaceFormats;

impl SurfaceFormats {
    /// Distance: reverse Z, 1 at the near plane, 0 at infinity (perspective) or at the far plane (orthographic).
    pub const DEPTH: TextureFormat = TextureFormat::Depth32Float;
    /// x: shading normal, octahedral 2 x 16 bit; y: base colour, 11-11-10 bit, square-root encoded.
    pub const CORE: TextureFormat = TextureFormat::Rg32Uint;
    /// Roughness 16 bit, metallic 8 bit, specular scale 8 bit; with `DIELECTRIC` a second word of four 8-bit square roots: reflectance of what is not
    /// metallic at normal incidence, three channels, and at grazing incidence.
    pub fn specular(flags: SurfaceFlags) -> TextureFormat {
        if flags.dielectric { TextureFormat::Rg32Uint } else { TextureFormat::R32Uint }
    }
    /// Geometric normal, octahedral 2 x 16 bit.
    pub const GEOMETRIC_NORMAL: TextureFormat = TextureFormat::R32Uint;
    /// Emitted radiance, 9-9-9 bit with shared 5-bit exponent, times [`lobelia_scene::device::GpuScene::pre_exposure`] (packed words are read back as they are).
    pub const EMISSIVE: TextureFormat = TextureFormat::R32Uint;
}

/// Shape of a [`GBuffer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GBufferShape {
    /// Width and height in pixels.
    pub extent: [u32; 2],
    /// Optional parts.
    pub flags: SurfaceFlags,
}

/// The surface nearest to the camera at every pixel centre: 12 bytes a texel, 24 with every option.
///
/// Positions are rebuilt from `depth` by `lobelia::scene::scene_position` as `camera + ray * near / depth`, without a matrix inverse: the relative
/// error of the distance is about 2^-23 and does not depend on where the scene lies in the world.
#[derive(Clone, Debug)]
pub struct GBuffer {
    /// `near / view depth`; 0 where nothing is seen.
    pub depth: TexturePart,
    /// [`SurfaceFormats::CORE`].
    pub core: TexturePart,
    /// [`SurfaceFormats::specular`], if `SPECULAR`.
    pub specular: Option<TexturePart>,
    /// [`SurfaceFormats::GEOMETRIC_NORMAL`], if `NORMAL_MAP`.
    pub geometric_normal: Option<TexturePart>,
    /// [`SurfaceFormats::EMISSIVE`], if `EMISSIVE`.
    pub emissive: Option<TexturePart>,
    /// Size and options.
    pub shape: GBufferShape,
}

pub(crate) fn surface_parts(extent: [u32; 2], layers: u32, flags: SurfaceFlags, array: bool) -> Vec<Part> {
    let usage = TextureUsages::RENDER_ATTACHMENT;
    let texture = |name, format| {
        let part = Part::layered_texture(name, format, extent, layers, usage);
        if array { part.always_array() } else { part }
    };
    let mut parts = vec![texture("depth", SurfaceFormats::DEPTH).values(Values::NonNegative), texture("core", SurfaceFormats::CORE)];
    if flags.specular {
        parts.push(texture("specular", SurfaceFormats::specular(flags)));
    }
    if flags.normal_map {
        parts.push(texture("geometric_normal", SurfaceFormats::GEOMETRIC_NORMAL));
    }
    if flags.emissive {
        parts.push(texture("emissive", SurfaceFormats::EMISSIVE));
    }
    parts
}

impl Resource for GBuffer {
    const NAME: &'static str = "GBuffer";
    const DOC: &'static str =
        "The surface nearest to the camera at every pixel: depth, normals, base colour, roughness, metallic, emission.";
    type Shape = GBufferShape;

    fn parts(shape: &GBufferShape) -> Vec<Part> {
        surface_parts(shape.extent, 1, shape.flags, false)
    }

    fn assemble(shape: &GBufferShape, parts: &PartSet) -> Self {
        Self {
            depth: parts.texture("depth"),
            core: parts.texture("core"),
            specular: parts.find_texture("specular"),
            geometric_normal: parts.find_texture("geometric_normal"),
            emissive: parts.find_texture("emissive"),
            shape: *shape,
        }
    }
}
