// Structs of a march's uniforms, which records.py fills: the camera and its medium, a light and its shadow views. All in view space.
override DIRECTIONAL: bool = false; // the light is a sun: its rays are parallel, and its shadow views are cascades
override CONE: bool = false;    // the light is a spot
override BOUNDED: bool = false; // there is light between planes alone
override CUBE: bool = false;    // the light's shadow views are the faces of a cube around it
override LIT: bool = true;      // there is a light
override VARIES: bool = false;  // the density has more than closed forms
override FADES: bool = false;   // a sun's light is dimmed by the fog above

struct Frame {
    rays: vec4f,                // projection.py: eye_rays
    depth: vec4f,               // projection.py: depth_terms
    sigma_t: vec3f,             // 1/m
    flat: f32,                  // 1 without perspective
    sigma_s: vec3f,             // 1/m
    max_distance: f32,          // m
    ambient: vec3f,             // radiance
    base_height: f32,           // m of the eye above the fog's base
    up: vec3f,                  // unit
    fog_depth: f32,             // m
    fog_above: f32,             // density
    air: f32,                   // density of the air itself, that fog is a factor of, where the density varies; else 1
    sun_reach: f32,             // m from the eye that suns light
    sun_glow: f32,              // share of the glow around suns
    glow_concentration: f32,    // its kappa
    depth_sharpness: f32,       // of a neighbour's weight, by the relative difference of lengths
    depth_threshold: f32,       // relative, from which on a neighbour shows something else
    variance_cut: f32,          // visibility that counts as dark
    refine: f32,                // error of upsampling, of the mean radiance, from which on a pixel is marched by itself
    size: vec2u,                // of what is computed
    pixels: vec2u,              // of the picture
}

struct ShadowView {
    matrix: mat4x4f,            // view space to (x w, y w, depth w, w), x, y in texels; depth falls with the distance from the light
    near: f32,                  // m along the camera's axis, of a cascade
    far: f32,
    texel: f32,                 // m; of a light with a position, at 1 m
    depth_scale: f32,           // m of depth 1; near of a light with a position
}

struct Light {
    intensity: vec3f,           // lux of a directional light, else candela
    range: f32,                 // m, 0: none
    position: vec3f,            // m; of a directional light the unit vector towards it
    cone_scale: f32,            // see cone_ramp
    axis: vec3f,                // unit: a spot shines along it
    cone_offset: f32,
    lobes: vec3f,               // of the phase function: g, g of the second lobe, its share
    cone_cosine: f32,           // of a spot's outer half angle
    views: u32,
    side: f32,                  // of the shadow map, texels
    bias: f32,                  // m
    disc_tangent: f32,          // tangent of a directional light's angular radius
    blend: f32,                 // the last part of a cascade, over which it passes into the next
    steps: u32,                 // along a ray, 0: exact
    begin: vec2u,               // pixel at which a pass begins
    climb: f32,                 // sine of a directional light's height above the horizon
    shade_faces: u32,           // 1, or those of a cube; of a table of what dims it, see shade.wgsl
    shade_count: vec3u,         // of its columns across, and of values along each
    shade_near: f32,            // m from a light with a position to the first values
    shade_step: f32,            // m from value to value along a column of a light with a position
    shade_tangent: f32,         // of the half angle that a face holds
    shade_cell: f32,            // m of a cell of a directional light's; else radians
    shade_pieces: u32,          // in which density is summed from value to value
    shade_stride: u32,          // values from a column to the next
    shade_rows: array<vec4f, 3>, // from a place to an index of the table; of a light with a position to its axes, m
    shade_into: array<vec4f, 3>, // back
    glass_side: f32,            // of the map of what dims it, texels; see glass.wgsl
    plane_count: u32,           // that bound it
    shape_most: f32,            // texels of its cookie on a metre, a metre ahead; see shape.wgsl
    shape_last: u32,            // level of that
    shape_size: vec2f,          // texels
    falloff: vec3f,             // with the distance d: of 1 / d^2, 1 / d, 1
    shape_rows: array<vec4f, 3>, // from a place to one in the shape, see shape_index
    planes: array<vec4f, 12>,   // n x + d >= 0 where there is light
    view: array<ShadowView, 6>,
}
