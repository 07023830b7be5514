// Joint bilateral upsampling (Kopf et al. 2007) of a march at a part of the picture's size: each pixel takes the mean of 4 x 4 neighbours,
// weighted by their nearness and by the likeness of their rays' lengths, its guide. Where none of them is alike, as in gaps between leaves,
// a search on a spiral finds the nearest one that is. Twin: reference/march.py:upsampled. Whoever includes this says whether it MARKS unsure
// pixels, and has `mark` for these.
//! include "scatter/march/ray.wgsl"
//! include "scatter/march/likeness.wgsl"
//! include "wgsl/unit_at.wgsl"

const SEARCH_STEPS = 64.0;      // of the spiral
const BEND_SHARE = 4.0;         // of the difference between means over 4 x 4 and 2 x 2 neighbours, that a pixel may be wrong by
const DEVIATION_SHARE = 0.5;    // of the standard deviation of the 4 x 4
const SPAN_SHARE = 0.125;       // of the range of 2 x 2 neighbours

/// Read a pixel of the smaller march: radiance, and its ray's length; or, where density varies, what its optical length is more than the
/// air's closed form.
fn marched(q: vec2i) -> vec4f {
    return textureLoad(before, clamp(q, vec2i(0), vec2i(frame.size) - 1), 0);
}

/// Average the colours of a radiance. Twin: reference/refine.py:grey.
fn grey(radiance: vec3f) -> f32 {
    return dot(radiance, vec3f(1.0 / 3.0));
}

/// Estimate the error of a pixel's upsampled radiance, from the difference of its means over 4 x 4 neighbours and over 2 x 2, from the standard
/// deviation of the former, as in the middle of an edge these are the same, and from the range of the latter whatever their depth.
/// Twin: reference/refine.py:upsampling_error.
fn upsampling_error(bend: f32, deviation: f32, span: f32) -> f32 {
    return max(BEND_SHARE * abs(bend), max(DEVIATION_SHARE * deviation, SPAN_SHARE * span));
}

/// Search on a spiral (Vogel 1979) around a position of the smaller march for the nearest ray about as long as this one, or else take the
/// likest; the longer its own ray, the less of its radiance. own: the ray's optical length by height alone, m; likest: radiance, and the
/// ray's length; likest_more: see marched. Returns the radiance, and this of it.
fn search_alike(at: vec2f, ray: Ray, own: f32, likest: vec4f, likest_more: f32) -> vec4f {
    let reach = ray.reach;
    var best = likest;
    var more = likest_more;
    var off = relative_difference(best.a, reach);
    var k = 0.0;
    loop {
        if (off <= frame.depth_threshold || k >= SEARCH_STEPS) { break; }
        let q = vec2i(floor(at + 0.5 + sqrt(k + 4.0) * unit_at(2.3999632 * k)));
        let held = marched(q);
        let found = vec4f(held.rgb, marched_length(clamp(q, vec2i(0), vec2i(frame.size) - 1), held));
        if (relative_difference(found.a, reach) < off) {
            best = found;
            more = held.a;
            off = relative_difference(found.a, reach);
        }
        k += 1.0;
    }
    let whole = select(own * best.a / max(reach, 1e-6), best.a, FOG == EVEN && !VARIES) + select(0.0, more, VARIES);
    let longer = transmittance_integral(whole, frame.sigma_t);
    more *= min(reach / max(best.a, 1e-6), 1.0);
    let less = transmittance_integral(own + select(0.0, more, VARIES), frame.sigma_t) / max(longer, vec3f(1e-20));
    return vec4f(best.rgb * min(less, vec3f(1.0)), more);
}

