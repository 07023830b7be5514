// Light on pygfx's surfaces behind what dims or colours it, from maps of glass_maps.py: a part of light_shadow.wgsl.
//! include "scatter/march/glass_texel.wgsl"
@group({{ airlight_glass[0] }}) @binding({{ airlight_glass[1] }})
var<storage, read> u_glass: array<vec4u>; // see GlassMaps

const GLASS_BIAS = 1e-3;        // of depths, which are half floats, by which a surface lies before one that may be itself
const GLASS_SLACK = 0.1;        // texels of its slope more

/// Look up what is left of a light at a place on a surface of this facet, of four texels around, by their nearness. view: as of surface_shadow.
/// Surfaces that may be in the map themselves are looked up at the depth that their plane has in the middle of each texel, and a little before
/// that; others at their own, since where they meet glass their planes go on before it. Outside the map nothing dims the light.
fn surface_left(view: i32, place: vec3f, facet: vec3f) -> vec3f {
    let held = u_ambient_light.glass[view]; // its first texel, their number along a side, and that of the shadow map
    let matrix = u_ambient_light.views[view];
    let at = matrix * vec4f(place, 1.0);
    let middle = at.xyz / at.w;
    let texels = u_ambient_light.scales[view].xy; // see surface_shadow
    let size = f32(held.z);
    if (at.w <= 0.0 || any(middle.xy < vec2f(0.0)) || any(middle.xy > vec2f(size))) { return vec3f(1.0); }
    let wide = size / f32(held.y); // texels of the shadow map that one of this is
    $$ if alpha_method != "opaque" or use_alpha_test or airlight_split is defined
    let across = normalize(select(vec3f(facet.z, 0.0, -facet.x), vec3f(0.0, facet.z, -facet.y), abs(facet.y) > 0.7));
    let texel = texels.x + texels.y * at.w;
    let u = map_derivative(at, matrix * vec4f(across, 0.0));
    let v = map_derivative(at, matrix * vec4f(cross(facet, across), 0.0));
    let slope = wide * depth_slope(u, v, LEAST_COSINE / (texel * texel));
    let bias = GLASS_BIAS * middle.z + GLASS_SLACK * (abs(slope.x) + abs(slope.y));
    $$ else
    let slope = vec2f(0.0);
    let bias = 0.0;
    $$ endif
    let base = floor(middle.xy / wide - 0.5);
    let part = middle.xy / wide - 0.5 - base;
    var sum = vec3f(0.0);
    $$ for j in range(2)
    $$ for i in range(2)
    {
        let corner = vec2f({{ i }}.0, {{ j }}.0);
        let cell = vec2u(clamp(base + corner, vec2f(0.0), vec2f(f32(held.y) - 1.0)));
        let index = 2u * (held.x + cell.y * held.y + cell.x);
        let found = u_glass[index];
        let more = u_glass[index + 1u].xy;
        let depth = middle.z + dot(slope, corner - part) + bias;
        let surfaces = vec4f(unpack2x16float(found.x), unpack2x16float(found.y));
        let near = mix(1.0 - part, part, corner);
        sum += near.x * near.y * unpack_left(code_behind(depth, surfaces, vec4u(found.zw, more)));
    }
    $$ endfor
    $$ endfor
    return sum;
}
