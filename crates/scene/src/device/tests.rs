#![allow(clippy::unwrap_used)]

use super::{
    ViewUniform,
    uniform::{instance_bytes, light_bytes, material_bytes, view_bytes},
};
use crate::{AlphaMode, Camera, Instance, LightKind, Material, PunctualLight, Scene, TextureRef};
use glam::{DMat4, DVec3, DVec4, Vec2, Vec3};
use std::collections::HashMap;

/// Reads members of a struct out of bytes, where the shaders' own declaration puts them.
struct Layout {
    span: usize,
    members: HashMap<String, (usize, naga::TypeInner)>,
}

impl Layout {
    fn of(name: &str) -> Self {
        let source = include_str!("../../../../shaders/lobelia/scene.wgsl").replace("#define_import_path", "//");
        let module = naga::front::wgsl::parse_str(&source).unwrap();
        let (_, declared) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).unwrap();
        let naga::TypeInner::Struct { members, span } = &declared.inner else { panic!("{name} is no struct") };
        let inner = |member: &naga::StructMember| (member.offset as usize, module.types[member.ty].inner.clone());
        Self { span: *span as usize, members: members.iter().map(|member| (member.name.clone().unwrap(), inner(member))).collect() }
    }

    /// The 32-bit words of a member, without padding.
    fn words<const N: usize>(&self, bytes: &[u8], member: &str) -> [u32; N] {
        let (offset, ty) = &self.members[member];
        let count = match ty {
            naga::TypeInner::Scalar(_) => 1,
            naga::TypeInner::Vector { size, .. } => *size as usize,
            naga::TypeInner::Matrix { columns, rows, .. } => *columns as usize * *rows as usize,
            other => panic!("{member} is {other:?}"),
        };
        assert_eq!(count, N, "{member}");
        std::array::from_fn(|word| u32::from_le_bytes(bytes[offset + 4 * word..][..4].try_into().unwrap()))
    }

    fn floats<const N: usize>(&self, bytes: &[u8], member: &str) -> [f32; N] {
        self.words(bytes, member).map(f32::from_bits)
    }
}

fn camera() -> Camera {
    Camera::look_at("main", DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.5, -1.0), DVec3::Y, 0.8, 0.05).unwrap()
}

#[test]
fn the_view_is_laid_out_as_shaders_read_it() {
    let first = ViewUniform::new(&camera(), DVec3::ZERO, [320, 180], Vec2::ZERO, 6, 40, None);
    let view = ViewUniform::new(&camera(), DVec3::X, [320, 180], Vec2::new(0.25, -0.5), 7, 41, Some(&first));
    let (layout, bytes) = (Layout::of("View"), view_bytes(&view));
    assert_eq!(bytes.len(), layout.span);
    assert_eq!(layout.floats(&bytes, "clip_from_scene"), view.clip_from_scene.to_cols_array());
    assert_eq!(layout.floats(&bytes, "previous_clip_from_scene"), first.clip_from_scene.to_cols_array());
    assert_eq!(layout.floats(&bytes, "position"), [0.0, 2.0, 3.0]);
    assert_eq!(layout.floats(&bytes, "near"), [0.05]);
    assert_eq!(layout.floats(&bytes, "forward"), view.forward.to_array());
    assert_eq!(layout.words(&bytes, "frame"), [7]);
    assert_eq!(layout.floats(&bytes, "right"), view.right.to_array());
    assert_eq!(layout.words(&bytes, "seed"), [41]);
    assert_eq!(layout.floats(&bytes, "up"), view.up.to_array());
    assert_eq!(layout.floats(&bytes, "extent"), [320.0, 180.0]);
    assert_eq!(layout.floats(&bytes, "jitter"), [0.25, -0.5]);
    // Without a frame before, nothing has moved.
    assert_eq!(first.previous_clip_from_scene, first.clip_from_scene);
}

/// A point seen through the sample position of pixel (x, y), `depth` metres along the view direction.
fn seen(view: &ViewUniform, pixel: Vec2, depth: f32) -> Vec3 {
    // `primary_ray` of the shaders.
    let ndc = (pixel + 0.5 + view.jitter) * 2.0 / view.extent - 1.0;
    view.position + (view.forward + ndc.x * view.right - ndc.y * view.up) * depth
}

