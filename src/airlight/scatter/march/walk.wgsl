// The exact texel walk.
//! include "scatter/march/ray.wgsl"
override BIASED: bool = false;  // shadows begin farther behind what hides the light

fn lit(p: vec3f) -> f32 {
    if (light.views == 0u) { return 1.0; }
    var best = -1; var w = 0.0;
    var found = vec4f(0.0);
    for (var i = 0u; i < 6u; i++) {
        if (i < light.views) {
            let q = light.view[i].matrix * vec4f(p, 1.0);
            if (KIND == 0u) {
                if (best < 0 && -p.z < light.view[i].far) { best = i32(i); found = q; }
            } else if (q.w > w) { w = q.w; best = i32(i); found = q; }
        }
    }
    if (best < 0) { return 1.0; }
    let x = found.xyz / found.w;
    if (any(x.xy < vec2f(0.0)) || any(x.xy >= vec2f(light.side))) { return 1.0; }
    return select(0.0, 1.0, max(x.z, 0.0) >= textureLoad(shadow, vec2u(x.xy), best, 0));
}

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= frame.size)) { return; }
    let ray = ray_at(id.xy);
    var sum = begun(id.xy, ray);
    if (KIND < 3u) {
        let h = ray.reach / 400.0;
        for (var i = 0u; i < 400u; i++) {
            let a = f32(i) * h;
            let p = ray.origin + (a + 0.5 * h) * ray.direction;
            let v = lit(p);
            if (KIND == 0u) {
                sum += v * sunlight(ray) * between(a, a + h);
            } else {
                let to = light.place - p;
                let d = length(to);
                let aside = dot(-to, light.axis) / max(d, 1e-9);
                sum += v * h * lamplight(a + 0.5 * h, d, dot(to, ray.direction) / max(d, 1e-9), aside);
            }
        }
    }
    textureStore(layer, id.xy, vec4f(sum, ray.reach));
}
