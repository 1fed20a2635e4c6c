//! Compressed meshes and images, made by encoders and read back.

use crate::glb::{Glb, png};
use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, Mesh, MeshEncoder, PointAttribute, PointIndex,
};
use glam::Vec3;
use lobelia_scene::Scene;
use serde_json::{Value, json};

/// The corners of the unit square, as [`Glb::square`] has them.
const SQUARE: [[f32; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
const CORNERS: [u32; 6] = [0, 1, 2, 0, 2, 3];

/// Corner positions of all triangles, in an order that does not depend on that of the vertices.
fn corners(scene: &Scene) -> Vec<[i32; 3]> {
    let mut all: Vec<[i32; 3]> = scene
        .triangles()
        .iter()
        .flat_map(|triangle| triangle.positions)
        .map(|position| (position.as_dvec3() + scene.origin()).to_array().map(|value| (value * 1000.0).round() as i32))
        .collect();
    all.sort_unstable();
    all
}

fn meshopt(glb: &mut Glb, list: usize, mode: &str, filter: &str, stride: usize, count: usize, packed: &[u8]) {
    let source = glb.view(packed);
    let place = glb.json["bufferViews"][source]["byteOffset"].clone();
    let extension = json!({
        "buffer": 0, "byteOffset": place, "byteLength": packed.len(), "byteStride": stride, "count": count, "mode": mode, "filter": filter,
    });
    // Its own buffer is a placeholder without bytes.
    glb.json["bufferViews"][list] = json!({
        "buffer": 1, "byteOffset": 0, "byteLength": stride * count, "extensions": {"EXT_meshopt_compression": extension},
    });
}

#[test]
fn meshopt_views_are_unpacked() {
    use meshoptimizer_rs::{Workspace, codec};
    let plain = Glb::square(json!({})).load().unwrap();
    let mut glb = Glb::square(json!({}));
    let mut space = Workspace::default();
    let positions: Vec<u8> = SQUARE.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    let packed = codec::encode_vertex_buffer(&positions, 4, 12, codec::VertexEncoding::new(0, 0).unwrap(), &mut space).unwrap();
    meshopt(&mut glb, 0, "ATTRIBUTES", "NONE", 12, 4, &packed);
    let indices = codec::encode_index_buffer(&CORNERS, codec::IndexEncoding::DEFAULT, &mut space).unwrap();
    let view = glb.json["accessors"][3]["bufferView"].as_u64().unwrap() as usize;
    meshopt(&mut glb, view, "TRIANGLES", "NONE", 2, 6, &indices);
    glb.json["buffers"] =
        json!([{"byteLength": glb.bin.len()}, {"byteLength": 60, "extensions": {"EXT_meshopt_compression": {"fallback": true}}}]);
    glb.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    let scene = glb.load().unwrap();
    assert_eq!(corners(&scene), corners(&plain));
    assert_eq!(scene.meshes[0].positions, plain.meshes[0].positions);
    for (key, value, expected) in [
        ("count", json!(4_000_000_000u64), "at most 1073741824 bytes are read"),
        ("mode", json!("CUBES"), "the mode `CUBES`"),
        ("filter", json!("SOUP"), "the filter `SOUP`"),
        ("byteLength", json!(packed.len() - 1), "cannot be decoded with meshoptimizer"),
        ("byteOffset", json!(1 << 20), "lie outside of buffer 0"),
        ("byteStride", Value::Null, "the byteStride of its compression is no whole number"),
    ] {
        let mut broken = glb.clone();
        broken.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = value;
        let error = broken.error();
        assert!(error.contains("buffer view 0: ") && error.contains(expected), "`{expected}` is not in {error}");
    }
}

/// The square, compressed; positions have identifier 0.
fn draco() -> Vec<u8> {
    let mut mesh = Mesh::new();
    mesh.set_num_points(4);
    mesh.set_num_faces(2);
    for (face, corners) in CORNERS.chunks_exact(3).enumerate() {
        mesh.set_face(FaceIndex(face as u32), [corners[0], corners[1], corners[2]].map(PointIndex));
    }
    let mut positions = PointAttribute::new();
    positions.init(GeometryAttributeType::Position, 3, DataType::Float32, false, 4);
    let bytes: Vec<u8> = SQUARE.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    positions.buffer_mut().write(0, &bytes);
    mesh.add_attribute(positions);
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut out = EncoderBuffer::new();
    encoder.encode(&EncoderOptions::new(), &mut out).unwrap();
    out.data().to_vec()
}

#[test]
fn draco_primitives_are_decoded() {
    let plain = Glb::square(json!({})).load().unwrap();
    let packed = draco();
    let mut glb = Glb::empty();
    let view = glb.view(&packed);
    let position = glb.push("accessors", json!({"componentType": 5126, "count": 4, "type": "VEC3"}));
    let indices = glb.push("accessors", json!({"componentType": 5123, "count": 6, "type": "SCALAR"}));
    let extension = json!({"KHR_draco_mesh_compression": {"bufferView": view, "attributes": {"POSITION": 0}}});
    let mesh = glb.mesh(json!({"attributes": {"POSITION": position}, "indices": indices, "extensions": extension}));
    glb.node(json!({"mesh": mesh}));
    glb.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    assert_eq!(corners(&glb.load().unwrap()), corners(&plain));
    // Without indices, and with two primitives that share their accessors.
    let mut shared = glb.clone();
    let mut other = shared.json["meshes"][0]["primitives"][0].clone();
    other.as_object_mut().unwrap().remove("indices");
    shared.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(other);
    assert_eq!(shared.load().unwrap().triangles().len(), 4);
    let mut wrong = glb.clone();
    wrong.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = json!(7);
    assert!(wrong.error().contains("it has no attribute 7"));
    for length in [0, 5, packed.len() / 2, packed.len() - 1] {
        let mut cut = glb.clone();
        cut.json["bufferViews"][view]["byteLength"] = json!(length);
        assert!(cut.error().contains("it cannot be decoded with Draco"), "cut to {length}");
    }
}

#[test]
fn the_uncompressed_mesh_beside_a_broken_one_is_drawn() {
    let mut glb = Glb::square(json!({}));
    let view = glb.view(b"DRACO, but not really");
    glb.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_draco_mesh_compression": {"bufferView": view, "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}}});
    let scene = glb.load().unwrap();
    assert_eq!(corners(&scene), corners(&Glb::square(json!({})).load().unwrap()));
    assert!(scene.warnings[0].contains("the uncompressed mesh beside it is drawn"), "{:?}", scene.warnings);
}

