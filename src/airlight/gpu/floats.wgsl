// Lays rows of an image out as tight RGB in single precision, as arrays in memory have them.
struct Rows {
    first: u32,  // of the image's rows
    last: u32,   // of them
    factor: f32, // of what is written
}

@group(0) @binding(0) var image: texture_2d<f32>;
@group(0) @binding(1) var<storage, read_write> floats: array<vec4f>;
@group(0) @binding(2) var<uniform> rows: Rows;

/// Writes four pixels that follow each other, from row to row; after the last, some of its row again.
@compute @workgroup_size(64)
fn lay_out(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= arrayLength(&floats) / 3u) { return; }
    let a = pixel(4u * id.x);
    let b = pixel(4u * id.x + 1u);
    let c = pixel(4u * id.x + 2u);
    let d = pixel(4u * id.x + 3u);
    floats[3u * id.x] = vec4f(a, b.r);
    floats[3u * id.x + 1u] = vec4f(b.gb, c.rg);
    floats[3u * id.x + 2u] = vec4f(c.b, d);
}

/// Reads a pixel of the rows, counted along them.
fn pixel(number: u32) -> vec3f {
    let width = textureDimensions(image).x;
    return textureLoad(image, vec2u(number % width, min(rows.first + number / width, rows.last)), 0).rgb * rows.factor;
}
