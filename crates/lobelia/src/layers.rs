//! Layers for compositing: the G-buffer decoded, and pictures of many layers in one EXR file.
//!
//! | layer | channels | holds | where nothing is seen |
//! | --- | --- | --- | --- |
//! | `normal` | X Y Z | shading normal, world axes, unit, turned to the camera | 0 |
//! | `geometric_normal` | X Y Z | the same without the normal map | 0 |
//! | `base_color` | R G B | linear, in [0, 1] | 0 |
//! | `roughness` | V | perceptual roughness, in [0, 1]; 1 where no material of the scene has a specular lobe | 0 |
//! | `metallic` | V | in [0, 1] | 0 |
//! | `specular` | V | scale of the specular lobe, in [0, 1]; not F0, which is not a layer | 0 |
//! | `emissive` | R G B | radiance that the surface emits towards the camera, W/(sr m^2) | 0 |
//! | `depth` | Z | distance along the view axis, metres: a plane that faces the camera has one depth | [`NO_DEPTH`] |
//! | `position` | X Y Z | world space, metres | 0 |
//!
//! Values are as exact as the G-buffer: normals within 6.5e-5 rad, base colour to 11-11-10 bits of its square root, roughness to 16 bits, metallic and
//! specular to 8, emission to 2^-9 of its largest channel, depth to 2^-23. Positions are computed in `f64` and rounded to `f32` at the end.

use crate::{Rendering, SessionError};
use exr::prelude as files;
use glam::DVec3;
use lobelia_frame::{GBuffer, Radiance, SceneWorld};
use lobelia_graph::{Part, PartData, Plan, PlanOptions, Resource, Wired};
use lobelia_lobes::{
    octahedral::octahedral_unpack,
    packing::{unpack_color, unpack_shared_exponent, unpack_specular},
};
use lobelia_scene::SceneTraits;
use std::path::Path;

/// What the layer `depth` holds where nothing is seen, metres: farther than anything, and finite, so that filters take it.
pub const NO_DEPTH: f32 = 1e10;

/// A layer of the decoded G-buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Shading normal, world axes.
    Normal,
    /// Normal without the normal map, world axes.
    GeometricNormal,
    /// Linear base colour.
    BaseColor,
    /// Perceptual roughness.
    Roughness,
    /// Share of metal.
    Metallic,
    /// Scale of the specular lobe.
    Specular,
    /// Emitted radiance, W/(sr m^2).
    Emissive,
    /// Distance along the view axis, metres.
    Depth,
    /// World position, metres.
    Position,
}

impl Layer {
    /// All of them.
    pub const ALL: [Layer; 9] = [
        Layer::Normal,
        Layer::GeometricNormal,
        Layer::BaseColor,
        Layer::Roughness,
        Layer::Metallic,
        Layer::Specular,
        Layer::Emissive,
        Layer::Depth,
        Layer::Position,
    ];

    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Normal => "normal",
            Layer::GeometricNormal => "geometric_normal",
            Layer::BaseColor => "base_color",
            Layer::Roughness => "roughness",
            Layer::Metallic => "metallic",
            Layer::Specular => "specular",
            Layer::Emissive => "emissive",
            Layer::Depth => "depth",
            Layer::Position => "position",
        }
    }

    /// By name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|layer| layer.name() == name)
    }

    fn channels(self) -> &'static [&'static str] {
        match self {
            Layer::Normal | Layer::GeometricNormal | Layer::Position => &["X", "Y", "Z"],
            Layer::BaseColor | Layer::Emissive => &["R", "G", "B"],
            Layer::Roughness | Layer::Metallic | Layer::Specular => &["V"],
            Layer::Depth => &["Z"],
        }
    }

    /// Names of the channels in a file of this layer alone, which any viewer should show.
    fn channels_alone(self) -> &'static [&'static str] {
        match self {
            Layer::Depth => &["Z"],
            Layer::Roughness | Layer::Metallic | Layer::Specular => &["Y"],
            _ => &["R", "G", "B"],
        }
    }
}

/// One layer of a picture, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerImage {
    /// Name; empty for the picture itself.
    pub name: String,
    /// Names of the channels.
    pub channels: Vec<&'static str>,
    /// Pixels.
    pub extent: [u32; 2],
    /// For each channel, its values row by row.
    pub values: Vec<Vec<f32>>,
}