fn webp(rgba: [u8; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_raw(1, 1, rgba.to_vec()).unwrap().write_to(&mut bytes, image::ImageFormat::WebP).unwrap();
    bytes.into_inner()
}

/// A KTX2 texture of one 4 x 4 block in one colour: UASTC's mode 8 (Basis Universal, UASTC texture specification).
fn ktx2(rgba: [u8; 4]) -> Vec<u8> {
    let mut block = 0x17u128;
    for (index, value) in rgba.iter().enumerate() {
        block |= u128::from(*value) << (5 + 8 * index);
    }
    let mut descriptor: Vec<u8> = [44u32, 0, 2 | 40 << 16].iter().flat_map(|word| word.to_le_bytes()).collect();
    descriptor.extend([166, 1, 2, 0, 3, 3, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0, 0, 0, 127, 3, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255]);
    let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    let words = [0u32, 1, 4, 4, 0, 0, 1, 1, 0, 104, 44, 0, 0, 0, 0, 0, 0];
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    bytes.extend([160u64, 16, 16].iter().flat_map(|word| word.to_le_bytes()));
    bytes.extend(&descriptor);
    bytes.resize(160, 0);
    bytes.extend(block.to_le_bytes());
    bytes
}

/// A square whose base colour comes from an extension's image, with or without a PNG beside it.
fn textured(extension: &str, image: &[u8], fallback: bool) -> Glb {
    let mut glb = Glb::square(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    glb.texture(&png(1, 1, &[1, 2, 3, 255]), json!({}));
    let view = glb.view(image);
    let source = glb.push("images", json!({"bufferView": view, "mimeType": "image/other"}));
    glb.json["textures"][0]["extensions"] = json!({extension: {"source": source}});
    if !fallback {
        glb.json["textures"][0].as_object_mut().unwrap().remove("source");
        glb.json["extensionsRequired"] = json!([extension]);
    }
    glb
}

#[test]
fn webp_and_ktx2_are_decoded_and_their_fallback_used_where_they_are_broken() {
    let colour = [40, 80, 120, 255];
    for (extension, image) in [("EXT_texture_webp", webp(colour)), ("KHR_texture_basisu", ktx2(colour))] {
        for fallback in [false, true] {
            let scene = textured(extension, &image, fallback).load().unwrap_or_else(|error| panic!("{extension}: {error}"));
            assert_eq!((scene.textures.len(), &scene.textures[0].rgba[..4]), (1, &colour[..]), "{extension}");
        }
        let broken = &image[..image.len() - 9];
        let scene = textured(extension, broken, true).load().unwrap();
        assert_eq!(scene.textures[0].rgba, [1, 2, 3, 255]);
        assert!(scene.warnings.iter().any(|warning| warning.contains("image 1") && warning.contains("image 0, its fallback, is used")));
        assert!(textured(extension, broken, false).error().contains("image 1: "));
    }
    let texture = textured("KHR_texture_basisu", &ktx2(colour), false).load().unwrap().textures[0].clone();
    assert_eq!((texture.width, texture.height, texture.rgba), (4, 4, colour.repeat(16)));
    // A texture of another extension, with a PNG that can be read.
    assert_eq!(textured("ACME_texture", b"??", true).load().unwrap().textures[0].rgba, [1, 2, 3, 255]);
    let mut none = Glb::square(json!({"emissiveTexture": {"index": 0}}));
    none.push("textures", json!({}));
    let scene = none.load().unwrap();
    assert!(scene.materials[0].emissive_texture.is_none() && scene.warnings[0].contains("textures without an image are ignored: 0"));
    assert_eq!(scene.materials[0].base_color, Vec3::ONE);
}
