// Radiance to display colours.

#import lobelia::tonemap::{aces, agx, srgb_encode}

struct Settings {
    // 2^stops over the pre-exposure.
    exposure: f32,
    padding_a: f32,
    padding_b: f32,
    padding_c: f32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var radiance: texture_2d<f32>;
@group(0) @binding(2) var picture: texture_storage_2d<rgba8unorm, write>;

@compute @workgroup_size(8, 8)
fn tonemap(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(picture)) {
        return;
    }
    // The factor is held where this stays below 1e30; the curves cut off what is whiter than white.
    let exposed = textureLoad(radiance, id.xy, 0).rgb * settings.exposure;
#if CURVE == 1
    let mapped = aces(exposed);
#else if CURVE == 2
    let mapped = agx(exposed);
#else
    let mapped = exposed;
#endif
    textureStore(picture, id.xy, vec4f(srgb_encode(mapped), 1.0));
}
