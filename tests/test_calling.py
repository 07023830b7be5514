"""`call` itself, and the dtypes that are made from WGSL: what they are checked with is written out here."""

import re
from pathlib import Path

import numpy as np
import pytest
from calling import call
from wgsl import functions, impure

import airlight
from airlight.gpu.structs import dtype_of, struct_dtype

PACKAGE = Path(airlight.__file__).parent
RNG = np.random.default_rng(3)


def test_layout() -> None:
    """The examples of the WGSL specification, 14.4.4: a struct whose members need padding between and behind them."""
    code = """
    struct A { u: f32, v: f32, w: vec2f, x: f32 }
    struct B { a: vec2f, b: vec3f, c: f32, d: f32, e: A, f: vec3f, g: array<A, 3>, h: i32 } // of 160 bytes
    const MANY = 5u;
    struct C { m: mat3x3f, n: mat4x4<f32>, few: array<vec4f, MANY>, all: array<vec2<u32>, 2>, }
    """
    a, b, c = (dtype_of(code, name) for name in "ABC")
    assert [a.fields[n][1] for n in a.names] == [0, 4, 8, 16] and a.itemsize == 24
    assert [b.fields[n][1] for n in b.names] == [0, 16, 28, 32, 40, 64, 80, 152] and b.itemsize == 160
    assert b["g"].shape == (3,) and b["b"].shape == (3,)
    assert [c.fields[n][1] for n in c.names] == [0, 48, 112, 192] and c["m"].shape == (3, 4) and c["few"].shape == (5, 4)
    assert c["all"].shape == (2, 2) and c["all"].base == np.dtype("u4") and c.itemsize == 208
    assert struct_dtype("scatter/multipass/multipass.wgsl", "Taps")["taps"].shape == (8, 4)
    with pytest.raises(KeyError):
        dtype_of(code, "D")


def test_no_record_of_a_shader_is_written_by_hand() -> None:
    """np.dtype([...]) of four-byte fields appears nowhere: struct_dtype makes such dtypes from the shaders."""
    found = {str(p.relative_to(PACKAGE)) for p in PACKAGE.rglob("*.py") if re.search(r'np\.dtype\(\s*\[\s*\("', p.read_text("utf-8"))}
    assert found == set()


def test_call() -> None:
    """Vectors, scalars broadcast, and a record: as NumPy says."""
    x = RNG.random((7, 3)).astype(np.float32)
    assert np.abs(call("wgsl/half.wgsl", "nearest_half", [x]) - x).max() < 2**-12
    rays = np.zeros((), struct_dtype("look/rays.wgsl", "Rays"))
    rays["light"], rays["span"], rays["box"] = (0.5, 0.25), 6.2831853, (2, 1)
    points = RNG.random((4, 5, 2))
    found = call("look/rays.wgsl", "polar", [points, rays])
    assert found.shape == (4, 5, 2)
    np.testing.assert_allclose(found[..., 0], np.hypot(points[..., 0] - 0.5, points[..., 1] - 0.25), rtol=1e-6)
    rays["light"] = (-0.5, 0.25)
    enters = call("look/rays.wgsl", "entry_distance", [np.array([[1.0, 0.0], [0.8, 0.6]]), rays], constants={"INSIDE": 0})
    np.testing.assert_allclose(enters, [0.5, 0.625], rtol=1e-6)


def test_call_of_what_reads_uniforms_and_gives_bool() -> None:
    rays = np.zeros((), struct_dtype("look/rays.wgsl", "Rays"))
    rays["box"] = (0.8, 0.6)
    points = RNG.random((50, 2))
    assert np.array_equal(call("look/bands.wgsl", "is_within", [points], bindings={"rays": rays}), (points <= rays["box"]).all(axis=1))


def test_which_functions_are_pure() -> None:
    code = """
    @group(0) @binding(0) var<storage, read> frame: Frame;
    @group(0) @binding(1) var picture: texture_2d<f32>;
    @group(0) @binding(2) var<storage, read_write> sums: array<f32>;
    var<private> count: u32;
    fn scaled(x: f32) -> f32 { return x * frame.scale; } // sums
    /// Read it.
    fn at(p: vec2u) -> vec4f { return textureLoad(picture, p, 0); }
    fn twice(p: vec2u) -> vec4f { return 2.0 * at(p); }
    fn store(x: f32) { sums[0] = x; }
    fn keep(x: f32) { count += 1u; }
    fn of(a: array<vec3f, 4>, f: vec2<f32>) -> f32 { let count = 1.0; let at = f.at; return at + a[0].sums + count; }
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3u) { store(1.0); }
    """.replace("\n    ", "\n")
    assert impure(code) == {"at", "twice", "store", "keep", "main"}
    found = {f.name: f for f in functions(code)}
    assert list(found) == ["scaled", "at", "twice", "store", "keep", "of", "main"]
    assert found["at"].about == "Read it." and found["main"].is_entry and not found["at"].is_entry
    assert found["of"].parameters == (("a", "array<vec3f,4>"), ("f", "vec2<f32>")) and found["of"].returns == "f32"
