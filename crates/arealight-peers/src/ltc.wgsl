
#ifdef SPECULAR
// Two vectors for every fit: the inverse map's numbers; the light that is reflected, whole and with Schlick's term.
@group(0) @binding(10) var<storage, read> table: array<vec4f>;

struct Fit {
    inverse: mat3x3f,
    reflected: vec2f,
}

fn fit_at(alpha: f32, cosine: f32) -> Fit {
    let last = f32(settings.table_size - 1u);
    let place = clamp(vec2f(sqrt(1.0 - min(cosine, 1.0)), sqrt(alpha)), vec2f(0.0), vec2f(1.0)) * last;
    let corner = min(floor(place), vec2f(last - 1.0));
    let f = place - corner;
    let first = (u32(corner.y) * settings.table_size + u32(corner.x)) * 2u;
    let below = first + settings.table_size * 2u;
    let map = mix(mix(table[first], table[first + 2u], f.x), mix(table[below], table[below + 2u], f.x), f.y);
    let light = mix(mix(table[first + 1u].xy, table[first + 3u].xy, f.x), mix(table[below + 1u].xy, table[below + 3u].xy, f.x), f.y);
    return Fit(mat3x3f(vec3f(map.x, 0.0, map.z), vec3f(0.0, 1.0, 0.0), vec3f(map.y, 0.0, map.w)), light);
}
#endif

fn light_from(index: u32, brdf: Brdf, frame: SurfaceFrame, pixel: vec2u) -> vec3f {
    let outline = area_light_outline(lights[index], frame, SIDES);
    if outline.count < 3u {
        return vec3f(0.0);
    }
    var sent = brdf.diffuse * mapped_irradiance(outline, frame, NO_MAP);
#ifdef SPECULAR
    let fit = fit_at(brdf.alpha, frame.viewer.z);
    let share = mapped_irradiance(outline, frame, fit.inverse) * 0.318309886;
    sent += share * (brdf.reflectance_normal * (fit.reflected.x - fit.reflected.y) + vec3f(brdf.reflectance_grazing * fit.reflected.y));
#endif
    return sent;
}
