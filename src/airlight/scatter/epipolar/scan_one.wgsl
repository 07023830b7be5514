// One line an invocation: as many threads as there are lines, for GPUs.
alias Rgb = vec3f;
const WIDTH = 32u;

/// Samples the source on the lines of an invocation.
fn sample_lines(position: vec4f, line: u32, stride: u32) -> Rgb {
    return sample_source(position, line, stride);
}

/// Starts the lines of an invocation from the nearer zone.
fn inherit_lines(bundle: Bundle, line: u32, k: u32) -> Rgb {
    return inherited(bundle, line, k);
}

/// Stores S of the lines of an invocation at a node.
fn store_sums(column: u32, row: u32, gain: vec3f, sum: Rgb) {
    store_sum(column, row, gain, sum);
}

/// Leaves a moment of the lines of an invocation to the farther zone.
fn store_states(bundle: Bundle, line: u32, k: u32, value: Rgb) {
    store_state(bundle, line, k, value);
}

//! include "scatter/epipolar/scan.wgsl"
