//! OpenEXR: one layer of many, in the display window.

use super::{Primaries, Radiance, broken, check_size};
use exr::{
    meta::MetaData,
    prelude::{ReadChannels as _, ReadLayers as _, f16, read},
};
use std::io::Cursor;

/// Most bytes that the pixels of all layers may have: all are read to find one.
const MAX_BYTES: u64 = 4 << 30;

/// Names that renderers give to the whole picture among its parts.
const WHOLE: [&str; 5] = ["combined", "beauty", "rgba", "rgb", "composite"];

/// Channels of one layer that make a picture.
#[derive(Clone, Debug, PartialEq)]
struct Layer {
    /// Empty for channels whose names have no dot.
    name: String,
    /// Index of the file's part.
    part: usize,
    /// Indices of red, green and blue among the part's channels; the same one thrice for a luminance.
    channels: [usize; 3],
}

/// What a file has, by the names of its channels.
#[derive(Debug, Default)]
struct Layers {
    /// Those that are pictures.
    pictures: Vec<Layer>,
    /// Those that have a luminance alone.
    grey: Vec<Layer>,
    /// The names of all others with their channels, such as `Depth (Z)`.
    others: Vec<String>,
}

pub(super) fn decode(bytes: &[u8], wanted: Option<&str>) -> Result<Radiance, String> {
    let broken = |error: exr::error::Error| broken(bytes, "OpenEXR", error);
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(broken)?;
    if meta.headers.iter().any(|header| header.deep) {
        return Err("it has deep data, which is not read; flatten it first".into());
    }
    let size = |header: &exr::meta::header::Header| {
        let pixels = (header.layer_size.width() as u64).saturating_mul(header.layer_size.height() as u64);
        pixels.saturating_mul(header.channels.bytes_per_pixel as u64)
    };
    let total = meta.headers.iter().map(size).fold(0, u64::saturating_add);
    if total > MAX_BYTES {
        return Err(format!("all its layers together have {total} bytes; at most {MAX_BYTES} are read"));
    }
    let parts: Vec<(Option<String>, Vec<String>)> = meta
        .headers
        .iter()
        .map(|header| {
            let name = header.own_attributes.layer_name.as_ref().map(ToString::to_string);
            (name, header.channels.list.iter().map(|channel| channel.name.to_string()).collect())
        })
        .collect();
    let (layer, note) = choose(&sort(&parts)?, wanted)?;
    let header = &meta.headers[layer.part];
    let sampling = |channel: &usize| header.channels.list[*channel].sampling;
    if let Some(channel) = layer.channels.iter().find(|channel| sampling(channel) != exr::math::Vec2(1, 1)) {
        return Err(format!("channel {} has fewer samples than pixels, which is not read", parts[layer.part].1[*channel]));
    }
    let window = header.shared_attributes.display_window;
    let (width, height) = (window.size.width(), window.size.height());
    check_size(width as u64, height as u64)?;

    let image = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let image = image.from_buffered(Cursor::new(bytes)).map_err(broken)?;
    let data = image.layer_data.get(layer.part).ok_or("its parts are not those of its header")?;
    let found = |channel: usize| data.channel_data.list.iter().find(|found| found.name == header.channels.list[channel].name);
    let planes = layer.channels.map(found);
    let [Some(red), Some(green), Some(blue)] = planes else { return Err("its channels are not those of its header".into()) };
    let value = |plane: &exr::prelude::FlatSamples, place: usize| match plane {
        exr::prelude::FlatSamples::F16(values) => values.get(place).copied().map_or(0.0, f16::to_f32),
        exr::prelude::FlatSamples::F32(values) => values.get(place).copied().unwrap_or(0.0),
        exr::prelude::FlatSamples::U32(values) => values.get(place).map_or(0.0, |value| *value as f32),
    };
    // The picture is the display window; the data window may be smaller or larger, and lie elsewhere.
    let start = [
        i64::from(data.attributes.layer_position.x()) - i64::from(window.position.x()),
        i64::from(data.attributes.layer_position.y()) - i64::from(window.position.y()),
    ];
    let mut pixels = vec![[0.0; 3]; width * height];
    let inside = |place: usize, axis: usize, size: usize| {
        let there = place as i64 - start[axis];
        usize::try_from(there).ok().filter(|there| *there < size)
    };
    let mut covered = 0usize;
    for y in 0..height {
        let Some(row) = inside(y, 1, data.size.height()) else { continue };
        for x in 0..width {
            let Some(column) = inside(x, 0, data.size.width()) else { continue };
            let place = row * data.size.width() + column;
            pixels[y * width + x] = [red, green, blue].map(|plane| value(&plane.sample_data, place));
            covered += 1;
        }
    }
    let mut radiance = Radiance { width, height, pixels, notes: note.into_iter().collect() };
    if covered == 0 {
        return Err("its data lie outside of its display window, so the picture is empty".into());
    }
    if covered < width * height {
        radiance.note(format!("its data cover {covered} of the {} pixels of its display window; the others are 0", width * height));
    }
    if let Some(points) = header.shared_attributes.chromaticities.filter(|_| layer.channels[0] != layer.channels[1]) {
        let point = |point: exr::math::Vec2<f32>| [f64::from(point.x()), f64::from(point.y())];
        let primaries = Primaries { rgb: [point(points.red), point(points.green), point(points.blue)], white: point(points.white) };
        radiance.convert(&primaries, "chromaticities");
    }
    Ok(radiance)
}

