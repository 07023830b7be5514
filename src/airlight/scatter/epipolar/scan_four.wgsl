// Four lines an invocation: few, wide workgroups, for adapters that run on a CPU's vector units.
alias Rgb = mat4x3f;
const WIDTH = 8u;

fn light_at(place: vec4f, line: u32, stride: u32) -> Rgb {
    return Rgb(sample(place, line, stride), sample(place, line + WIDTH, stride), sample(place, line + 2u * WIDTH, stride), sample(place, line + 3u * WIDTH, stride));
}

fn inherit(bundle: Bundle, line: u32, k: u32) -> Rgb {
    return Rgb(inherited(bundle, line, k), inherited(bundle, line + WIDTH, k), inherited(bundle, line + 2u * WIDTH, k), inherited(bundle, line + 3u * WIDTH, k));
}

fn store_all(column: u32, row: u32, gain: vec3f, sum: Rgb) {
    //! each j of 4: store(column + j * WIDTH, row, gain, sum[j]);
}

fn keep_all(bundle: Bundle, line: u32, k: u32, value: Rgb) {
    //! each j of 4: keep(bundle, line + j * WIDTH, k, value[j]);
}

//! include "scatter/epipolar/scan.wgsl"
