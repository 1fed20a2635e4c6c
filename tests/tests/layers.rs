//! Layers for compositing and numbered frames, as a user of the program gets them: known values of a known scene, read back from the files.
#![allow(clippy::unwrap_used)]

use exr::prelude::{AttributeValue, FlatImage, Text, read_all_flat_layers_from_file};
use lobelia::{
    graph::testing::{evaluate, gpu},
    lobes::{
        octahedral::octahedral_unpack,
        packing::{unpack_color, unpack_shared_exponent, unpack_specular},
        sampling::hash,
    },
    shaders::Flags,
};
use lobelia_tests::{has_gpu, program};
use std::{
    collections::BTreeMap,
    path::Path,
    process::{Command, Output},
};

const GRAPH: &str = r#"(
    passes: {
        "gbuffer": gbuffer(), "rsm": rsm(resolution: 64), "direct": direct(), "emission": emission(),
        "sum": compose(from: {"terms": ["emission.radiance", "direct.radiance"]}),
        "tonemap": tonemap(from: {"radiance": "sum.radiance"}),
    },
    output: "tonemap.image",
    variants: {"dark": {"emission": none, "sum": compose(from: {"terms": ["direct.radiance"]})}},
)"#;

/// A square of 4 m about (1000, 0, -3), turned by 30 degrees about +Y, which glows.
const GLTF: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0, "translation": [1000, 0, -3], "rotation": [0, 0.25881904510252074, 0, 0.9659258262890683]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
    "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.5, 0.75, 1], "metallicFactor": 0.2, "roughnessFactor": 0.4}, "emissiveFactor": [0.5, 0.25, 0]}],
    "buffers": [{"uri": "quad.bin", "byteLength": 60}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-2, -2, 0], "max": [2, 2, 0]},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
    ]
}"#;

/// The camera is 5 m from the square's centre and looks along -Z.
const SCENE: &str = r#"(
    gltf: "quad.gltf",
    cameras: {"front": (origin: (1000, 0, 2), target: (1000, 0, 0), yfov: 1.0)},
    lights: {"lamp": point(position: (1000, 1, 2), intensity: (9, 9, 9))},
)"#;

struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let corners: [[f32; 3]; 4] = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]];
        let mut bytes: Vec<u8> = corners.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()));
        std::fs::write(folder.path().join("quad.bin"), bytes).unwrap();
        for (name, text) in [("g.ron", GRAPH), ("quad.gltf", GLTF), ("s.ron", SCENE)] {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        Self(folder)
    }

    fn run(&self, arguments: &str) -> Output {
        let mut command = Command::new(program());
        command.args(arguments.split_whitespace()).current_dir(self.0.path()).env_remove("LOBELIA_LOG").output().unwrap()
    }

    fn render(&self, arguments: &str) -> String {
        let output = self.run(&format!("render g.ron --scene s.ron --size 33x33 {arguments}"));
        assert!(output.status.success(), "{arguments}\n{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

/// Channels by name, and text of the header.
struct File {
    channels: BTreeMap<String, Vec<f32>>,
    header: BTreeMap<String, String>,
}

fn read(path: &Path) -> File {
    let image: FlatImage = read_all_flat_layers_from_file(path).unwrap();
    assert_eq!(image.layer_data.len(), 1);
    let layer = &image.layer_data[0];
    let channels = layer.channel_data.list.iter().map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().collect()));
    let text = |(name, value): (&Text, &AttributeValue)| match value {
        AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
        _ => None,
    };
    let header = layer.attributes.other.iter().chain(&image.attributes.other).filter_map(text).collect();
    File { channels: channels.collect(), header }
}

const SIDE: usize = 33;
/// The middle pixel, whose centre the view axis goes through.
const MIDDLE: usize = SIDE / 2 * SIDE + SIDE / 2;

