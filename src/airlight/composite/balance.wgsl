// Light adaptation (13.8): average, least and greatest luminance of the picture with its shafts, followed over time, and the ramp for
// them. Twin: reference/scene.py:balance. Twin: composite/adapt.py:measure_ramp. One workgroup; nothing is read back.
//! include "wgsl/luminance.wgsl"
//! include "composite/scene.wgsl"
override STEP: u32 = 8u;        // every how many-th pixel, along both sides
const LANES = 256u;             // invocations, and bins of the histogram
const LOWEST = -17.0;           // stops: where bin 0 begins
const BINS = 8.0;               // a stop
const MIDDLE_GREY = 0.18;            // adapt.py

@group(0) @binding(0) var<storage, read> view: SceneUniforms;
@group(0) @binding(7) var<storage, read_write> balance: array<f32>; // scale, white; average, least, greatest in stops

var<workgroup> histogram: array<atomic<u32>, LANES>;

/// Finds the stops below which a share of `total` counts lies.
fn percentile(share: f32, total: f32) -> f32 {
    var below = 0.0;
    var found = 0.0;
    var done = false;
    for (var i = 0u; i < LANES; i++) {
        let here = f32(atomicLoad(&histogram[i]));
        if (!done && here > 0.0 && below + here >= share * total) {
            found = f32(i) + (share * total - below) / here;
            done = true;
        }
        below += here;
    }
    return LOWEST + found / BINS;
}

/// Moves a value of the balance towards what is measured now.
fn follow(slot: u32, now: f32) -> f32 {
    balance[slot] = mix(balance[slot], now, view.follow);
    return balance[slot];
}

/// Makes of the histogram the scale and the white of the ramp.
fn update_balance() {
    var total = 0.0;
    for (var i = 0u; i < LANES; i++) {
        total += f32(atomicLoad(&histogram[i]));
    }
    if (total == 0.0) {
        if (view.follow >= 1.0) {
            balance[0] = 1.0;
            balance[1] = 1.0;
        }
        return;
    }
    let low = percentile(0.001, total);
    let high = percentile(0.999, total);
    var sum = 0.0;
    for (var i = 0u; i < LANES; i++) {
        sum += f32(atomicLoad(&histogram[i])) * clamp(LOWEST + (f32(i) + 0.5) / BINS, low, high);
    }
    let average = follow(2u, sum / total);
    let least = follow(3u, low);
    let greatest = follow(4u, high);
    var lean = 0.0;
    if (greatest - least > 1e-6) { lean = (2.0 * average - least - greatest) / (greatest - least); }
    balance[0] = MIDDLE_GREY * pow(4.0, lean) * exp2(-average);
    balance[1] = max(balance[0] * exp2(greatest), 1.0);
}

/// Counts luminances of every STEP-th pixel along both axes, and updates the balance.
@compute @workgroup_size(LANES)
fn measure(@builtin(local_invocation_index) lane: u32) {
    let count = (vec2u(view.pixels) + STEP - 1u) / STEP;
    atomicStore(&histogram[lane], 0u); // software Vulkan leaves the first bytes of workgroup memory unzeroed
    workgroupBarrier();
    for (var i = lane; i < count.x * count.y; i += LANES) {
        let y = view.exposure * luminance(composited(vec2i(vec2u(i % count.x, i / count.x) * STEP)).rgb);
        if (y > 0.0 && y < 3e38) {
            let bin = clamp((log2(y) - LOWEST) * BINS, 0.0, f32(LANES - 1u));
            atomicAdd(&histogram[u32(bin)], 1u);
        }
    }
    workgroupBarrier();
    if (lane == 0u) { update_balance(); }
}
