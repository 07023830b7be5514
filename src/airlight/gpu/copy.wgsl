// Copies an rgba16f image, one tap a pixel: the yardstick of every benchmark. Each invocation copies a strip of pixels.
override STRIP: u32 = 8u;    // pixels an invocation
override ALONG: bool = false; // strip along x (true) or y

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var target_image: texture_storage_2d<rgba16float, write>;

/// Copies strips, 8 a workgroup.
@compute @workgroup_size(8, 1)
fn copy_small(@builtin(global_invocation_id) id: vec3u) {
    copy_strip(id.xy);
}

/// Copies strips, 64 a workgroup.
@compute @workgroup_size(64, 1)
fn copy_wide(@builtin(global_invocation_id) id: vec3u) {
    copy_strip(id.xy);
}

/// Copies strips, 8 x 8 a workgroup.
@compute @workgroup_size(8, 8)
fn copy_square(@builtin(global_invocation_id) id: vec3u) {
    copy_strip(id.xy);
}

/// Copies the pixels of one strip that lie in the image.
fn copy_strip(cell: vec2u) {
    let size = textureDimensions(source);
    for (var i = 0u; i < STRIP; i++) {
        let p = select(vec2u(cell.x, cell.y * STRIP + i), vec2u(cell.x * STRIP + i, cell.y), ALONG);
        if (p.x < size.x && p.y < size.y) {
            textureStore(target_image, p, textureLoad(source, p, 0));
        }
    }
}
