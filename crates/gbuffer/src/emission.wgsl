// Radiance that surfaces emit towards the camera, and the environment where no surface is.

#import lobelia::math::{HALF_MAX, INV_PI, safe_normalize, storable}
#import lobelia::packing::unpack_shared_exponent
#import lobelia::scene::{View, primary_ray}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var gbuffer_depth: texture_depth_2d;
#ifdef EMISSIVE
@group(0) @binding(2) var gbuffer_emissive: texture_2d<u32>;
#endif
#ifdef ENVIRONMENT
@group(0) @binding(3) var environment: texture_2d<f32>;
@group(0) @binding(4) var environment_sampler: sampler;
#endif
@group(0) @binding(5) var radiance: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn emission(@builtin(global_invocation_id) id: vec3u) {
    let extent = textureDimensions(radiance);
    if any(id.xy >= extent) {
        return;
    }
    var emitted = vec3f(0.0);
    if textureLoad(gbuffer_depth, id.xy, 0) > 0.0 {
#ifdef EMISSIVE
        emitted = unpack_shared_exponent(textureLoad(gbuffer_emissive, id.xy, 0).x);
        // The most that the packing holds: it was cut off there, and is to be seen as such.
        emitted = select(emitted, vec3f(HALF_MAX), emitted >= vec3f(65408.0));
#endif
    } else {
#ifdef ENVIRONMENT
        // Pixel (u, v) lies in direction (sin 2 pi u sin pi v, cos pi v, -cos 2 pi u sin pi v).
        let direction = safe_normalize(primary_ray(view, vec2f(id.xy)), view.forward);
        let around = atan2(direction.x, -direction.z) * (0.5 * INV_PI);
        let down = acos(clamp(direction.y, -1.0, 1.0)) * INV_PI;
        emitted = textureSampleLevel(environment, environment_sampler, vec2f(around, down), 0.0).rgb;
#endif
    }
    textureStore(radiance, id.xy, vec4f(storable(emitted), 1.0));
}
