// Four lines an invocation: few, wide workgroups, for adapters that run on a CPU's vector units.
alias Rgb = mat4x3f;
const WIDTH = 8u;

/// Samples the source on the lines of an invocation.
fn sample_lines(position: vec4f, line: u32, stride: u32) -> Rgb {
    return Rgb(sample_source(position, line, stride), sample_source(position, line + WIDTH, stride), sample_source(position, line + 2u * WIDTH, stride), sample_source(position, line + 3u * WIDTH, stride));
}

/// Starts the lines of an invocation from the nearer zone.
fn inherit_lines(bundle: Bundle, line: u32, k: u32) -> Rgb {
    return Rgb(inherited(bundle, line, k), inherited(bundle, line + WIDTH, k), inherited(bundle, line + 2u * WIDTH, k), inherited(bundle, line + 3u * WIDTH, k));
}

/// Stores S of the lines of an invocation at a node.
fn store_sums(column: u32, row: u32, gain: vec3f, sum: Rgb) {
    //! each j of 4: store_sum(column + j * WIDTH, row, gain, sum[j]);
}

/// Leaves a moment of the lines of an invocation to the farther zone.
fn store_states(bundle: Bundle, line: u32, k: u32, value: Rgb) {
    //! each j of 4: store_state(bundle, line + j * WIDTH, k, value[j]);
}

//! include "scatter/epipolar/scan.wgsl"
