// Shadows on pygfx's surfaces, from maps of ours (surface_shadows.py): a part of its shaders. Percentage-closer filtering (Reeves et al.
// 1987) with a smooth kernel of 8 x 8 texels. Each texel is tested against the plane of the surface where that texel is, so that a plane
// never shades itself, whatever its slope. A texel that lies behind that plane tells nothing of the surface, since it does not go on so far:
// it is left out. So a filter at the joint of two walls does not reach past them, into the open, and there are no lines of light.
const KERNEL_RADIUS = 4.0;      // texels
const BIAS = 0.06;              // texels that a caster stands off the plane at least: for drivers of 4 bits of subpixel precision
const BIAS_BEND = 0.02;         // texels more, times the square of those from the kernel's middle: for surfaces that are bent inwards
const BIAS_HIDDEN = 0.02;       // texels that it does where the middle is hidden: of a joint's wall hardly a texel passes for its neighbour
const SURELY_HIDDEN = 0.5;      // texels off the plane
const BEHIND = 0.25;            // texels behind the plane, and four times the bias more, begins what is left out
const LEAST_COSINE = 0.02;      // between light and normal, that is reckoned with

/// Evaluate the kernel's weight, 0..1, so many texels from its middle. Twin: reference/shadows.py:kernel_weight.
fn kernel_weight(x: vec4<f32>) -> vec4<f32> {
    let near = max(1.0 - x * x / (KERNEL_RADIUS * KERNEL_RADIUS), vec4<f32>(0.0));
    return near * near;
}

/// Number the face of a cube, +X, -X, +Y, -Y, +Z, -Z, that a direction from its middle meets. Twin: reference/shadows.py:cube_face.
fn cube_face(direction: vec3<f32>) -> i32 {
    let away = abs(direction);
    if (away.x >= away.y && away.x >= away.z) { return select(1, 0, direction.x > 0.0); }
    if (away.y >= away.z) { return select(3, 2, direction.y > 0.0); }
    return select(5, 4, direction.z > 0.0);
}

/// Differentiate x, y and depth in a map with respect to a step, both homogeneous. Twin: reference/shadows.py:map_derivative.
fn map_derivative(at: vec4<f32>, step: vec4<f32>) -> vec3<f32> {
    return (step.xyz - at.xyz / at.w * step.w) / at.w;
}

/// Find the slope of depth over x and y, from the derivatives along two steps. area: the least that they may span.
/// Twin: reference/shadows.py:depth_slope.
fn depth_slope(u: vec3<f32>, v: vec3<f32>, area: f32) -> vec2<f32> {
    let spanned = u.x * v.y - u.y * v.x;
    let divisor = select(min(spanned, -area), max(spanned, area), spanned >= 0.0);
    return vec2<f32>(u.z * v.y - v.z * u.y, v.z * u.x - u.z * v.x) / divisor;
}

/// Weigh four texels of a kernel: (of those that are lit, of all that tell of the surface). above: texels that they stand off the plane
/// towards the light; bias: texels. Twin: reference/shadows.py:weigh_texels.
fn weigh_texels(weight: vec4<f32>, above: vec4<f32>, bias: vec4<f32>, casts: bool) -> vec2<f32> {
    let told = select(weight, vec4<f32>(0.0), (above < -BEHIND - 4.0 * bias) & vec4<bool>(casts));
    let lit = select(told, vec4<f32>(0.0), above > bias);
    return vec2<f32>(dot(lit, vec4<f32>(1.0)), dot(told, vec4<f32>(1.0)));
}

/// Tell whether an object is drawn into the maps, by its number.
fn is_caster(id: u32) -> bool {
    let word = u_ambient_light.casters[min(id >> 7u, {{ airlight_casters - 1 }}u)][(id >> 5u) & 3u];
    return ((word >> (id & 31u)) & 1u) == 1u;
}