/// Upsample the pixels between four of what was marched in one invocation, since these have the same neighbours, and put each into the picture:
/// put_upsampled(pixel, ray, own, color), own: the ray's optical length by height alone, m; color: radiance, and what marched gives more.
fn upsample_between(id: vec2u) {
    // Find the pixels, and read their neighbours
    let ratio = vec2f(frame.pixels) / vec2f(frame.size);
    let shift = vec2f(sampled_pixel(frame.size / 2u)) + 0.5 - (vec2f(frame.size / 2u) + 0.5) * ratio; // of the march, from its middle
    let cell = vec2f(id) - 1.0;
    let first = vec2u(clamp(ceil((cell + 0.5) * ratio + shift - 0.5), vec2f(0.0), vec2f(frame.pixels)));
    let end = vec2u(clamp(ceil((cell + 1.5) * ratio + shift - 0.5), vec2f(0.0), vec2f(frame.pixels)));
    let count = end - first;
    let base = vec2i(id) - 2;
    var held = array<vec4f, 16>();
    var more = array<f32, 16>();
    //! each k of 16: held[k] = marched(base + vec2i(vec2u(k % 4u, k / 4u)));
    if (VARIES) {
        //! each k of 16: more[k] = held[k].a; held[k].a = marched_length(clamp(base + vec2i(vec2u(k % 4u, k / 4u)), vec2i(0), vec2i(frame.size) - 1), held[k]);
    }
    var greys = array<f32, 16>();
    var extremes = vec2f(3e38, 0.0);
    var error = 0.0;
    if (MARKS) {
        //! each k of 16: greys[k] = grey(held[k].rgb);
        //! each k of 4: extremes = vec2f(min(extremes.x, greys[5u + k % 2u + 4u * (k / 2u)]), max(extremes.y, greys[5u + k % 2u + 4u * (k / 2u)]));
    }
    var n = 0u;
    loop {
        if (n >= count.x * count.y) { break; }
        // Weigh the neighbours of a pixel by nearness and likeness
        let pixel = first + vec2u(n % count.x, n / count.x);
        let ray = camera_ray_at(pixel);
        let reach = ray.reach;
        let at = (vec2f(pixel) + 0.5 - shift) / ratio - 0.5;
        let near_x = max(2.0 - abs(f32(base.x) + vec4f(0.0, 1.0, 2.0, 3.0) - at.x), vec4f(0.0));
        let near_y = max(2.0 - abs(f32(base.y) + vec4f(0.0, 1.0, 2.0, 3.0) - at.y), vec4f(0.0));
        var sum = vec4f(0.0);
        var likest = vec4f(0.0);
        var likest_more = 0.0;
        var sum_more = 0.0;
        var least = 3e38;
        var near = 0.0;
        var off = 0.0;
        //! each k of 16: near = near_x[k % 4u] * near_y[k / 4u]; off = relative_difference(held[k].a, reach); sum += (near * exp(-frame.depth_sharpness * off) + 1e-20) * vec4f(held[k].rgb, 1.0); if (VARIES) { sum_more += (near * exp(-frame.depth_sharpness * off) + 1e-20) * more[k]; } if (off < least && near > 1e-3) { least = off; likest = held[k]; likest_more = more[k]; }
        var color = vec4f(sum.rgb, sum_more) / sum.a;
        let own = optical_length(ray, reach);
        // Estimate how wrong it is
        if (MARKS) {
            let mean = grey(color.rgb);
            var squares = 0.0;
            //! each k of 16: near = near_x[k % 4u] * near_y[k / 4u]; off = relative_difference(held[k].a, reach); squares += (near * exp(-frame.depth_sharpness * off) + 1e-20) * (greys[k] - mean) * (greys[k] - mean);
            var closest = vec2f(0.0);
            //! each k of 4: near = max(near_x[1u + k % 2u] - 1.0, 0.0) * max(near_y[1u + k / 2u] - 1.0, 0.0); off = relative_difference(held[5u + k % 2u + 4u * (k / 2u)].a, reach); closest += (near * exp(-frame.depth_sharpness * off) + 1e-20) * vec2f(greys[5u + k % 2u + 4u * (k / 2u)], 1.0);
            error = max(error, upsampling_error(mean - closest.x / closest.y, sqrt(squares / sum.a), extremes.y - extremes.x));
        }
        // Search farther away where none is alike
        if (least > frame.depth_threshold) { color = search_alike(at, ray, own, likest, likest_more); }
        put_upsampled(pixel, ray, own, color);
        n += 1u;
    }
    // Mark all of them where one is unsure: one alone would stand out
    if (MARKS) {
        n = 0u;
        loop {
            if (n >= count.x * count.y) { break; }
            mark(first + vec2u(n % count.x, n / count.x), error);
            n += 1u;
        }
    }
}
