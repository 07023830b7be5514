// Density of a medium that varies by noise: e^(sum of a_i n_i) over its mean, so that the mean density is 1 whatever the amount.
//
// n_i is gradient noise (Perlin 2002): lattice points have gradients along the middles of a cube's edges, by a hash of their coordinates.
// Octave i has waves of size / 2^i, and a_i = amplitude / 2^i, faded out where its waves are as short as the footprint to average over.
// The mean of e^(a n) over places and gradients is known, and that of the octaves together is its product: their lattices lie a quarter of
// a cell apart, so that the even harmonics of one and the odd ones of the next, which alone could spoil it, cancel. All repeats after
// NOISE_PERIOD cells of the largest octave, so that a wind may blow for ever.

const NOISE_PERIOD = 256u;      // cells of the largest octave: PERIOD of medium/noise.py
const NOISE_APART = 0.25;       // cells of an octave, from its lattice to that of the one before
const NOISE_FAR = 1e30;         // m, the wavelength of what does not vary

struct Noise {
    offset: vec3f,              // of the places' origin in its cell of the largest octave, 0 to 1
    amplitude: f32,             // of the largest octave, in the exponent
    cell: vec3i,                // of that origin
    octaves: u32,
    frequency: f32,             // of the largest octave, 1/m
    seed: u32,
}

/// Evaluate the density at a place, m along the world's axes from the record's origin, averaged over a footprint of so many m.
/// Twin: reference/noise.py:noise_density.
fn noise_density(place: vec3f, footprint: f32, noise: Noise) -> f32 {
    let at = place * noise.frequency + noise.offset;
    var low = floor(at);
    var inside = at - low;
    var cell = noise.cell + vec3i(low);
    var exponent = 0.0;
    var amplitude = noise.amplitude;
    var waves = 1.0 / max(footprint * noise.frequency, 1e-30); // footprints in a wavelength
    var mask = NOISE_PERIOD - 1u;
    var seed = noise.seed;
    var left = noise.octaves;
    loop {
        let own = amplitude * smoothstep(2.0, 4.0, waves);
        exponent += own * gradient_noise(cell, inside, mask, seed) - log_mean_exponential(own);
        let next = 2.0 * inside + NOISE_APART;
        low = floor(next);
        inside = next - low;
        cell = 2 * cell + vec3i(low);
        amplitude *= 0.5;
        waves *= 0.5;
        mask = 2u * mask + 1u;
        seed += 0x9e3779b9u;
        left -= 1u;
        continuing { break if (left == 0u || waves <= 2.0); }
    }
    return exp(exponent);
}

/// Find the shortest wavelength, m, that noise has left over a footprint, m; NOISE_FAR where there is none.
/// Twin: reference/noise.py:noise_wavelength.
fn noise_wavelength(footprint: f32, noise: Noise) -> f32 {
    let waves = 1.0 / max(footprint * noise.frequency, 1e-30);
    let left = min(f32(noise.octaves) - 1.0, ceil(log2(waves)) - 2.0); // of the octaves, the last with more than 2 footprints in a wave
    return select(exp2(-max(left, 0.0)) / noise.frequency, NOISE_FAR, left < 0.0 || noise.amplitude == 0.0);
}

/// Evaluate gradient noise inside a cell of a lattice, at coordinates from 0 to 1. mask: the cells after which it repeats, less 1.
/// Perlin 2002. Twin: reference/noise.py:gradient_noise.
fn gradient_noise(cell: vec3i, inside: vec3f, mask: u32, seed: u32) -> f32 {
    let primes = vec3u(0x8da6b343u, 0xd8163841u, 0xcb1ab31fu);
    let low = (vec3u(cell) & vec3u(mask)) * primes;
    let high = (vec3u(cell + 1) & vec3u(mask)) * primes;
    let near = vec2u(low.x ^ seed, high.x ^ seed);
    let b = inside;
    let e = inside - 1.0;
    let fade = b * b * b * (b * (b * 6.0 - 15.0) + 10.0);
    let yz = vec4u(low.y ^ low.z, high.y ^ low.z, low.y ^ high.z, high.y ^ high.z);
    let left = vec4f(
        along_gradient(near.x ^ yz.x, b),
        along_gradient(near.x ^ yz.y, vec3f(b.x, e.y, b.z)),
        along_gradient(near.x ^ yz.z, vec3f(b.x, b.y, e.z)),
        along_gradient(near.x ^ yz.w, vec3f(b.x, e.y, e.z)),
    );
    let right = vec4f(
        along_gradient(near.y ^ yz.x, vec3f(e.x, b.y, b.z)),
        along_gradient(near.y ^ yz.y, vec3f(e.x, e.y, b.z)),
        along_gradient(near.y ^ yz.z, vec3f(e.x, b.y, e.z)),
        along_gradient(near.y ^ yz.w, e),
    );
    let across = mix(left, right, fade.x);
    let up = mix(across.xz, across.yw, fade.y);
    return mix(up.x, up.y, fade.z);
}

/// Multiply an offset from a lattice point by its gradient: one of 12 that have a 0 and two of 1 or -1, by a key of the point.
/// Twin: reference/noise.py:along_gradient.
fn along_gradient(key: u32, offset: vec3f) -> f32 {
    let hash = (key ^ (key >> 15u)) * 0x2c1b3c6du;
    let third = i32(hash << 2u); // of all numbers: x, y or z is left out
    let u = select(offset.x, offset.y, third < -715827883);
    let v = select(offset.z, offset.y, third > 715827882);
    return flipped(u, hash) + flipped(v, hash << 1u);
}

/// Turn a number's sign where a word's highest bit is set. Twin: reference/noise.py:flipped.
fn flipped(value: f32, word: u32) -> f32 {
    return bitcast<f32>(bitcast<u32>(value) ^ (word & 0x80000000u));
}

/// Evaluate the logarithm of the mean of e^(a n), n gradient noise, for a from 0 to 8: a fit to 1e-6 by
/// scripts/noise_fit.py.
/// Twin: reference/noise.py:log_mean_exponential.
fn log_mean_exponential(a: f32) -> f32 {
    let x = a * a;
    return x * (3.645906e-2 - x * (1.0170715e-4 - x * (6.788781e-7 - x * (4.975845e-9 - x * (2.929922e-11 - x * 8.961888e-14)))));
}