#[test]
fn one_file_holds_all_layers_with_their_names_values_and_origin() {
    if !has_gpu() {
        return;
    }
    let place = Place::new();
    place.render("--aovs all.exr -o out.exr --seed 3 --set tonemap.exposure=1.5");
    let File { channels, header } = read(&place.path("all.exr"));
    let names: Vec<&str> = channels.keys().map(String::as_str).collect();
    let mut expected = vec!["R", "G", "B", "depth.Z", "roughness.V", "metallic.V", "specular.V"];
    let three = |layer: &str, names: &str| names.chars().map(|name| format!("{layer}.{name}")).collect::<Vec<_>>();
    let colours: Vec<String> = ["direct", "emission", "base_color", "emissive"].iter().flat_map(|layer| three(layer, "RGB")).collect();
    let vectors: Vec<String> = ["normal", "geometric_normal", "position"].iter().flat_map(|layer| three(layer, "XYZ")).collect();
    expected.extend(colours.iter().chain(&vectors).map(String::as_str));
    expected.sort_unstable();
    assert_eq!(names, expected);

    let at = |name: &str, pixel: usize| f64::from(channels[name][pixel]);
    let near = |name: &str, value: f64, tolerance: f64| {
        assert!((at(name, MIDDLE) - value).abs() <= tolerance, "{name}: {} instead of {value}", at(name, MIDDLE));
    };
    near("depth.Z", 5.0, 1e-5);
    for (name, value) in [("position.X", 1000.0), ("position.Y", 0.0), ("position.Z", -3.0)] {
        near(name, value, 1e-4);
    }
    for (name, value) in [("normal.X", 0.5), ("normal.Y", 0.0), ("normal.Z", 0.75f64.sqrt()), ("geometric_normal.X", 0.5)] {
        near(name, value, 7e-5);
    }
    // Half a step of the coded square root.
    for (name, value, step) in [("base_color.R", 0.25f64, 2047.0), ("base_color.G", 0.5, 2047.0), ("base_color.B", 0.75, 1023.0)] {
        near(name, value, 2.0 * value.sqrt() * 0.51 / step);
    }
    near("roughness.V", 0.4, 1.0 / 65535.0);
    near("metallic.V", 0.2, 0.5 / 255.0);
    near("specular.V", 1.0, 0.5 / 255.0);
    for (name, value) in [("emissive.R", 0.5), ("emissive.G", 0.25), ("emissive.B", 0.0)] {
        near(name, value, 0.5 / 512.0);
    }

    // Every pixel of the square lies in its plane, at the depth that the view axis gives, on the ray of its pixel.
    let (mut seen, mut sky) = (0, 0);
    for pixel in 0..SIDE * SIDE {
        let position = [0, 1, 2].map(|axis| at(["position.X", "position.Y", "position.Z"][axis], pixel));
        let depth = at("depth.Z", pixel);
        if depth == f64::from(lobelia::layers::NO_DEPTH) {
            sky += 1;
            for (name, values) in channels.iter().filter(|(name, _)| *name != "depth.Z") {
                assert_eq!(values[pixel], 0.0, "{name} where nothing is seen");
            }
            continue;
        }
        seen += 1;
        let plane = 0.5 * (position[0] - 1000.0) + 0.75f64.sqrt() * (position[2] + 3.0);
        assert!(plane.abs() < 2e-4, "{position:?}");
        assert!((depth - (2.0 - position[2])).abs() < 1e-4, "{depth} {position:?}");
        let ray = |place: usize| ((place as f64 + 0.5) * 2.0 / SIDE as f64 - 1.0) * 0.5f64.tan();
        assert!((position[0] - 1000.0 - ray(pixel % SIDE) * depth).abs() < 2e-4 && (position[1] + ray(pixel / SIDE) * depth).abs() < 2e-4);
        for (beauty, [a, b]) in [("R", ["direct.R", "emission.R"]), ("G", ["direct.G", "emission.G"]), ("B", ["direct.B", "emission.B"])] {
            let sum = at(a, pixel) + at(b, pixel);
            assert!((at(beauty, pixel) - sum).abs() <= 2e-3 * sum, "{beauty}: {} instead of {sum}", at(beauty, pixel));
        }
    }
    assert!(seen > 300 && sky > 100, "{seen} {sky}");
    assert!(at("direct.R", MIDDLE) > 0.01);
    assert_eq!(read(&place.path("out.exr")).channels["R"], channels["R"]);

    for (name, value) in [
        ("graph", "g.ron"),
        ("variants", ""),
        ("overrides", "tonemap.exposure=1.5"),
        ("seed", "3"),
        ("scene", "s.ron"),
        ("camera", "front"),
        ("size", "33x33"),
        ("samples", "1"),
        ("beauty", "sum.radiance"),
        ("layer.direct", "direct.radiance"),
        ("version", env!("CARGO_PKG_VERSION")),
    ] {
        assert_eq!(header.get(&format!("lobelia.{name}")).map(String::as_str), Some(value), "{name}\n{header:?}");
    }
    assert!(!header["lobelia.device"].is_empty());

    // A variant without a term has no layer of it, and says so.
    place.render("--aovs all.exr --variant dark -q");
    let dark = read(&place.path("all.exr"));
    assert!(!dark.channels.contains_key("emission.R") && dark.channels.contains_key("direct.R"));
    assert_eq!(dark.header["lobelia.variants"], "dark");
}

