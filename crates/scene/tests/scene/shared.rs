//! The large shared scenes, and the built-in ones against them.

use crate::glb::{folder, load_in, shared_scenes};
use glam::Vec3;
use lobelia_scene::{Scene, SceneTraits};
use std::path::Path;

fn load(scenes: &Path, name: &str) -> Scene {
    let path = scenes.join(name);
    Scene::load(path.to_str().unwrap()).unwrap_or_else(|error| panic!("{error}"))
}

fn glb(scenes: &Path, name: &str) -> Scene {
    load(scenes, &format!("{name}/{name}.glb"))
}

#[test]
fn all_of_them_load() {
    let Some(scenes) = shared_scenes() else { return };
    let traits = |name: &str| glb(&scenes, name).traits();
    let spot = |traits: &SceneTraits| (traits.spot_lights, traits.punctual_lights(), traits.cube_lights);

    let quad = traits("area-quad");
    assert_eq!((quad.quad_lights, quad.disk_lights, quad.sphere_lights), (1, 0, 0));
    assert_eq!(quad.triangles, 42 + 2);
    let both = traits("area-disk-sphere");
    assert_eq!((both.quad_lights, both.disk_lights, both.sphere_lights), (0, 1, 1));
    // Its spheres, and the vases of the atrium, have triangles without area at their poles.
    let spheres = glb(&scenes, "env-spheres");
    assert_eq!((spheres.traits().triangles, spheres.traits().punctual_lights()), (40_962 - 1092, 0));
    assert!(spheres.warnings[0].starts_with("triangles without area are dropped: 1092, first in mesh"), "{:?}", spheres.warnings);
    let atrium = traits("atrium");
    assert_eq!((atrium.triangles, spot(&atrium)), (81_954 - 288, (1, 1, 0)));
    assert!(atrium.normal_maps && atrium.base_color_textures && !atrium.alpha_mask && !atrium.animated);
    let room = traits("living-room");
    assert_eq!((room.triangles, spot(&room)), (131_807, (1, 1, 0)));
}

#[test]
fn a_gltf_file_with_files_beside_it() {
    let Some(scenes) = shared_scenes() else { return };
    let helmet = load(&scenes, "flight-helmet/FlightHelmet.gltf");
    let traits = helmet.traits();
    assert_eq!((traits.triangles, traits.textures), (94_722, 15));
    assert!(traits.normal_maps && traits.metallic_roughness_textures);
    assert_eq!(helmet.camera(None).unwrap().name, "whole-scene");
}

#[test]
fn environment_maps_by_way_of_a_wrapper() {
    let Some(scenes) = shared_scenes() else { return };
    for name in ["autoshop_01_1k", "brown_photostudio_02_1k", "noon_grass_1k"] {
        let file = scenes.join(format!("environments/{name}.hdr"));
        let text = format!("(gltf: \"builtin:spheres\", environment: (file: {:?}, scale: 0.5))", file.to_str().unwrap());
        let scene = load_in(&folder(&[("scene.ron", text.as_bytes())]), "scene.ron").unwrap();
        let environment = scene.environment.as_ref().unwrap();
        assert_eq!((environment.width, environment.height, environment.scale), (1024, 512, 0.5));
        assert_eq!(environment.pixels.len(), 1024 * 512);
        assert!(environment.pixels.iter().all(|pixel| pixel.is_finite()) && scene.traits().environment);
    }
}

