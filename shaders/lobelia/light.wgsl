// Punctual lights at a point of the scene (KHR_lights_punctual without range; spot falloff with smooth square).
#define_import_path lobelia::light

#import lobelia::math::{safe_normalize, square}
#import lobelia::scene::{PunctualLight, LIGHT_DIRECTIONAL, LIGHT_SPOT}

struct LightSample {
    // Unit, from the point to the light.
    direction: vec3f,
    // Metres; a large number for directional lights.
    distance: f32,
    // On a surface that faces the light, W/m^2.
    irradiance: vec3f,
}

// Square of the smallest distance that counts, m^2: keeps a point on the light finite.
const MIN_DISTANCE_SQUARED: f32 = 1e-10;

// 1 inside the inner cone, 0 outside the outer one. `cos_angle` is that between the axis and the direction from the light.
fn spot_falloff(light: PunctualLight, cos_angle: f32) -> f32 {
    return square(clamp((cos_angle - light.cos_outer) * light.spot_scale, 0.0, 1.0));
}

// Radiant intensity towards the unit direction `from_light`, W/sr.
fn light_intensity(light: PunctualLight, from_light: vec3f) -> vec3f {
    if light.kind == LIGHT_SPOT {
        return light.intensity * spot_falloff(light, dot(from_light, light.direction));
    }
    return light.intensity;
}

fn light_sample(light: PunctualLight, position: vec3f) -> LightSample {
    if light.kind == LIGHT_DIRECTIONAL {
        return LightSample(-light.direction, 1e30, light.intensity);
    }
    let to_light = light.position - position;
    let distance_squared = max(dot(to_light, to_light), MIN_DISTANCE_SQUARED);
    let direction = safe_normalize(to_light, -light.direction);
    return LightSample(direction, sqrt(distance_squared), light_intensity(light, -direction) / distance_squared);
}