#[test]
fn what_a_pixel_samples_is_drawn_at_its_centre() {
    let camera = camera();
    for (origin, jitter) in [(DVec3::ZERO, Vec2::ZERO), (DVec3::new(3.0, -2.0, 8.0), Vec2::new(0.25, -0.5))] {
        let view = ViewUniform::new(&camera, origin, [320, 180], jitter, 0, 0, None);
        for (pixel, depth) in [((0.0, 0.0), 0.5), ((319.0, 0.0), 4.0), ((100.0, 150.0), 1000.0), ((0.0, 179.0), 7.0)] {
            let pixel = Vec2::from(pixel);
            let clip = view.clip_from_scene * seen(&view, pixel, depth).extend(1.0);
            let ndc = clip.truncate() / clip.w;
            // Where the rasteriser puts it, y down.
            let drawn = Vec2::new((ndc.x + 1.0) / 2.0 * 320.0, (1.0 - ndc.y) / 2.0 * 180.0);
            assert!((drawn - pixel - 0.5).abs().max_element() < 2e-3, "{pixel} is drawn at {drawn}");
            assert!((ndc.z - 0.05 / depth).abs() <= 2e-5 * ndc.z, "depth {depth} is {}", ndc.z);
        }
    }
}

#[test]
fn the_ray_of_a_pixel_is_that_of_the_reference() {
    // A camera at the origin that looks along -Z; W x H = 320 x 180.
    let camera = Camera::look_at("main", DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.8, 0.1).unwrap();
    let view = ViewUniform::new(&camera, DVec3::ZERO, [320, 180], Vec2::ZERO, 0, 0, None);
    let (i, j, tangent) = (17.0f32, 40.0f32, 0.4f32.tan());
    let expected = Vec3::new((2.0 * (i + 0.5) / 320.0 - 1.0) * 320.0 / 180.0 * tangent, (1.0 - 2.0 * (j + 0.5) / 180.0) * tangent, -1.0);
    assert!((seen(&view, Vec2::new(i, j), 1.0) - expected).length() < 1e-6);
}

#[test]
fn ten_kilometres_away_the_view_is_the_same() {
    let far = DVec3::new(10_000.0, -4000.0, 6000.0);
    let mut there = camera();
    there.position += far;
    let here = ViewUniform::new(&camera(), DVec3::X, [320, 180], Vec2::ZERO, 0, 0, None);
    assert_eq!(ViewUniform::new(&there, DVec3::X + far, [320, 180], Vec2::ZERO, 0, 0, None), here);
}

fn light(kind: LightKind) -> PunctualLight {
    let (position, direction) = (DVec3::new(10_001.0, 2.5, 3.0), DVec3::NEG_Y);
    PunctualLight { name: "lamp".into(), kind, position, direction, intensity: Vec3::new(4.0, 5.0, 6.0), animated: false, node: None }
}

#[test]
fn lights_are_laid_out_as_shaders_read_them() {
    let layout = Layout::of("PunctualLight");
    let mut scene = Scene::default();
    scene.nodes.origin = Some(DVec3::new(10_000.0, 0.0, 0.0));
    // An empty list holds one light that does nothing.
    let none = light_bytes(&scene, 1.0);
    assert_eq!((none.len(), layout.floats(&none, "intensity")), (layout.span, [0.0; 3]));
    let narrow = LightKind::Spot { inner: 0.01, outer: 0.01 };
    scene.lights =
        vec![light(LightKind::Point), light(LightKind::Spot { inner: 0.3, outer: 0.6 }), light(LightKind::Directional), light(narrow)];
    let bytes = light_bytes(&scene, 1.0);
    assert_eq!(bytes.len(), 4 * layout.span);
    let at = |index: usize| &bytes[index * layout.span..];
    for (index, kind) in [0, 1, 2, 1].into_iter().enumerate() {
        assert_eq!(layout.words(at(index), "kind"), [kind]);
        assert_eq!(layout.floats(at(index), "position"), [1.0, 2.5, 3.0]);
        assert_eq!(layout.floats(at(index), "direction"), [0.0, -1.0, 0.0]);
        assert_eq!(layout.floats(at(index), "intensity"), [4.0, 5.0, 6.0]);
    }
    let [cos_outer] = layout.floats(at(1), "cos_outer");
    let [scale] = layout.floats(at(1), "spot_scale");
    assert!((cos_outer - 0.6f32.cos()).abs() < 1e-7 && (scale * (0.3f32.cos() - 0.6f32.cos()) - 1.0).abs() < 1e-6);
    // The difference of the cosines counts as 0.001 at least.
    assert!((layout.floats::<1>(at(3), "spot_scale")[0] - 1000.0).abs() < 1e-3);
}