#[test]
fn single_layers_are_written_in_every_format() {
    if !has_gpu() {
        return;
    }
    let place = Place::new();
    let text = place.render(
        "--samples 4 --save gbuffer.depth=d.exr --save gbuffer.roughness=r.exr --save gbuffer.gbuffer.normal=n.exr --save gbuffer.normal=n.png \
         --save gbuffer.base_color=b.png --save gbuffer.position=p.npz --save gbuffer.metallic=m.png --save gbuffer.gbuffer=g.npz --aovs all.exr",
    );
    assert!(text.contains("radiance is the mean of 4 samples; layers of the G-buffer are of the last sample"), "{text}");
    let all = read(&place.path("all.exr"));
    assert!(all.header["lobelia.averaging"].contains("mean of 4 samples"));
    assert_eq!(read(&place.path("d.exr")).channels["Z"], all.channels["depth.Z"]);
    assert_eq!(read(&place.path("r.exr")).channels["Y"], all.channels["roughness.V"]);
    let normal = read(&place.path("n.exr"));
    for (alone, together) in [("R", "normal.X"), ("G", "normal.Y"), ("B", "normal.Z")] {
        assert_eq!(normal.channels[alone], all.channels[together]);
    }
    let pixel = |name: &str, x: u32| image::open(place.path(name)).unwrap().to_rgba8().get_pixel(x, 16).0;
    assert_eq!(pixel("n.png", 16), [191, 128, 238, 255]);
    // 0.5 lies between two steps of sRGB, 187.5.
    assert!([[137, 187, 225, 255], [137, 188, 225, 255]].contains(&pixel("b.png", 16)), "{:?}", pixel("b.png", 16));
    assert_eq!(pixel("m.png", 16), [51, 51, 51, 255]);
    let sky = image::open(place.path("n.png")).unwrap().to_rgba8().get_pixel(0, 0).0;
    assert_eq!(sky, [0, 0, 0, 255]);
    let mut archive = npyz::npz::NpzArchive::open(place.path("p.npz")).unwrap();
    let array = archive.by_name("position").unwrap().unwrap();
    assert_eq!(array.shape(), [33, 33, 3]);
    let values: Vec<f32> = array.into_vec().unwrap();
    assert_eq!(values[3 * MIDDLE], all.channels["position.X"][MIDDLE]);
    // The resource as it is stored is still there.
    assert!(npyz::npz::NpzArchive::open(place.path("g.npz")).unwrap().by_name("core").unwrap().is_some());
}