impl LayerImage {
    /// A layer of R, G and B.
    pub fn of_radiance(name: &str, image: &lobelia_measure::Image) -> Self {
        let channel = |index: usize| image.pixels.iter().map(|pixel| pixel[index]).collect();
        let values = (0..3).map(channel).collect();
        Self { name: name.into(), channels: vec!["R", "G", "B"], extent: [image.width as u32, image.height as u32], values }
    }

    /// All channels of one pixel after the other.
    pub fn interleaved(&self) -> Vec<f32> {
        let pixels = self.values.first().map_or(0, Vec::len);
        (0..pixels).flat_map(|pixel| self.values.iter().map(move |channel| channel[pixel])).collect()
    }
}

/// What `--save` names.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// `pass.port` of the resource.
    pub port: String,
    /// The layer of a G-buffer, if not the resource as it is.
    pub layer: Option<Layer>,
}

impl Target {
    /// `PASS.PORT`, or `PASS.LAYER` where the pass makes a G-buffer (`PASS.PORT.LAYER` where it makes more).
    pub fn resolve(wired: &Wired<SceneWorld>, traits: &SceneTraits, options: &PlanOptions, text: &str) -> Result<Self, SessionError> {
        let unknown = match wired.find_port(text) {
            Ok(_) => return Ok(Self { port: text.into(), layer: None }),
            Err(problems) => problems,
        };
        let Some((port, name)) = text.rsplit_once('.').filter(|(port, _)| wired.find_port(port).is_ok()) else {
            return Err(unknown.into());
        };
        let plan = wired.plan(traits, &PlanOptions { keep: vec![port.into()], ..options.clone() })?;
        if plan.find(port).is_none_or(|index| plan.resources[index].type_name != GBuffer::NAME) {
            return Err(unknown.into());
        }
        let names = || Layer::ALL.into_iter().map(Layer::name);
        match Layer::find(name) {
            Some(layer) => Ok(Self { port: port.into(), layer: Some(layer) }),
            None => {
                let near = lobelia_base::nearest(name, names()).map_or_else(String::new, |near| format!(" (did you mean `{near}`?)"));
                let all = names().collect::<Vec<_>>().join(", ");
                Err(SessionError::Argument(format!("`{text}`: a G-buffer has no layer `{name}`{near}; its layers are {all}")))
            }
        }
    }
}

/// The G-buffer of the last sample, read back: the one place outside of shaders where its texels are decoded.
pub struct DecodedGBuffer {
    extent: [u32; 2],
    depth: Vec<f32>,
    core: Vec<[u32; 2]>,
    specular: Option<Vec<u32>>,
    geometric_normal: Option<Vec<u32>>,
    emissive: Option<Vec<u32>>,
    view: lobelia_scene::device::ViewUniform,
    origin: DVec3,
    pre_exposure: f64,
}

fn words(parts: &[(Part, PartData)], name: &str) -> Option<Vec<u32>> {
    parts.iter().find(|(part, _)| part.name == name).and_then(|(_, data)| match data {
        PartData::Texture(layers) => layers.first().map(lobelia_graph::TextureData::to_u32),
        PartData::Buffer(_) => None,
    })
}

impl DecodedGBuffer {
    /// Reads a kept G-buffer by `pass.port` or `pass`.
    pub fn read(rendering: &Rendering<'_>, port: &str) -> Result<Self, SessionError> {
        let parts = rendering.runner().read(rendering.gpu(), port)?;
        let missing = || SessionError::Argument(format!("`{port}` is no G-buffer that can be decoded"));
        let depth: Vec<f32> = words(&parts, "depth").ok_or_else(missing)?.into_iter().map(f32::from_bits).collect();
        let core = words(&parts, "core").ok_or_else(missing)?.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
        // Two words a texel where dielectrics have reflectances of their own; the first is the same.
        let specular = words(&parts, "specular").map(|words| {
            let stride = (words.len() / depth.len().max(1)).max(1);
            words.into_iter().step_by(stride).collect()
        });
        let view = *rendering.view().ok_or_else(missing)?;
        Ok(Self {
            extent: rendering.plan().extent,
            depth,
            core,
            specular,
            geometric_normal: words(&parts, "geometric_normal"),
            emissive: words(&parts, "emissive"),
            view,
            origin: rendering.scene().origin(),
            pre_exposure: f64::from(rendering.pre_exposure()),
        })
    }