/// Channels to layers: what comes before the last dot names the layer, and a part's name comes before that unless it already does.
fn sort(parts: &[(Option<String>, Vec<String>)]) -> Result<Layers, String> {
    let mut layers = Layers::default();
    for (part, (part_name, channels)) in parts.iter().enumerate() {
        let mut groups: Vec<(String, Vec<(String, usize)>)> = Vec::new();
        for (index, channel) in channels.iter().enumerate() {
            let (prefix, component) = channel.rsplit_once('.').unwrap_or(("", channel));
            let name = match part_name.as_deref().filter(|name| !name.is_empty() && parts.len() > 1) {
                Some(part) if prefix.is_empty() => part.to_owned(),
                Some(part) if prefix == part || prefix.starts_with(&format!("{part}.")) || part.ends_with(&format!(".{prefix}")) => {
                    if prefix.len() > part.len() {
                        prefix.to_owned()
                    } else {
                        part.to_owned()
                    }
                }
                Some(part) => format!("{part}.{prefix}"),
                None => prefix.to_owned(),
            };
            match groups.iter_mut().find(|(known, _)| *known == name) {
                Some((_, components)) => components.push((component.to_owned(), index)),
                None => groups.push((name, vec![(component.to_owned(), index)])),
            }
        }
        for (name, components) in groups {
            let find = |names: [&str; 2]| components.iter().find(|(component, _)| names.contains(&component.to_lowercase().as_str()));
            let index = |names: [&str; 2]| find(names).map(|(_, index)| *index);
            match (index(["r", "red"]), index(["g", "green"]), index(["b", "blue"]), index(["y", "y"])) {
                (Some(red), Some(green), Some(blue), _) => layers.pictures.push(Layer { name, part, channels: [red, green, blue] }),
                (.., Some(_)) if index(["ry", "by"]).is_some() => layers.others.push(format!("{} (luminance and chroma)", shown(&name))),
                // A luminance has no X beside it: that would be a position or a normal.
                (.., Some(grey)) if index(["x", "z"]).is_none() => layers.grey.push(Layer { name, part, channels: [grey; 3] }),
                _ => {
                    let components: Vec<&str> = components.iter().map(|(component, _)| component.as_str()).collect();
                    layers.others.push(format!("{} ({})", shown(&name), components.join(", ")));
                }
            }
        }
    }
    Ok(layers)
}

fn shown(name: &str) -> String {
    if name.is_empty() { "the layer without a name".into() } else { format!("`{name}`") }
}

impl Layers {
    fn list(&self) -> String {
        let grey = self.grey.iter().map(|layer| format!("{} (Y)", shown(&layer.name)));
        let all: Vec<String> = self.pictures.iter().map(|layer| shown(&layer.name)).chain(grey).collect();
        match (all.is_empty(), self.others.is_empty()) {
            (true, true) => "it has no layer at all".into(),
            (true, false) => format!("it has only {}", self.others.join(", ")),
            (false, true) => format!("its pictures are {}", all.join(", ")),
            (false, false) => format!("its pictures are {}; besides it has {}", all.join(", "), self.others.join(", ")),
        }
    }
}

