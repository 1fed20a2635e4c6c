//! `extras.area_light`.

use crate::glb::Glb;
use approx::assert_relative_eq;
use glam::{DVec3, Vec3};
use lobelia_scene::{AreaShape, Scene};
use serde_json::{Value, json};

fn with(light: Value) -> Glb {
    let mut glb = Glb::triangle();
    // Turned so that local -Z becomes +Y.
    let turn = std::f64::consts::FRAC_1_SQRT_2;
    glb.node(
        json!({"name": "lamp", "translation": [0, 5, 0], "rotation": [turn, 0, 0, turn], "extras": {"area_light": light, "other": 3}}),
    );
    glb
}

/// The light's surface: sum of its triangles' areas times normals, total area, and the corners about the light's centre.
fn surface(scene: &Scene) -> (DVec3, f64, Vec<DVec3>) {
    let instance = scene.instances.iter().position(|instance| instance.area_light == Some(0)).unwrap();
    let (mut vector, mut total, mut corners) = (DVec3::ZERO, 0.0, Vec::new());
    for triangle in scene.triangles().iter().filter(|triangle| triangle.instance == instance) {
        let [a, b, c] = triangle.positions.map(|corner| corner.as_dvec3() + scene.origin() - DVec3::new(0.0, 5.0, 0.0));
        let area = (b - a).cross(c - a) / 2.0;
        vector += area;
        total += area.length();
        corners.extend([a, b, c]);
        let material = &scene.materials[triangle.material];
        assert_eq!((material.base_color, material.specular, material.metallic), (Vec3::ZERO, 0.0, 0.0));
        assert_eq!(material.emissive, scene.area_lights[0].radiance);
    }
    (vector, total, corners)
}

#[test]
fn a_quad_emits_towards_local_minus_z() {
    let scene = with(json!({"shape": "quad", "width": 2.0, "height": 3.0, "radiance": [1, 2, 3]})).load().unwrap();
    assert_eq!(scene.area_lights[0].shape, AreaShape::Quad { width: 2.0, height: 3.0 });
    assert_eq!((scene.area_lights[0].name.as_str(), scene.area_lights[0].radiance), ("lamp", Vec3::new(1.0, 2.0, 3.0)));
    let (vector, _, corners) = surface(&scene);
    assert!((vector - 6.0 * DVec3::Y).length() < 1e-5, "{vector}");
    // Width along local X, which stays; height along local Y, which is now Z.
    let reach = corners.iter().fold(DVec3::ZERO, |reach, corner| reach.max(corner.abs()));
    assert!((reach - DVec3::new(1.0, 0.0, 1.5)).length() < 1e-6, "{reach}");
    let normals = &scene.meshes[scene.instances[1].mesh].normals;
    assert!(normals.iter().all(|normal| *normal == Vec3::NEG_Z));
}

/// A concave polygon is covered by its triangles whichever way around it is written, and its corners run counter-clockwise as seen from where it emits.
#[test]
fn a_polygon_emits_towards_local_minus_z() {
    let mut corners = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.5]];
    for _ in 0..2 {
        let scene = with(json!({"shape": "polygon", "vertices": corners, "radiance": [1, 2, 3], "two_sided": true})).load().unwrap();
        let (vector, area, _) = surface(&scene);
        assert!((vector - 1.5 * DVec3::Y).length() < 1e-5 && (area - 1.5).abs() < 1e-5, "{vector} {area}");
        assert!(scene.area_lights[0].two_sided && scene.materials.last().unwrap().emits_both_ways);
        let outline = scene.area_lights[0].shape.outline().unwrap();
        let turned: f32 = (0..4).map(|index| outline[index].perp_dot(outline[(index + 1) % 4])).sum();
        assert!((turned + 3.0).abs() < 1e-6, "twice the area, clockwise about +Z: {turned}");
        assert_eq!((scene.traits().polygon_lights, scene.traits().area_lights()), (1, 1));
        corners.reverse();
    }
}

#[test]
fn a_disk_has_the_area_of_a_disk() {
    let scene = with(json!({"shape": "disk", "radius": 0.5, "radiance": [1, 1, 1]})).load().unwrap();
    let (vector, ..) = surface(&scene);
    assert_relative_eq!(vector.y, std::f64::consts::PI / 4.0, max_relative = 1e-6);
    assert!(vector.x.abs() + vector.z.abs() < 1e-6);
}

#[test]
fn a_sphere_emits_outwards() {
    let scene = with(json!({"shape": "sphere", "radius": 0.5, "radiance": [1, 1, 1]})).load().unwrap();
    let (vector, area, corners) = surface(&scene);
    assert!(vector.length() < 1e-6);
    assert_relative_eq!(area, std::f64::consts::PI, max_relative = 5e-3);
    for triangle in corners.chunks_exact(3) {
        let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
        assert!(normal.dot(triangle[0] + triangle[1] + triangle[2]) > 0.0, "{triangle:?} faces inwards");
    }
}

#[test]
fn traits_count_area_lights_and_ignore_their_surfaces() {
    let mut glb = with(json!({"shape": "disk", "radius": 0.5, "radiance": [1, 1, 1]}));
    glb.json["materials"] = json!([{"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5}}]);
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let traits = glb.load().unwrap().traits();
    assert_eq!((traits.quad_lights, traits.disk_lights, traits.sphere_lights, traits.punctual_lights()), (0, 1, 0, 0));
    assert_eq!((traits.sharpest_alpha, traits.metallic, traits.emissive), (Some(0.25), false, true));
}

#[test]
fn broken_area_lights_are_refused() {
    for (light, expected) in [
        (json!({"shape": "quad", "width": 1, "radiance": [1, 1, 1]}), "a quad needs `height`"),
        (json!({"shape": "disk", "radius": -1, "radiance": [1, 1, 1]}), "`radius` is -1, but must be positive and finite"),
        (json!({"shape": "disk", "radius": 1e300, "radiance": [1, 1, 1]}), "`radius` is inf, but must be positive and finite"),
        (json!({"shape": "sphere", "radius": 1, "radiance": [1, -1, 1]}), "must be finite and not negative"),
        (json!({"shape": "sphere", "radius": 1, "radiance": [1, 1]}), "extras.area_light: invalid length 2"),
        (json!({"shape": "cube", "radius": 1, "radiance": [1, 1, 1]}), "shape `cube` is none of quad, disk, sphere, polygon"),
        (json!({"shape": "sphere", "radius": 1}), "missing field `radiance`"),
        (json!({"shape": "polygon", "radiance": [1, 1, 1]}), "a polygon needs `vertices`"),
        (json!({"shape": "polygon", "vertices": [[0, 0], [1, 0]], "radiance": [1, 1, 1]}), "has 2 corners"),
        (json!({"shape": "polygon", "vertices": [[0, 0], [1, 0], [1, 0]], "radiance": [1, 1, 1]}), "`vertices[1]` and the next"),
        (
            json!({"shape": "polygon", "vertices": [[0, 0], [1, 1], [1, 0], [0, 1]], "radiance": [1, 1, 1]}),
            "`vertices[0]` and from `vertices[2]` meet",
        ),
        (json!({"shape": "polygon", "vertices": [[0, 0], [1, 0], [2, 0]], "radiance": [1, 1, 1]}), "`vertices` has no area"),
        (json!(7), "extras.area_light"),
    ] {
        let error = with(light).error();
        assert!(error.contains("node 1 (`lamp`)") && error.contains(expected), "{error}");
    }
}