/// Filter what a shadow map lets through to a place on a surface of this facet. view: into u_ambient_light.views, world to homogeneous
/// coordinates of the map, in texels; casts: whether the surface is drawn into it. Outside the map everything is lit.
fn surface_shadow(maps: texture_depth_2d_array, layer: i32, view: i32, place: vec3<f32>, facet: vec3<f32>, to_light: vec3<f32>, casts: bool) -> f32 {
    let matrix = u_ambient_light.views[view];
    let scale = u_ambient_light.scales[view]; // metres that a texel is wide; how much more a metre along the view's axis; of depth; its near plane
    let at = matrix * vec4<f32>(place, 1.0);
    let size = vec2<f32>(textureDimensions(maps));
    let middle = at.xyz / at.w;
    if (at.w <= 0.0 || any(middle.xy < vec2<f32>(0.0)) || any(middle.xy > size)) { return 1.0; }
    // Find the plane in the map
    let across = normalize(select(vec3<f32>(facet.z, 0.0, -facet.x), vec3<f32>(0.0, facet.z, -facet.y), abs(facet.y) > 0.7));
    let texel = scale.x + scale.y * at.w;
    let u = map_derivative(at, matrix * vec4<f32>(across, 0.0));
    let v = map_derivative(at, matrix * vec4<f32>(cross(facet, across), 0.0));
    let slope = depth_slope(u, v, LEAST_COSINE / (texel * texel));
    let metres = scale.z + scale.w * at.w * at.w; // along a ray of the light, of depth
    let texels = metres * max(abs(dot(facet, to_light)), LEAST_COSINE) / texel; // off the plane, of depth
    let base = floor(middle.xy - 0.5);
    let part = middle.xy - 0.5 - base;
    let last = vec2<i32>(size) - 1;
    // Test the four texels in the middle
    let first = clamp(vec2<i32>(base), vec2<i32>(0), last - 1);
    let depths = vec4<f32>(
        textureLoad(maps, first, layer, 0),
        textureLoad(maps, first + vec2<i32>(1, 0), layer, 0),
        textureLoad(maps, first + vec2<i32>(0, 1), layer, 0),
        textureLoad(maps, first + 1, layer, 0),
    );
    let planes = middle.z + slope.x * (vec4<f32>(0.0, 1.0, 0.0, 1.0) - part.x) + slope.y * (vec4<f32>(0.0, 0.0, 1.0, 1.0) - part.y);
    let hidden = any(texels * (depths - planes) > vec4<f32>(SURELY_HIDDEN));
    let bias = select(vec2<f32>(BIAS, BIAS_BEND), vec2<f32>(BIAS_HIDDEN, 0.0), hidden);
    // Weigh all texels around
    let left = vec4<f32>(-3.0, -2.0, -1.0, 0.0) - part.x;
    let right = vec4<f32>(1.0, 2.0, 3.0, 4.0) - part.x;
    let weight_left = kernel_weight(left);
    let weight_right = kernel_weight(right);
    var sum = vec2<f32>(0.0);
    $$ for j in range(-3, 5)
    {
        let down = {{ j }}.0 - part.y;
        let y = clamp(i32(base.y) + {{ j }}, 0, last.y);
        let weight = kernel_weight(vec4<f32>(down)).x;
        let plane = middle.z + slope.y * down;
        $$ for side, first in (("left", -3), ("right", 1))
        let depths_{{ side }} = vec4<f32>(
            $$ for i in range(first, first + 4)
            textureLoad(maps, vec2<i32>(clamp(i32(base.x) + {{ i }}, 0, last.x), y), layer, 0),
            $$ endfor
        );
        let above_{{ side }} = texels * (depths_{{ side }} - plane - slope.x * {{ side }});
        sum += weigh_texels(weight * weight_{{ side }}, above_{{ side }}, bias.x + bias.y * ({{ side }} * {{ side }} + down * down), casts);
        $$ endfor
    }
    $$ endfor
    return select(sum.x / sum.y, 1.0, sum.y <= 0.0);
}