#[test]
fn what_cannot_be_saved_is_refused_before_anything_is_rendered() {
    let place = Place::new();
    let before = place.files();
    for (arguments, says) in [
        (
            "--save gbuffer.nromal=n.exr",
            "`gbuffer.nromal`: a G-buffer has no layer `nromal` (did you mean `normal`?); its layers are normal,",
        ),
        ("--save gbuffer.albedo_of=n.exr", "position"),
        ("--save gbuffer.depth=d.png", "d.png: this cannot be written in that format; name the file with .exr, .npz"),
        ("--save sum.normal=n.exr", "there is no `sum.normal`"),
        ("--save nothing.normal=n.exr", "there is no `nothing.normal`"),
        ("--aovs all.png", "all.png: this cannot be written in that format; name the file with .exr"),
        ("--aovs missing/all.exr", "missing"),
        ("--aovs a.exr -o a.exr", "a.exr: two results cannot be written to one file"),
        ("--frames 3 -o f.##.%d.png", "more than one place for the number of the frame"),
        ("--frames 3 -o f.##.exr --aovs f.%02d.exr", "f.00.exr: two results cannot be written to one file"),
        ("--fps 0 -o a.png", "`0` is no number of frames per second"),
    ] {
        let output = place.run(&format!("render g.ron --scene s.ron --size 8x8 {arguments}"));
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments}\n{errors}");
        assert!(errors.contains(says), "{arguments}\n{errors}");
    }
    assert_eq!(place.files(), before);
}

/// Decoders of both kinds on any word that may stand in a texel.
#[test]
fn texels_are_decoded_as_shaders_do() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::surface::{PackedSurface, unpack_surface}
struct Input { core_x: u32, core_y: u32, specular: u32, geometric_normal: u32, emissive: u32 }
struct Output { normal: vec4f, geometric_normal: vec4f, base_color: vec4f, specular: vec4f, emissive: vec4f }
fn evaluate(input: Input) -> Output {
    let surface = unpack_surface(PackedSurface(vec2u(input.core_x, input.core_y), input.specular, input.geometric_normal, input.emissive));
    return Output(
        vec4f(surface.normal, 0.0), vec4f(surface.geometric_normal, 0.0), vec4f(surface.base_color, 0.0),
        vec4f(surface.roughness, surface.metallic, surface.specular, 0.0), vec4f(surface.emissive, 0.0),
    );
}";
    let special = [0u32, u32::MAX, 0x7fff_8000, 0x8000_7fff, 0x8001_8001, 0x07ff_ffff, 0xf800_0001];
    let rows: Vec<[u32; 5]> = (0..20_000u32)
        .map(|index| {
            let word = |which: u32| special.get(index as usize).copied().unwrap_or_else(|| hash(5 * index + which));
            [word(0), word(1), word(2), word(3), word(4)]
        })
        .collect();
    let flags = Flags::new().with("SPECULAR", true).with("NORMAL_MAP", true).with("EMISSIVE", true);
    let found: Vec<[f32; 20]> = evaluate(gpu, wgsl, &flags, &rows).unwrap();
    for (row, found) in rows.iter().zip(&found) {
        let expected = [
            octahedral_unpack(row[0]).to_array(),
            octahedral_unpack(row[3]).to_array(),
            unpack_color(row[1]).to_array(),
            unpack_specular(row[2]),
            unpack_shared_exponent(row[4]).to_array(),
        ];
        for (part, expected) in expected.iter().enumerate() {
            let largest = expected.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
            for channel in 0..3 {
                let error = (f64::from(found[4 * part + channel]) - expected[channel]).abs();
                assert!(error <= 2e-6 * largest, "part {part} of {row:x?}: {found:?} instead of {expected:?}");
            }
        }
        // The other word would not pass.
        assert!(row[1] == row[4] || unpack_color(row[1]) != unpack_shared_exponent(row[4]));
    }
}
