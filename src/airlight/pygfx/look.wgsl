// Measures of a picture that contrast needs before its source is made. Twin: reference/scene.py:look. One workgroup, in a fixed order.
//! include "wgsl/luminance.wgsl"
//! include "pygfx/emission.wgsl"
override STEP: u32 = 8u;        // every how many-th pixel, along both sides
const LANES = 256u;

@group(0) @binding(0) var<storage, read> view: SceneUniforms;
@group(0) @binding(3) var<storage, read_write> looked: array<f32>; // occluders' mean RGB, fog's level, fog's distance

var<workgroup> colors: array<vec4f, LANES>; // RGB (1 - m), 1 - m
var<workgroup> logs: array<vec4f, LANES>;   // log distance (1 - m), log luminance of all, of what emits; its count

/// Takes the logarithm of a luminance, held within 1e-5 and 1e5. Twin: reference/colour.py:log_luminance.
fn log_luminance(c: vec3f) -> f32 {
    return log(clamp(luminance(c), 1e-5, 1e5));
}

/// Measures every STEP-th pixel along both axes, and writes the means.
@compute @workgroup_size(LANES)
fn look(@builtin(local_invocation_index) lane: u32) {
    let size = vec2u(view.pixels);
    let count = (size + STEP - 1u) / STEP;
    var color = vec4f(0.0);
    var log_sum = vec4f(0.0);
    for (var i = lane; i < count.x * count.y; i += LANES) {
        let p = vec2i(vec2u(i % count.x, i / count.x) * STEP);
        let uv = (vec2f(p) + 0.5) * view.pixel;
        var light = vec4f(0.0);
        if (CONES > 0u) { light = lights_at(uv); }
        let depth = textureLoad(depths, p, 0);
        let pixel = seen(p, depth, light);
        let level = log_luminance(pixel.rgb);
        color += (1.0 - pixel.a) * vec4f(pixel.rgb, 1.0);
        if (pixel.a < 1.0) {
            log_sum.x += (1.0 - pixel.a) * log(max(axial(depth) * length(view_ray(uv)), 1e-20));
        }
        log_sum += vec4f(0.0, level, level * pixel.a, pixel.a);
    }
    colors[lane] = color;
    logs[lane] = log_sum;
    workgroupBarrier();
    if (lane != 0u) { return; }
    color = vec4f(0.0);
    log_sum = vec4f(0.0);
    for (var i = 0u; i < LANES; i++) {
        color += colors[i];
        log_sum += logs[i];
    }
    let all = f32(count.x * count.y);
    let mean = color.rgb / max(color.a, 1e-6);
    looked[0] = mean.r;
    looked[1] = mean.g;
    looked[2] = mean.b;
    // the level of what emits; where hardly anything does, of the whole picture
    looked[3] = exp((log_sum.z + 0.02 * log_sum.y) / (log_sum.w + 0.02 * all));
    looked[4] = select(exp(log_sum.x / max(color.a, 1e-6)), view.reach, view.reach > 0.0);
}
