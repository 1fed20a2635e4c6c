//! Files of layers: `--aovs`, and `--save PASS.LAYER=FILE`.

use super::render::Arguments;
use crate::{
    failure::Failure,
    files::{self, Kind},
};
use lobelia::{
    Rendering,
    frame::SceneWorld,
    graph::Plan,
    layers::{self, DecodedGBuffer, Layer, LayerImage, LayerSet},
};
use std::path::Path;

/// In which formats a layer can be written. What is no colour or share has no picture of 8 bits.
pub fn kinds(layer: Layer) -> &'static [Kind] {
    match layer {
        Layer::Depth | Layer::Position => &[Kind::Exr, Kind::Npz],
        _ => &[Kind::Exr, Kind::Npz, Kind::Png],
    }
}

/// The layers that a graph has, or why there are none.
pub fn set(arguments: &Arguments, plan: &Plan<SceneWorld>) -> Result<LayerSet, Failure> {
    let set = LayerSet::of(plan).ok_or_else(|| {
        let output = &plan.resources[plan.output];
        Failure::Input(format!("--aovs: the graph's output `{}` is {}, which shows no radiance", output.name, output.type_name))
    })?;
    if set.gbuffer.is_none() && !arguments.quiet {
        eprintln!("warning: the graph has no G-buffer, so the file has neither normals nor depth nor any other layer of surfaces");
    }
    Ok(set)
}

/// What was rendered, for the header of a file.
fn attributes(arguments: &Arguments, rendering: &Rendering<'_>, frame: u32) -> Vec<(String, String)> {
    let camera = rendering.camera();
    let [width, height] = rendering.plan().extent;
    let device = rendering.gpu().info().map_or_else(String::new, |info| info.name.clone());
    let overrides = arguments.graph.overrides.iter().map(|item| format!("{}.{}={}", item.pass, item.param, item.value));
    let average = match arguments.samples {
        1 => "one sample at pixel centres".to_owned(),
        samples => format!(
            "radiance (the picture and the terms that it sums) is the mean of {samples} samples; all other layers are of the last sample"
        ),
    };
    let pairs = [
        ("graph", arguments.graph.graph.display().to_string()),
        ("variants", arguments.graph.variants.join("+")),
        ("overrides", overrides.collect::<Vec<_>>().join(" ")),
        ("seed", arguments.seed.to_string()),
        ("scene", arguments.scene.scene.clone()),
        ("time", lobelia::frame_time(arguments.scene.time, rendering.shot(), frame).to_string()),
        ("frame", frame.to_string()),
        ("camera", camera.name.clone()),
        ("size", format!("{width}x{height}")),
        ("samples", arguments.samples.to_string()),
        ("averaging", average),
        ("device", device),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    pairs.map(|(name, value)| (format!("lobelia.{name}"), value)).to_vec()
}

/// Writes all layers into one file.
pub fn write_all(arguments: &Arguments, rendering: &Rendering<'_>, set: &LayerSet, frame: u32, path: &Path) -> Result<(), Failure> {
    let mut header = attributes(arguments, rendering, frame);
    header.push(("lobelia.beauty".into(), set.beauty.clone()));
    header.extend(set.terms.iter().map(|(name, port)| (format!("lobelia.layer.{name}"), port.clone())));
    Ok(layers::write_exr(path, &set.read(rendering)?, &header)?)
}

/// Writes one layer of a G-buffer.
pub fn write(
    arguments: &Arguments,
    rendering: &Rendering<'_>,
    (port, layer): (&str, Layer),
    frame: u32,
    path: &Path,
) -> Result<(), Failure> {
    let image = DecodedGBuffer::read(rendering, port)?.layer_alone(layer);
    match files::kind_of(path, kinds(layer))? {
        Kind::Exr => {
            let mut header = attributes(arguments, rendering, frame);
            header.push(("lobelia.layer".into(), layer.name().into()));
            Ok(layers::write_exr(path, &[image], &header)?)
        }
        Kind::Npz => files::write_layer_npz(path, layer.name(), &image),
        Kind::Png => files::write_png(path, image.extent, &picture(layer, &image)),
    }
}

/// Eight bits per channel: colours sRGB-encoded, directions as 0.5 + 0.5 n (a pixel without a surface is black), shares as they are.
fn picture(layer: Layer, image: &LayerImage) -> Vec<u8> {
    let byte = |value: f64| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
    let pixels = image.values.first().map_or(0, Vec::len);
    let pixel = |index: usize| {
        let value = |channel: usize| f64::from(image.values[channel.min(image.values.len() - 1)][index]);
        let texel = [value(0), value(1), value(2)];
        let [r, g, b] = match layer {
            Layer::BaseColor | Layer::Emissive => texel.map(|value| byte(lobelia::lobes::tonemap::srgb_encode(value.clamp(0.0, 1.0)))),
            Layer::Normal | Layer::GeometricNormal if texel != [0.0; 3] => texel.map(|value| byte(0.5 + 0.5 * value)),
            _ => texel.map(byte),
        };
        [r, g, b, 255]
    };
    (0..pixels).flat_map(pixel).collect()
}
