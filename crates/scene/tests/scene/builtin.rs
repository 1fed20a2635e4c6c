//! The scenes made in code.

use lobelia_scene::{LightKind, Ndf, Scene, builtin_names};

#[test]
fn every_built_in_scene_loads_and_has_light_and_a_main_camera() {
    let names: Vec<&str> = builtin_names().iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["cornell-glossy", "cornell-diffuse", "ring-caustic", "area-lights", "spheres"]);
    for (name, what) in builtin_names() {
        let scene = Scene::load(&format!("builtin:{name}")).unwrap();
        assert!(!what.is_empty() && scene.warnings.is_empty());
        assert!(!scene.lights.is_empty() || !scene.area_lights.is_empty());
        assert_eq!(scene.camera(None).unwrap().name, "main");
        for (camera, light) in scene.cameras.iter().flat_map(|camera| scene.lights.iter().map(move |light| (camera, light))) {
            for axis in [camera.forward, camera.up, camera.right, light.direction] {
                assert!((axis.length() - 1.0).abs() < 1e-9, "{name}: {axis} is not unit");
            }
            assert!((camera.forward.cross(camera.up) - camera.right).length() < 1e-9);
        }
    }
}

#[test]
fn normals_agree_with_the_winding() {
    for (name, _) in builtin_names() {
        let scene = Scene::load(&format!("builtin:{name}")).unwrap();
        for mesh in scene.meshes.iter() {
            for corners in mesh.indices.chunks_exact(3) {
                let [a, b, c] = [corners[0], corners[1], corners[2]].map(|corner| corner as usize);
                let face = (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]).normalize();
                for corner in [a, b, c] {
                    let normal = mesh.normals[corner];
                    assert!((normal.length() - 1.0).abs() < 1e-5 && normal.dot(face) > 0.5, "{name}: {normal} at a face {face}");
                }
            }
        }
    }
}

#[test]
fn traits_of_the_cornell_box() {
    let glossy = Scene::load("builtin:cornell-glossy").unwrap().traits();
    assert_eq!((glossy.triangles, glossy.instances, glossy.materials, glossy.textures), (34, 7, 6, 0));
    assert!(glossy.specular && glossy.metallic);
    assert!((glossy.sharpest_alpha.unwrap() - 0.35 * 0.35).abs() < 1e-6);
    assert_eq!((glossy.spot_lights, glossy.punctual_lights(), glossy.cube_lights), (1, 1, 0));
    assert!(!glossy.normal_maps && !glossy.alpha_mask && !glossy.emissive && !glossy.environment && !glossy.animated);
    assert_eq!((glossy.bounds.min.to_array(), glossy.bounds.max.to_array()), ([-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]));
    assert_eq!(glossy.ndf, Ndf::Ggx);

    let diffuse = Scene::load("builtin:cornell-diffuse").unwrap().traits();
    assert_eq!((diffuse.triangles, diffuse.specular, diffuse.metallic, diffuse.sharpest_alpha), (34, false, false, None));
    let general = diffuse.unspecialised();
    assert!(general.specular && general.metallic && general.normal_maps && general.alpha_mask && general.emissive);
    assert!(general.base_color_textures && general.metallic_roughness_textures && general.emissive_textures);
    assert_eq!((general.triangles, general.spot_lights, general.sharpest_alpha), (34, 1, None));
}

#[test]
fn traits_of_the_ring_and_the_spheres() {
    let ring = Scene::load("builtin:ring-caustic").unwrap().traits();
    assert_eq!((ring.triangles, ring.spot_lights, ring.punctual_lights()), (9730, 1, 1));
    assert!((ring.sharpest_alpha.unwrap() - 0.0625).abs() < 1e-6);
    let spheres = Scene::load("builtin:spheres").unwrap();
    let traits = spheres.traits();
    assert_eq!((traits.spot_lights, traits.point_lights, traits.cube_lights), (1, 1, 1));
    assert!((traits.sharpest_alpha.unwrap() - 0.01).abs() < 1e-6);
    let roughness: Vec<f32> =
        spheres.materials.iter().filter(|material| material.name.contains(' ')).map(|material| material.roughness).collect();
    assert_eq!(roughness.len(), 10);
    assert!((roughness[4] - 0.9).abs() < 1e-6 && (roughness[5] - 0.1).abs() < 1e-6);
    let LightKind::Spot { inner, outer } = spheres.lights[0].kind else { panic!("a spot comes first") };
    assert!(0.0 < inner && inner < outer);
}

#[test]
fn facts_are_for_reading() {
    let facts = Scene::load("builtin:cornell-glossy").unwrap().traits().facts();
    let of = |name: &str| facts.iter().find(|(known, _)| *known == name).map(|(_, value)| value.as_str()).unwrap();
    assert_eq!((of("triangles"), of("specular lobes"), of("sharpest alpha"), of("animation (s)")), ("34", "yes", "0.1225", "none"));
    assert_eq!((of("normal distribution"), of("size (m)")), ("ggx", "2.000 x 2.000 x 2.000"));
}

#[test]
fn distribution_names() {
    assert_eq!(("ggx".parse(), "phong".parse()), (Ok(Ndf::Ggx), Ok(Ndf::Phong)));
    assert_eq!((Ndf::Ggx.to_string(), Ndf::Phong.to_string()), ("ggx".into(), "phong".into()));
    assert_eq!("beckmann".parse::<Ndf>().unwrap_err(), "`beckmann` is neither ggx nor phong");
}

#[test]
fn built_in_scenes_are_of_ordinary_brightness() {
    for (name, _) in builtin_names() {
        let scene = Scene::load(&format!("builtin:{name}")).unwrap();
        assert_eq!(scene.pre_exposure(), 1.0, "{name}");
        let size = scene.seen_size();
        assert!(size > 0.05 && size < scene.bounds().radius(), "{name}: {size}");
    }
}
