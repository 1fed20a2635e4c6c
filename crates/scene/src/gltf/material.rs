//! Materials, and how each of their textures lies on a mesh.

use super::{Loader, extensions, specular_glossiness};
use crate::{AlphaMode, Material, Sampler, SceneError, TextureRef, UvSet, Wrap};
use glam::{Affine2, Vec2, Vec3};
use serde_json::Value;

/// The numbers of the texture coordinates that a material's textures read, at most two: which `TEXCOORD_n` of a primitive become its first and second
/// set. Most materials read set 0 alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct UvSets {
    pub first: u32,
    pub second: Option<u32>,
}

impl UvSets {
    /// The two lowest of the sets in use.
    fn of(mut used: Vec<u32>) -> Self {
        used.sort_unstable();
        used.dedup();
        Self { first: used.first().copied().unwrap_or(0), second: used.get(1).copied() }
    }
}

/// A texture of a material as it is written.
struct Written<'a> {
    texture: gltf::Texture<'a>,
    set: u32,
    transform: Affine2,
}

impl<'a> Written<'a> {
    fn new(texture: gltf::Texture<'a>, set: u32, extension: Option<&Value>) -> Result<Self, String> {
        let Some(extension) = extension else { return Ok(Self { texture, set, transform: Affine2::IDENTITY }) };
        let (transform, override_set) = texture_transform(extension)?;
        Ok(Self { texture, set: override_set.unwrap_or(set), transform })
    }

    fn info(info: gltf::texture::Info<'a>) -> Result<Self, String> {
        Self::new(info.texture(), info.tex_coord(), info.extension_value("KHR_texture_transform"))
    }

    /// `image` is the index of the image among the textures of the scene.
    fn reference(&self, image: usize, sets: UvSets) -> TextureRef {
        let wrap = |mode: gltf::texture::WrappingMode| match mode {
            gltf::texture::WrappingMode::Repeat => Wrap::Repeat,
            gltf::texture::WrappingMode::MirroredRepeat => Wrap::Mirror,
            gltf::texture::WrappingMode::ClampToEdge => Wrap::Clamp,
        };
        let sampler = self.texture.sampler();
        let nearest = sampler.mag_filter() == Some(gltf::texture::MagFilter::Nearest);
        TextureRef {
            texture: image,
            sampler: Sampler { wrap_u: wrap(sampler.wrap_s()), wrap_v: wrap(sampler.wrap_t()), nearest },
            uv_set: if sets.second == Some(self.set) { UvSet::Second } else { UvSet::First },
            uv_transform: self.transform,
        }
    }
}

/// `KHR_texture_transform`: scale, then turn, then move; and the set of texture coordinates that it names, if it does. The turn is counter-clockwise in
/// the picture, whose v points down.
fn texture_transform(extension: &Value) -> Result<(Affine2, Option<u32>), String> {
    let number = |value: &Value| value.as_f64().map(|number| number as f32).filter(|number| number.is_finite());
    let pair = |key: &str, otherwise: Vec2| match extension.get(key) {
        None => Ok(otherwise),
        Some(value) => match value.as_array().map(Vec::as_slice) {
            Some([x, y]) => number(x).zip(number(y)).map(Vec2::from),
            _ => None,
        }
        .ok_or_else(|| format!("KHR_texture_transform: `{key}` is not two finite numbers")),
    };
    let rotation = extension.get("rotation").map_or(Some(0.0), number).ok_or("KHR_texture_transform: `rotation` is not a finite number")?;
    let set = match extension.get("texCoord") {
        None => None,
        Some(value) => {
            Some(value.as_u64().and_then(|set| u32::try_from(set).ok()).ok_or("KHR_texture_transform: `texCoord` is not a whole number")?)
        }
    };
    let transform = Affine2::from_scale_angle_translation(pair("scale", Vec2::ONE)?, -rotation, pair("offset", Vec2::ZERO)?);
    Ok((transform, set))
}