#[test]
fn normals_go_by_the_inverse_transpose() {
    let layout = Layout::of("Instance");
    let sheared = DMat4::from_cols(
        DVec4::new(2.0, 0.5, 0.0, 0.0),
        DVec4::new(0.0, 3.0, 0.0, 0.0),
        DVec4::new(1.0, 0.0, 1e-6, 0.0),
        DVec4::new(9.0, 8.0, 7.0, 1.0),
    );
    let mirrored = sheared * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let mut scene = Scene::default();
    scene.nodes.origin = Some(DVec3::new(9.0, 0.0, 0.0));
    let place = |matrix| Instance {
        mesh: 0,
        world_from_local: matrix,
        name: String::new(),
        area_light: None,
        node: None,
        node_from_local: DMat4::IDENTITY,
    };
    scene.instances =
        vec![place(sheared), place(mirrored), place(DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0))), place(DMat4::from_scale(DVec3::ZERO))];
    let bytes = instance_bytes(&scene);
    assert_eq!(bytes.len(), 4 * layout.span);
    let columns = |index: usize| {
        let bytes = &bytes[index * layout.span..];
        ["normal_column_x", "normal_column_y", "normal_column_z"].map(|name| layout.floats::<4>(bytes, name))
    };
    assert_eq!(layout.floats::<16>(&bytes, "scene_from_local")[12..], [0.0, 8.0, 7.0, 1.0]);
    for (index, matrix, sign) in [(0, sheared, 1.0), (1, mirrored, -1.0)] {
        let columns = columns(index);
        assert_eq!(columns[0][3], sign);
        let normal_from_local = glam::DMat3::from_mat4(matrix).inverse().transpose();
        for normal in [DVec3::X, DVec3::new(1.0, 2.0, -3.0)] {
            let expected = (normal_from_local * normal).normalize();
            let [x, y, z] = columns.map(|column| DVec3::new(column[0].into(), column[1].into(), column[2].into()));
            let found = (x * normal.x + y * normal.y + z * normal.z).normalize();
            assert!((found - expected).length() < 1e-6, "{found} is not {expected}");
        }
    }
    // What is flat keeps the normal that it can have; what is nothing has none, and no NaN.
    assert_eq!(columns(2), [[0.0, 0.0, 0.0, 1.0], [0.0; 4], [0.0, 0.0, 1.0, 0.0]]);
    assert_eq!(columns(3), [[0.0, 0.0, 0.0, 1.0], [0.0; 4], [0.0; 4]]);
}

#[test]
fn materials_are_laid_out_as_shaders_read_them() {
    let layout = Layout::of("Material");
    let mut material = Material {
        base_color: Vec3::new(0.1, 0.2, 0.3),
        metallic: 0.4,
        roughness: 0.5,
        emissive: Vec3::new(6.0, 7.0, 8.0),
        specular: 0.9,
        normal_scale: 1.5,
        ..Material::default()
    };
    let bytes = material_bytes(&material, 1.0);
    assert_eq!(bytes.len(), layout.span);
    assert_eq!(layout.floats(&bytes, "base_color"), [0.1, 0.2, 0.3]);
    assert_eq!(layout.floats(&bytes, "metallic"), [0.4]);
    assert_eq!(layout.floats(&bytes, "emissive"), [6.0, 7.0, 8.0]);
    assert_eq!(layout.floats(&bytes, "roughness"), [0.5]);
    assert_eq!(layout.floats(&bytes, "specular"), [0.9]);
    // Neither map nor mask.
    assert_eq!((layout.floats(&bytes, "normal_scale"), layout.floats(&bytes, "alpha_cutoff")), ([0.0], [0.0]));
    material.normal_texture = Some(TextureRef::default());
    material.alpha_mode = AlphaMode::Mask { cutoff: 0.75 };
    let bytes = material_bytes(&material, 1.0);
    assert_eq!((layout.floats(&bytes, "normal_scale"), layout.floats(&bytes, "alpha_cutoff")), ([1.5], [0.75]));
}
