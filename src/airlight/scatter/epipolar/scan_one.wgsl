// One line an invocation: as many threads as there are lines, for GPUs.
alias Rgb = vec3f;
const WIDTH = 32u;

fn light_at(place: vec4f, line: u32, stride: u32) -> Rgb {
    return sample(place, line, stride);
}

fn inherit(bundle: Bundle, line: u32, k: u32) -> Rgb {
    return inherited(bundle, line, k);
}

fn store_all(column: u32, row: u32, gain: vec3f, sum: Rgb) {
    store(column, row, gain, sum);
}

fn keep_all(bundle: Bundle, line: u32, k: u32, value: Rgb) {
    keep(bundle, line, k, value);
}

//! include "scatter/epipolar/scan.wgsl"
