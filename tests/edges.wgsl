// Draws a row of pixels from an edge on that differs from row to row: by 1 / FINENESS of a pixel, about the middle of the pixel in column 8.
const WIDTH = 16.0;
const ROWS = 1024.0;
const FINENESS = 4096.0;

@vertex
fn row(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    let top = f32(i / 6u);
    let corner = (vec3u(0u, 1u, 2u) + vec3u((i / 3u) % 2u))[i % 3u]; // of two triangles: 0 1 2, 1 2 3
    let edge = 8.5 + (top - 0.5 * ROWS) / FINENESS;
    let x = select(edge, WIDTH, (corner & 1u) == 1u);
    let y = top + f32(corner >> 1u);
    return vec4f(2.0 * x / WIDTH - 1.0, 1.0 - 2.0 * y / ROWS, 0.0, 1.0);
}

@fragment
fn white() -> @location(0) vec4f {
    return vec4f(1.0);
}
