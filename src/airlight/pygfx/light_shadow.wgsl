// Shadows on pygfx's surfaces, from maps of ours (surface_shadows.py): a part of its shaders. Percentage-closer filtering (Reeves et al.
// 1987) with a smooth kernel of 4 x 4 texels. Each texel is tested against the plane of the surface where that texel is, so that a plane
// never shades itself, whatever its slope. A texel that lies behind that plane tells nothing of the surface, since it does not go on so far:
// it is left out. So a filter at the joint of two walls does not reach past them, into the open, and there are no lines of light.
//! include "pygfx/shadow_kernel.wgsl"
const BIAS = 0.06;              // texels that a caster stands off the plane at least: for drivers of 4 bits of subpixel precision
const BIAS_BEND = 0.02;         // texels more, times the square of those from the kernel's middle: for surfaces that are bent inwards
const BIAS_HIDDEN = 0.01;       // texels that it does where the middle is hidden: of a joint's wall hardly a texel passes for its neighbour
const SURELY_HIDDEN = 0.5;      // texels off the plane
const JOINED = 3.0;             // texels off the plane, up to which something may be a wall that meets the surface within the kernel
const NOTHING = -1e9;           // the depth of what the map holds 0 for, where nothing casts: a surface may lie below its far plane
const LEAK = 0.08;              // share of a kernel that texels at a joint may still take for lit
const LEAST_COSINE = 0.02;      // between light and normal, that is reckoned with

/// Filter what a shadow map lets through to a place on a surface of this facet. view: into u_ambient_light.views, world to homogeneous
/// coordinates of the map, in texels; casts: whether the surface is drawn into it. Outside the map everything is lit.
fn surface_shadow(maps: texture_depth_2d_array, layer: i32, view: i32, place: vec3f, facet: vec3f, to_light: vec3f, casts: bool) -> f32 {
    let matrix = u_ambient_light.views[view];
    let scale = u_ambient_light.scales[view]; // metres that a texel is wide; how much more a metre along the view's axis; of depth; its near plane
    let at = matrix * vec4f(place, 1.0);
    let size = vec2f(textureDimensions(maps));
    let middle = at.xyz / at.w;
    if (at.w <= 0.0 || any(middle.xy < vec2f(0.0)) || any(middle.xy > size)) { return 1.0; }
    // Find the plane in the map
    let across = normalize(select(vec3f(facet.z, 0.0, -facet.x), vec3f(0.0, facet.z, -facet.y), abs(facet.y) > 0.7));
    let texel = scale.x + scale.y * at.w;
    let u = map_derivative(at, matrix * vec4f(across, 0.0));
    let v = map_derivative(at, matrix * vec4f(cross(facet, across), 0.0));
    let slope = depth_slope(u, v, LEAST_COSINE / (texel * texel));
    let metres = scale.z + scale.w * at.w * at.w; // along a ray of the light, of depth
    let texels = metres * max(abs(dot(facet, to_light)), LEAST_COSINE) / texel; // off the plane, of depth
    // Gather 4 x 4 texels, four at a time: (left below, right below, right above, left above)
    let base = floor(middle.xy - 0.5);
    let part = middle.xy - 0.5 - base;
    let plane = middle.z - dot(slope, part);
    $$ for k in range(2)
    let column_{{ k }} = vec4f({{ 2 * k - 1 }}.0, {{ 2 * k }}.0, {{ 2 * k }}.0, {{ 2 * k - 1 }}.0);
    let row_{{ k }} = vec4f({{ 2 * k }}.0, {{ 2 * k }}.0, {{ 2 * k - 1 }}.0, {{ 2 * k - 1 }}.0);
    $$ endfor
    $$ for j in range(2)
    $$ for i in range(2)
    let depths_{{ i }}{{ j }} = textureGather(maps, s_shadow, (base + vec2f({{ 2 * i }}.0, {{ 2 * j }}.0)) / size, layer);
    let cast_{{ i }}{{ j }} = select(depths_{{ i }}{{ j }}, vec4f(NOTHING), depths_{{ i }}{{ j }} == vec4f(0.0));
    let above_{{ i }}{{ j }} = texels * (cast_{{ i }}{{ j }} - plane - slope.x * column_{{ i }} - slope.y * row_{{ j }});
    $$ endfor
    $$ endfor
    // Test the four in the middle
    let inner = vec4f(above_00.y, above_10.x, above_01.z, above_11.w);
    let hidden = any(inner > vec4f(SURELY_HIDDEN));
    $$ for at in ("00", "10", "01", "11")
    let rises_{{ at }} = any((above_{{ at }} > vec4f(SURELY_HIDDEN)) & (above_{{ at }} < vec4f(JOINED)));
    $$ endfor
    let met = hidden || rises_00 || rises_10 || rises_01 || rises_11; // a wall whose nearest texel is within the bias is told by the next
    let joint = met && casts && any(inner < vec4f(-SURELY_HIDDEN)); // where the surface ends in a shadow
    let bias = select(vec2f(BIAS, BIAS_BEND), vec2f(BIAS_HIDDEN, 0.0), hidden);
    // Weigh all of them
    var sum = vec2f(0.0);
    $$ for j in range(2)
    $$ for i in range(2)
    {
        let x = column_{{ i }} - part.x;
        let y = row_{{ j }} - part.y;
        sum += weigh_texels(kernel_weight(x) * kernel_weight(y), above_{{ i }}{{ j }}, bias.x + bias.y * (x * x + y * y), casts);
    }
    $$ endfor
    $$ endfor
    let lit = select(max(sum.x / sum.y - LEAK, 0.0) / (1.0 - LEAK), 1.0, sum.y <= 0.0);
    return select(lit, 0.0, joint);
}
$$ if airlight_glass
//! include "pygfx/surface_glass.wgsl"
$$ endif
