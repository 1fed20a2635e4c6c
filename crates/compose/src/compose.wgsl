// The sum of up to eight radiance images.

#import lobelia::math::storable

#if TERMS >= 1
@group(0) @binding(0) var term_a: texture_2d<f32>;
#endif
#if TERMS >= 2
@group(0) @binding(1) var term_b: texture_2d<f32>;
#endif
#if TERMS >= 3
@group(0) @binding(2) var term_c: texture_2d<f32>;
#endif
#if TERMS >= 4
@group(0) @binding(3) var term_d: texture_2d<f32>;
#endif
#if TERMS >= 5
@group(0) @binding(4) var term_e: texture_2d<f32>;
#endif
#if TERMS >= 6
@group(0) @binding(5) var term_f: texture_2d<f32>;
#endif
#if TERMS >= 7
@group(0) @binding(6) var term_g: texture_2d<f32>;
#endif
#if TERMS >= 8
@group(0) @binding(7) var term_h: texture_2d<f32>;
#endif
@group(0) @binding(8) var radiance: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn sum(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(radiance)) {
        return;
    }
    var total = vec3f(0.0);
#if TERMS >= 1
    total += textureLoad(term_a, id.xy, 0).rgb;
#endif
#if TERMS >= 2
    total += textureLoad(term_b, id.xy, 0).rgb;
#endif
#if TERMS >= 3
    total += textureLoad(term_c, id.xy, 0).rgb;
#endif
#if TERMS >= 4
    total += textureLoad(term_d, id.xy, 0).rgb;
#endif
#if TERMS >= 5
    total += textureLoad(term_e, id.xy, 0).rgb;
#endif
#if TERMS >= 6
    total += textureLoad(term_f, id.xy, 0).rgb;
#endif
#if TERMS >= 7
    total += textureLoad(term_g, id.xy, 0).rgb;
#endif
#if TERMS >= 8
    total += textureLoad(term_h, id.xy, 0).rgb;
#endif
    textureStore(radiance, id.xy, vec4f(storable(total), 1.0));
}