    /// Distance along the view axis, metres.
    fn view_depth(&self, pixel: usize) -> f64 {
        f64::from(self.view.near) / f64::from(self.depth[pixel])
    }

    fn position(&self, pixel: usize) -> DVec3 {
        let (x, y) = (pixel as u32 % self.extent[0], pixel as u32 / self.extent[0]);
        let jitter = self.view.jitter.as_dvec2();
        let along = |place: u32, jitter: f64, side: u32| (f64::from(place) + 0.5 + jitter) * 2.0 / f64::from(side) - 1.0;
        let (u, v) = (along(x, jitter.x, self.extent[0]), along(y, jitter.y, self.extent[1]));
        let ray = self.view.forward.as_dvec3() + u * self.view.right.as_dvec3() - v * self.view.up.as_dvec3();
        self.origin + self.view.position.as_dvec3() + ray * self.view_depth(pixel)
    }

    fn normal(&self, pixel: usize) -> DVec3 {
        octahedral_unpack(self.core[pixel][0])
    }

    /// The channels of a layer at a pixel where a surface is seen. What the scene has no target for is what shaders take it for.
    fn value(&self, layer: Layer, pixel: usize) -> [f64; 3] {
        let specular = |channel: usize, without: f64| {
            let value = self.specular.as_ref().map_or(without, |words| unpack_specular(words[pixel])[channel]);
            [value; 3]
        };
        match layer {
            Layer::Normal => self.normal(pixel).to_array(),
            Layer::GeometricNormal => {
                let stored = self.geometric_normal.as_ref().map(|words| octahedral_unpack(words[pixel]));
                stored.unwrap_or_else(|| self.normal(pixel)).to_array()
            }
            Layer::BaseColor => unpack_color(self.core[pixel][1]).to_array(),
            Layer::Roughness => specular(0, 1.0),
            Layer::Metallic => specular(1, 0.0),
            Layer::Specular => specular(2, 0.0),
            Layer::Emissive => {
                let stored = self.emissive.as_ref().map(|words| unpack_shared_exponent(words[pixel]) / self.pre_exposure);
                stored.unwrap_or_default().to_array()
            }
            Layer::Depth => [self.view_depth(pixel); 3],
            Layer::Position => self.position(pixel).to_array(),
        }
    }

    /// A layer as a picture.
    pub fn layer(&self, layer: Layer) -> LayerImage {
        let channels = layer.channels();
        let mut values = vec![Vec::with_capacity(self.depth.len()); channels.len()];
        let nothing = if layer == Layer::Depth { NO_DEPTH } else { 0.0 };
        for pixel in 0..self.depth.len() {
            let seen = self.depth[pixel] > 0.0;
            let value = if seen { self.value(layer, pixel).map(|value| value as f32) } else { [nothing; 3] };
            for (channel, value) in values.iter_mut().zip(value) {
                channel.push(value);
            }
        }
        LayerImage { name: layer.name().into(), channels: channels.to_vec(), extent: self.extent, values }
    }

    /// A layer with the channel names of a file of its own: R, G, B for three, Z for depth, Y for other single ones.
    pub fn layer_alone(&self, layer: Layer) -> LayerImage {
        LayerImage { name: String::new(), channels: layer.channels_alone().to_vec(), ..self.layer(layer) }
    }
}

/// What a file of all layers holds, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerSet {
    /// `pass.port` of the picture.
    pub beauty: String,
    /// Name of the layer and `pass.port` of each radiance that is summed.
    pub terms: Vec<(String, String)>,
    /// `pass.port` of the G-buffer, if the graph has one.
    pub gbuffer: Option<String>,
}