impl Loader<'_> {
    pub(super) fn materials(&mut self, gltf: &gltf::Gltf) -> Result<(), SceneError> {
        for material in gltf.materials() {
            let read = self.material(&material)?;
            self.scene.materials.push(read);
        }
        // What primitives without a material get.
        self.scene.materials.push(Material { name: "default".into(), ..Material::default() });
        self.uv_sets.push(UvSets::of(Vec::new()));
        Ok(())
    }

    fn material(&mut self, material: &gltf::Material<'_>) -> Result<Material, SceneError> {
        let name = material.name().map_or_else(|| format!("material {}", material.index().unwrap_or(0)), str::to_owned);
        for (extension, lost) in extensions::lost_of_material(|extension| material.extension_value(extension)) {
            self.warn(format!("{extension} is not drawn: {lost}"));
        }
        let mut read = Material {
            emissive: Vec3::from_array(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0),
            normal_scale: material.normal_texture().map_or(1.0, |texture| texture.scale()),
            double_sided: material.double_sided(),
            unlit: material.unlit(),
            name,
            ..Material::default()
        };
        let opacity = self.reflectance(material, &mut read)?;
        read.alpha_mode = match material.alpha_mode() {
            gltf::material::AlphaMode::Opaque => AlphaMode::Opaque,
            gltf::material::AlphaMode::Mask => AlphaMode::Mask { cutoff: texture_cutoff(material.alpha_cutoff().unwrap_or(0.5), opacity) },
            gltf::material::AlphaMode::Blend => {
                self.warn("blended materials are drawn opaque");
                AlphaMode::Opaque
            }
        };
        self.check_material(&read, opacity)?;
        Ok(read)
    }

    /// What it reflects, with all its textures; returns the alpha of the base colour.
    fn reflectance(&mut self, material: &gltf::Material<'_>, read: &mut Material) -> Result<f32, SceneError> {
        let (shown, name) = (self.shown, read.name.clone());
        let fail = |message: String| SceneError::content(shown, format!("material `{name}`: {message}"));
        let glossy = if read.unlit { None } else { material.pbr_specular_glossiness() };
        let pbr = material.pbr_metallic_roughness();
        let (base, rough) = match &glossy {
            Some(glossy) => (glossy.diffuse_texture(), glossy.specular_glossiness_texture()),
            None => (pbr.base_color_texture(), pbr.metallic_roughness_texture()),
        };
        let normal = material.normal_texture().map(|info| {
            let transform = info.extension_value("KHR_texture_transform");
            Written::new(info.texture(), info.tex_coord(), transform)
        });
        let emissive = material.emissive_texture().map(Written::info);
        let [base, rough] = [base, rough].map(|info| info.map(Written::info));
        let mut written = [None, None, None, None];
        for (place, texture) in [base, rough, normal, emissive].into_iter().enumerate() {
            written[place] = texture.transpose().map_err(fail)?;
        }
        if read.unlit {
            // Only the base colour is drawn.
            written[1..].iter_mut().for_each(|written| *written = None);
            read.emissive = Vec3::ZERO;
        }
        let used: Vec<u32> = written.iter().flatten().map(|written| written.set).collect();
        let sets = UvSets::of(used.clone());
        if let Some(lost) = used.iter().find(|set| **set != sets.first && Some(**set) != sets.second) {
            self.warn(format!(
                "material `{}` reads more than two sets of texture coordinates: what reads set {lost} reads set {}",
                read.name, sets.first
            ));
        }
        self.uv_sets.push(sets);
        let mut found = [None; 4];
        for (found, written) in found.iter_mut().zip(&written) {
            let Some(written) = written else { continue };
            *found = self.image(written.texture.index(), &read.name)?.map(|image| written.reference(image, sets));
        }
        [read.base_color_texture, read.metallic_roughness_texture, read.normal_texture, read.emissive_texture] = found;
        if let Some(glossy) = glossy {
            return self.specular_glossiness(&glossy, read);
        }
        let [red, green, blue, opacity] = pbr.base_color_factor();
        (read.base_color, read.metallic, read.roughness) = (Vec3::new(red, green, blue), pbr.metallic_factor(), pbr.roughness_factor());
        self.dielectric(material, read)?;
        Ok(opacity)
    }

    /// The image of a texture. One that cannot be read is an error, or none where unsupported files are allowed.
    fn image(&mut self, texture: usize, material: &str) -> Result<Option<usize>, SceneError> {
        match self.images.of_texture(&self.buffers, texture) {
            Ok(image) => Ok(Some(image)),
            Err(message) if self.allow_unsupported => {
                self.warn(format!("{message}; material `{material}` goes without it"));
                Ok(None)
            }
            Err(message) => Err(self.fail(message)),
        }
    }

    /// `KHR_materials_ior` and `KHR_materials_specular`.
    fn dielectric(&mut self, material: &gltf::Material<'_>, read: &mut Material) -> Result<(), SceneError> {
        let specular = material.specular();
        if material.ior().is_none() && specular.is_none() {
            return Ok(());
        }
        // An index of 0 stands for a mirror, by the same formula.
        let ior = f64::from(material.ior().unwrap_or(1.5));
        let normal = ((ior - 1.0) / (ior + 1.0)).powi(2) as f32;
        let (mut factor, mut color) = (1.0, Vec3::ONE);
        if let Some(specular) = specular {
            (factor, color) = (specular.specular_factor(), Vec3::from_array(specular.specular_color_factor()));
            if specular.specular_texture().is_some() || specular.specular_color_texture().is_some() {
                self.warn("textures of KHR_materials_specular are not read: its factors hold alone");
            }
        }
        let fine = ior >= 0.0 && ior.is_finite() && (0.0..=1.0).contains(&factor) && color.is_finite() && color.min_element() >= 0.0;
        if !fine {
            let what = format!(
                "material `{}`: its index of refraction is {ior}, its specularFactor {factor} and its specularColorFactor {color}; the first and \
                 the last must not be negative, and the factor must lie in [0, 1]",
                read.name
            );
            return Err(self.fail(what));
        }
        read.dielectric = ((color * normal).min(Vec3::ONE) * factor).extend(factor);
        Ok(())
    }

    /// `KHR_materials_pbrSpecularGlossiness`; returns the alpha of the diffuse colour. Its textures stand where those of the base colour and of metallic and
    /// roughness do.
    fn specular_glossiness(&mut self, glossy: &gltf::material::PbrSpecularGlossiness<'_>, read: &mut Material) -> Result<f32, SceneError> {
        let [red, green, blue, opacity] = glossy.diffuse_factor();
        let (diffuse, specular) = (Vec3::new(red, green, blue), Vec3::from_array(glossy.specular_factor()));
        let gloss = glossy.glossiness_factor();
        let fine = |values: &[f32]| values.iter().all(|value| (0.0..=1.0).contains(value));
        if !fine(&diffuse.to_array()) || !fine(&specular.to_array()) || !fine(&[gloss]) {
            let what = format!("material `{}`: its diffuse, specular and glossiness factors must lie in [0, 1]", read.name);
            return Err(self.fail(what));
        }
        read.metallic = 0.0;
        read.roughness = 1.0 - gloss;
        let Some(map) = read.metallic_roughness_texture else {
            // What is not reflected at the surface is left for the diffuse part.
            read.base_color = diffuse * (1.0 - specular.max_element());
            read.dielectric = specular.extend(1.0);
            return Ok(opacity);
        };
        let same = |other: TextureRef| (other.sampler, other.uv_set, other.uv_transform) == (map.sampler, map.uv_set, map.uv_transform);
        if read.base_color_texture.is_some_and(|base| !same(base)) {
            let what = format!(
                "material `{}`: its diffuse and its specular texture lie differently on the mesh; the specular one is ignored",
                read.name
            );
            self.warn(what);
            read.metallic_roughness_texture = None;
            read.base_color = diffuse * (1.0 - specular.max_element());
            read.dielectric = specular.extend(1.0);
            return Ok(opacity);
        }
        self.warn("specular-glossiness textures are converted to metallic and roughness: colours of dielectric reflections are lost");
        let factors = specular_glossiness::Factors { diffuse, specular, gloss };
        let textures = &mut self.images.textures;
        let diffuse_texture = read.base_color_texture.map(|base| &textures[base.texture]);
        let [base, rough] = specular_glossiness::converted(factors, diffuse_texture, &textures[map.texture], &read.name);
        textures.extend([base, rough]);
        let texture = |place: usize| Some(TextureRef { texture: place, ..map });
        (read.base_color_texture, read.metallic_roughness_texture) = (texture(textures.len() - 2), texture(textures.len() - 1));
        (read.base_color, read.metallic, read.roughness) = (Vec3::ONE, 1.0, 1.0);
        Ok(opacity)
    }

    fn check_material(&self, read: &Material, opacity: f32) -> Result<(), SceneError> {
        if !(0.0..=1.0).contains(&opacity) {
            return Err(self.fail(format!("material `{}`: the alpha of its base colour is {opacity}, but must lie in [0, 1]", read.name)));
        }
        if let AlphaMode::Mask { cutoff } = read.alpha_mode
            && cutoff < 0.0
        {
            return Err(self.fail(format!("material `{}`: its alphaCutoff is negative", read.name)));
        }
        let numbers = [read.metallic, read.roughness, read.normal_scale]
            .into_iter()
            .chain(read.base_color.to_array())
            .chain(read.emissive.to_array());
        if numbers.clone().any(|number| !number.is_finite()) || read.emissive.min_element() < 0.0 {
            return Err(self.fail(format!("material `{}`: factors must be finite and emission not negative", read.name)));
        }
        let in_unit = |value: f32| (0.0..=1.0).contains(&value);
        if !read.base_color.to_array().into_iter().chain([read.metallic, read.roughness]).all(in_unit) {
            return Err(self.fail(format!("material `{}`: base colour, metallic and roughness must lie in [0, 1]", read.name)));
        }
        Ok(())
    }
}

/// The cutoff for the texture's alpha alone: glTF compares its product with the factor's alpha. Above 1 nothing is left.
fn texture_cutoff(cutoff: f32, opacity: f32) -> f32 {
    if cutoff <= opacity { cutoff / opacity.max(f32::MIN_POSITIVE) } else { AlphaMode::NOTHING_LEFT }
}