/// The layer of that name, or the obvious one: the one without a name, else the only one, else the only one whose name means the whole picture, else
/// the only luminance. What was left to guess is told.
fn choose(layers: &Layers, wanted: Option<&str>) -> Result<(Layer, Option<String>), String> {
    let all: Vec<&Layer> = layers.pictures.iter().chain(&layers.grey).collect();
    if let Some(wanted) = wanted {
        let lower = wanted.to_lowercase();
        let tests: [&dyn Fn(&str) -> bool; 3] =
            [&|name| name == wanted, &|name| name.to_lowercase() == lower, &|name| name.to_lowercase().ends_with(&format!(".{lower}"))];
        for test in tests {
            match all.iter().filter(|layer| test(&layer.name)).collect::<Vec<_>>()[..] {
                [] => {}
                [layer] => return Ok(((*layer).clone(), None)),
                [first, ..] if all.iter().filter(|layer| layer.name == first.name).count() > 1 => {
                    return Err(format!("several of its parts have a layer `{}`; give them names of their own", first.name));
                }
                _ => return Err(format!("several of its layers could be `{wanted}`: {}; give the whole name", layers.list())),
            }
        }
        let near =
            all.iter().map(|layer| (strsim::jaro_winkler(&lower, &layer.name.to_lowercase()), layer)).filter(|(score, _)| *score > 0.75);
        let near = near.max_by(|left, right| left.0.total_cmp(&right.0)).map(|(_, layer)| format!("; did you mean `{}`?", layer.name));
        return Err(format!("it has no layer `{wanted}` that is a picture: {}{}", layers.list(), near.unwrap_or_default()));
    }
    let only = |candidates: Vec<&Layer>| if let [only] = candidates[..] { Some(only.clone()) } else { None };
    let unnamed = |list: &[Layer]| only(list.iter().filter(|layer| layer.name.is_empty()).collect());
    if let Some(layer) = unnamed(&layers.pictures).or_else(|| only(layers.pictures.iter().collect())) {
        return Ok((layer, None));
    }
    let whole = |layer: &&Layer| {
        let last = layer.name.rsplit('.').next().unwrap_or_default().to_lowercase();
        WHOLE.contains(&last.as_str())
    };
    if let Some(layer) = only(layers.pictures.iter().filter(whole).collect()) {
        let note = format!("of its layers `{}` is read; `FILE#LAYER` names another: {}", layer.name, layers.list());
        return Ok((layer, Some(note)));
    }
    if layers.pictures.is_empty()
        && let Some(layer) = unnamed(&layers.grey).or_else(|| only(layers.grey.iter().collect()))
    {
        return Ok((layer, None));
    }
    if all.is_empty() {
        return Err(format!("no layer of it has channels R, G and B or Y: {}", layers.list()));
    }
    Err(format!("it has several pictures, and `FILE#LAYER` must name one: {}", layers.list()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use exr::meta::attribute::Chromaticities;
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer as Written, LayerAttributes, Vec2,
        WritableImage as _,
    };

    /// A part with channels of one value each, of 2 x 1 pixels at a place.
    fn part(name: Option<&str>, channels: &[(&str, FlatSamples)], at: (i32, i32)) -> Written<AnyChannels<FlatSamples>> {
        let list = channels.iter().map(|(name, samples)| AnyChannel::new(*name, samples.clone())).collect();
        let mut attributes = LayerAttributes { layer_position: Vec2(at.0, at.1), ..LayerAttributes::default() };
        attributes.layer_name = name.map(Into::into);
        Written::new(Vec2(2, 1), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(list))
    }

    fn file(parts: Vec<Written<AnyChannels<FlatSamples>>>, change: impl FnOnce(&mut ImageAttributes)) -> Vec<u8> {
        let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions(Vec2(2, 1)));
        change(&mut attributes);
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layers(attributes, parts).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    fn floats(value: f32) -> FlatSamples {
        FlatSamples::F32(vec![value, value + 0.5])
    }

    /// Channels `prefix` + R, G, B of value, value + 1, value + 2.
    fn rgb(prefix: &str, value: f32) -> Vec<(String, FlatSamples)> {
        ["R", "G", "B"].iter().zip(0..3).map(|(name, step)| (format!("{prefix}{name}"), floats(value + step as f32))).collect()
    }

    fn one_part(layers: &[(&str, f32)], others: &[&str]) -> Vec<u8> {
        let colours = layers.iter().flat_map(|(prefix, value)| rgb(prefix, *value));
        let channels: Vec<_> = colours.chain(others.iter().map(|name| ((*name).to_owned(), floats(9.0)))).collect();
        let channels: Vec<(&str, FlatSamples)> = channels.iter().map(|(name, samples)| (name.as_str(), samples.clone())).collect();
        file(vec![part(None, &channels, (0, 0))], |_| {})
    }

    #[track_caller]
    fn reads(bytes: &[u8], layer: Option<&str>, red: f32) -> Vec<String> {
        let picture = decode(bytes, layer).unwrap();
        assert_eq!((picture.width, picture.height), (2, 1));
        assert_eq!(picture.pixels, [[red, red + 1.0, red + 2.0], [red + 0.5, red + 1.5, red + 2.5]]);
        picture.notes
    }

    #[test]
    fn the_obvious_layer_is_read() {
        assert!(reads(&one_part(&[("", 1.0)], &["A", "Z"]), None, 1.0).is_empty());
        assert!(reads(&one_part(&[("", 1.0), ("Diffuse.", 4.0)], &[]), None, 1.0).is_empty());
        assert!(reads(&one_part(&[("Beauty.", 3.0)], &[]), None, 3.0).is_empty());
        // Blender's, beside depth and normals.
        let blender = one_part(
            &[("ViewLayer.Combined.", 2.0)],
            &["ViewLayer.Combined.A", "ViewLayer.Depth.Z", "ViewLayer.Normal.X", "ViewLayer.Normal.Y"],
        );
        assert!(reads(&blender, None, 2.0).is_empty());
        let passes = one_part(&[("ViewLayer.Combined.", 2.0), ("ViewLayer.DiffCol.", 5.0)], &["ViewLayer.Depth.Z"]);
        let notes = reads(&passes, None, 2.0);
        assert!(notes[0].contains("`ViewLayer.Combined` is read") && notes[0].contains("`ViewLayer.DiffCol`"), "{notes:?}");
    }

    #[test]
    fn a_layer_is_named() {
        let bytes = one_part(&[("Key.", 1.0), ("Fill.", 4.0), ("View.Rim.", 7.0)], &["Depth.Z"]);
        for (name, red) in [("Key", 1.0), ("Fill", 4.0), ("fill", 4.0), ("View.Rim", 7.0), ("rim", 7.0)] {
            assert!(reads(&bytes, Some(name), red).is_empty());
        }
        let refused = |layer: Option<&str>| decode(&bytes, layer).unwrap_err();
        let message = refused(None);
        assert!(
            message.contains("several pictures") && message.contains("`Key`, `Fill`, `View.Rim`") || message.contains("`Fill`"),
            "{message}"
        );
        assert!(message.contains("`Depth` (Z)"), "{message}");
        let message = refused(Some("Fil"));
        assert!(message.contains("no layer `Fil`") && message.contains("did you mean `Fill`?") && message.contains("`Key`"), "{message}");
        assert!(refused(Some("Depth")).contains("no layer `Depth` that is a picture"));
        let nothing = one_part(&[], &["Depth.Z", "N.X", "N.Y", "N.Z"]);
        let message = decode(&nothing, None).unwrap_err();
        assert!(message.contains("R, G and B or Y") && message.contains("`N` (X, Y, Z)"), "{message}");
    }

    #[test]
    fn parts_have_names_of_their_own() {
        let channels = |value: f32| rgb("", value);
        let parts = |names: [&str; 2]| {
            let parts = names.iter().zip([1.0, 5.0]).map(|(name, value)| {
                let channels = channels(value);
                let channels: Vec<(&str, FlatSamples)> = channels.iter().map(|(name, samples)| (name.as_str(), samples.clone())).collect();
                part(Some(name), &channels, (0, 0))
            });
            file(parts.collect(), |_| {})
        };
        let two = parts(["Left", "Right"]);
        reads(&two, Some("Right"), 5.0);
        reads(&two, Some("Left"), 1.0);
        assert!(decode(&two, None).unwrap_err().contains("`Left`, `Right`"));
        assert!(reads(&parts(["ViewLayer.Albedo", "ViewLayer.Combined"]), None, 5.0)[0].contains("Combined"));
    }

    #[test]
    fn luminance_alone_is_grey_and_all_kinds_of_samples_are_read() {
        let grey = file(vec![part(None, &[("Y", FlatSamples::F16(vec![f16::from_f32(0.25), f16::from_f32(8.0)]))], (0, 0))], |_| {});
        assert_eq!(decode(&grey, None).unwrap().pixels, [[0.25; 3], [8.0; 3]]);
        let mixed = [("R", FlatSamples::U32(vec![3, 4])), ("G", floats(1.0)), ("B", FlatSamples::F16(vec![f16::ONE, f16::ZERO]))];
        let mixed = file(vec![part(None, &mixed, (0, 0))], |_| {});
        assert_eq!(decode(&mixed, None).unwrap().pixels, [[3.0, 1.0, 1.0], [4.0, 1.5, 0.0]]);
    }

    #[test]
    fn the_picture_is_the_display_window() {
        let channels = rgb("", 1.0);
        let channels: Vec<(&str, FlatSamples)> = channels.iter().map(|(name, samples)| (name.as_str(), samples.clone())).collect();
        let at = |x: i32, y: i32, window: IntegerBounds| {
            file(vec![part(None, &channels, (x, y))], |attributes| attributes.display_window = window)
        };
        let (zero, left, right) = ([0.0; 3], [1.0, 2.0, 3.0], [1.5, 2.5, 3.5]);
        // Smaller than the window, and elsewhere.
        let picture = decode(&at(1, 1, IntegerBounds::new((0, 0), (4, 2))), None).unwrap();
        assert_eq!((picture.width, picture.height), (4, 2));
        assert_eq!(picture.pixels, [zero, zero, zero, zero, zero, left, right, zero]);
        assert!(picture.notes[0].contains("cover 2 of the 8 pixels"));
        // Beyond the window on the left, which does not begin at 0.
        let picture = decode(&at(9, 10, IntegerBounds::new((10, 10), (2, 1))), None).unwrap();
        assert_eq!(picture.pixels, [right, zero]);
        assert!(decode(&at(50, 0, IntegerBounds::new((0, 0), (2, 1))), None).unwrap_err().contains("outside of its display window"));
        let huge = decode(&at(0, 0, IntegerBounds::new((0, 0), (100_000, 100_000))), None).unwrap_err();
        assert!(huge.contains("100000 x 100000 pixels"), "{huge}");
    }

    #[test]
    fn chromaticities_are_converted() {
        let channels = [("R", floats(0.0)), ("G", floats(1.0)), ("B", floats(0.0))];
        let with = |red: (f32, f32), green: (f32, f32), blue: (f32, f32)| {
            let points = Chromaticities { red: red.into(), green: green.into(), blue: blue.into(), white: (0.3127, 0.3290).into() };
            file(vec![part(None, &channels, (0, 0))], |attributes| attributes.chromaticities = Some(points))
        };
        let same = decode(&with((0.64, 0.33), (0.30, 0.60), (0.15, 0.06)), None).unwrap();
        assert_eq!((same.pixels[0], same.notes.len()), ([0.0, 1.0, 0.0], 0));
        let wide = decode(&with((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)), None).unwrap();
        let expected = [-0.5876, 1.1329, -0.1006];
        assert!(wide.pixels[0].iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-3), "{:?}", wide.pixels[0]);
        assert!(wide.notes[0].contains("chromaticities"), "{:?}", wide.notes);
        let none = decode(&with((0.0, 0.0), (0.0, 0.0), (0.0, 0.0)), None).unwrap();
        assert!(none.pixels[0] == [0.0, 1.0, 0.0] && none.notes[0].contains("ignored"));
    }

    #[test]
    fn what_is_broken_is_told() {
        let whole = one_part(&[("", 1.0)], &[]);
        for length in [4, 30, whole.len() / 2, whole.len() - 1] {
            assert!(decode(&whole[..length], None).unwrap_err().contains("it cannot be decoded"), "cut to {length}");
        }
    }
}