impl LayerSet {
    /// The layers of a planned graph: the radiance that it ends in or shows, the terms that its last sum adds up, and its first G-buffer.
    /// Nothing if it ends in something else.
    pub fn of(plan: &Plan<SceneWorld>) -> Option<Self> {
        let is_radiance = |index: &usize| plan.resources[*index].type_name == Radiance::NAME;
        let sources = |index: usize| -> Vec<usize> {
            let inputs = plan.passes[plan.resources[index].maker].inputs.iter().flatten().copied();
            inputs.filter(is_radiance).collect()
        };
        let is_sum = |index: usize| plan.passes[plan.resources[index].maker].kind_name() == "compose";
        let beauty = if is_radiance(&plan.output) { plan.output } else { *sources(plan.output).first()? };
        // Filters and means stand between the picture and its sum.
        let mut sum = beauty;
        let mut seen = vec![beauty];
        while !is_sum(sum) {
            match sources(sum).into_iter().find(|index| !seen.contains(index)) {
                Some(next) => (sum, seen) = (next, [seen, vec![next]].concat()),
                None => break,
            }
        }
        let mut terms = Vec::new();
        let mut open = if is_sum(sum) { sources(sum) } else { Vec::new() };
        open.reverse();
        while let Some(index) = open.pop() {
            if is_sum(index) {
                open.extend(sources(index).into_iter().rev());
            } else if !terms.contains(&index) {
                terms.push(index);
            }
        }
        let mut names: Vec<String> = Layer::ALL.into_iter().map(|layer| layer.name().to_owned()).collect();
        let mut named = Vec::new();
        for index in terms {
            let resource = &plan.resources[index].name;
            let pass = resource.split('.').next().unwrap_or(resource);
            let name = if names.iter().any(|taken| taken == pass) { resource.replace('.', "_") } else { pass.to_owned() };
            names.push(name.clone());
            named.push((name, resource.clone()));
        }
        let gbuffer = plan.resources.iter().find(|resource| resource.type_name == GBuffer::NAME);
        let beauty = plan.resources[beauty].name.clone();
        Some(Self { beauty, terms: named, gbuffer: gbuffer.map(|resource| resource.name.clone()) })
    }

    /// What must be kept to read them.
    pub fn keep(&self) -> impl Iterator<Item = String> + '_ {
        self.terms.iter().map(|(_, port)| port).chain(&self.gbuffer).chain([&self.beauty]).cloned()
    }

    /// All layers of what was rendered; the first is the picture.
    pub fn read(&self, rendering: &Rendering<'_>) -> Result<Vec<LayerImage>, SessionError> {
        let mut layers = vec![LayerImage::of_radiance("", &rendering.radiance(&self.beauty)?)];
        for (name, port) in &self.terms {
            layers.push(LayerImage::of_radiance(name, &rendering.radiance(port)?));
        }
        if let Some(port) = &self.gbuffer {
            let decoded = DecodedGBuffer::read(rendering, port)?;
            layers.extend(Layer::ALL.into_iter().map(|layer| decoded.layer(layer)));
        }
        Ok(layers)
    }
}

/// Writes layers into one EXR file of one part, 32-bit floats, row 0 at the top. Channels are called `layer.channel`, those of a layer without a name
/// `channel`, which is how compositing programs know layers. `attributes` are strings of the header.
pub fn write_exr(path: &Path, layers: &[LayerImage], attributes: &[(String, String)]) -> Result<(), SessionError> {
    let extent = layers.first().map_or((0, 0), |layer| (layer.extent[0] as usize, layer.extent[1] as usize));
    let mut channels = files::SmallVec::new();
    for layer in layers {
        for (channel, values) in layer.channels.iter().zip(&layer.values) {
            let name = if layer.name.is_empty() { (*channel).to_owned() } else { format!("{}.{channel}", layer.name) };
            let name = files::Text::new_or_none(&name).ok_or_else(|| {
                SessionError::Argument(format!("{}: `{name}` cannot be the name of a channel: only Latin letters can", path.display()))
            })?;
            channels.push(files::AnyChannel::new(name, files::FlatSamples::F32(values.clone())));
        }
    }
    let mut header = files::LayerAttributes::default();
    for (name, value) in attributes {
        // The header knows Latin-1 only; what is beyond it is written as a question mark.
        let latin: String = value.chars().map(|letter| if u32::from(letter) < 256 { letter } else { '?' }).collect();
        header.other.insert(files::Text::from(name.as_str()), files::AttributeValue::Text(files::Text::from(latin.as_str())));
    }
    let layer = files::Layer::new(extent, header, files::Encoding::FAST_LOSSLESS, files::AnyChannels::sort(channels));
    let picture = files::Image::from_layer(layer);
    lobelia_measure::replace_file(path, |file| files::WritableImage::write(&picture).to_buffered(file).map_err(|error| error.to_string()))
        .map_err(|error| SessionError::Write(error.to_string()))
}