/// Compares all that matters for a picture.
fn same(builtin: &Scene, file: &Scene) {
    let close = |left: Vec3, right: Vec3, what: &str| assert!((left - right).abs().max_element() <= 2e-6, "{what}: {left} is not {right}");
    assert_eq!(builtin.origin(), file.origin());
    let (ours, theirs) = (builtin.triangles(), file.triangles());
    assert_eq!(ours.len(), theirs.len());
    for (index, (left, right)) in ours.iter().zip(&theirs).enumerate() {
        let name = &file.instances[right.instance].name;
        assert_eq!(builtin.instances[left.instance].name, *name);
        for corner in 0..3 {
            close(left.positions[corner], right.positions[corner], &format!("triangle {index} of {name}"));
        }
        let (ours, theirs) = (&builtin.materials[left.material], &file.materials[right.material]);
        assert_eq!((&ours.name, ours.base_color), (&theirs.name, theirs.base_color));
        assert_eq!((ours.metallic, ours.roughness, ours.emissive), (theirs.metallic, theirs.roughness, theirs.emissive));
    }
    for (left, right) in builtin.instances.iter().zip(&file.instances) {
        let (ours, theirs) = (&builtin.meshes[left.mesh], &file.meshes[right.mesh]);
        assert_eq!(ours.normals.len(), theirs.normals.len());
        ours.normals.iter().zip(&theirs.normals).for_each(|(left_normal, right_normal)| close(*left_normal, *right_normal, &left.name));
    }
    assert_eq!((builtin.lights.len(), builtin.cameras.len()), (file.lights.len(), file.cameras.len()));
    for (left, right) in builtin.lights.iter().zip(&file.lights) {
        assert_eq!((&left.name, left.kind), (&right.name, right.kind));
        close(left.intensity, right.intensity, "intensity");
        close(left.position.as_vec3(), right.position.as_vec3(), "position");
        close(left.direction.as_vec3(), right.direction.as_vec3(), "direction");
    }
    for (left, right) in builtin.cameras.iter().zip(&file.cameras) {
        assert_eq!(left.name, right.name);
        assert!((left.yfov - right.yfov).abs() < 1e-6 && (left.near - right.near).abs() < 1e-6, "{left:?} is not {right:?}");
        for (left, right) in
            [(left.position, right.position), (left.forward, right.forward), (left.up, right.up), (left.right, right.right)]
        {
            close(left.as_vec3(), right.as_vec3(), "camera");
        }
    }
    let (ours, theirs) = (builtin.traits(), file.traits());
    assert!(
        (ours.bounds.min - theirs.bounds.min).abs().max_element() < 1e-5
            && (ours.bounds.max - theirs.bounds.max).abs().max_element() < 1e-5
    );
    assert_eq!(SceneTraits { bounds: theirs.bounds, ..ours }, theirs);
}

#[test]
fn built_in_scenes_are_those_of_the_files() {
    let Some(scenes) = shared_scenes() else { return };
    for name in ["cornell-glossy", "ring-caustic"] {
        same(&Scene::load(&format!("builtin:{name}")).unwrap(), &glb(&scenes, name));
    }
}

#[test]
#[should_panic(expected = "is not")]
fn a_moved_corner_is_noticed() {
    let still = Scene::load("builtin:cornell-glossy").unwrap();
    let mut moved = still.clone();
    moved.instances[5].world_from_local.w_axis.x += 1e-4;
    same(&moved, &still);
}

#[test]
fn the_light_of_the_hall_moves_without_a_change_of_its_file() {
    let Some(scenes) = shared_scenes() else { return };
    let text = include_bytes!("../../../../scenes/atrium-moving-light.ron");
    let hall = std::fs::read(scenes.join("atrium/atrium.glb")).unwrap();
    let mut scene = load_in(&folder(&[("moving.ron", text), ("atrium.glb", &hall)]), "moving.ron").unwrap();
    let still = glb(&scenes, "atrium");
    // It starts where the file has it.
    assert!((scene.lights[0].position - still.lights[0].position).length() < 1e-6);
    assert!((scene.lights[0].direction - still.lights[0].direction).length() < 1e-3);
    assert_eq!((scene.lights[0].kind, scene.lights[0].intensity), (still.lights[0].kind, still.lights[0].intensity));
    assert_eq!((scene.traits().animation_seconds, scene.traits().normal_maps), (2.0, true));
    scene.set_time(1.5);
    assert!((scene.lights[0].position - still.lights[0].position).length() > 1.0);
}
