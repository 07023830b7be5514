"""Lights that move: aimed anew without allocation, with the layer of a plan made for the place."""

import numpy as np
import pytest

from airlight.gpu.device import Device, open_device
from airlight.lights import Light
from airlight.options import Parameters
from airlight.scatter.render import LightPasses, plan

SIZE = (400, 240)
PLACES = [(0.5, 0.4), (0.52, 0.41), (0.9, 0.1), (0.999, 0.5), (1.3, 0.4), (1.5, -2.0), (-40.0, 3.0), (0.01, 0.02), (0.3, 0.6)]


@pytest.fixture(scope="module")
def device() -> Device:
    return open_device()


@pytest.fixture(scope="module")
def source(device: Device) -> object:
    random = np.random.default_rng(4)
    image = np.kron((random.random((24, 40, 4)) > 0.7) * random.random((24, 40, 4)) * 3, np.ones((10, 10, 1))).astype(np.float16)
    texture = device.texture(*SIZE, "rgba16float")
    device.write(texture, image, SIZE[0] * 8)
    return texture


def carried_out(device: Device, record: object, layer: object) -> np.ndarray:
    encoder = device.encoder()
    record(encoder)  # type: ignore[operator]
    device.submit(encoder)
    return np.frombuffer(device.read(layer, 8), np.float16).reshape(SIZE[1], SIZE[0], 4)[..., :3].astype(np.float32)


@pytest.mark.parametrize("method", ["epipolar", "radial", "bands", "multipass", "additive"])
@pytest.mark.parametrize("number", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
def test_a_moved_light_is_as_a_new_one(device: Device, source: object, method: str, number: int) -> None:
    p = Parameters(method=method, samples=40, density=0.9)
    layer, fresh = (device.texture(*SIZE, "rgba16float") for _ in range(2))
    moving = LightPasses(device, SIZE, p, source, layer)
    for i in range(len(PLACES)):
        lights = [Light(PLACES[(i + 3 * k) % len(PLACES)], (1, 0.5 + 0.5 * k, 0.2), 1.0 + 0.1 * i) for k in range(number)]
        moving.update(lights)
        moved = carried_out(device, moving.record, layer)
        plans, _ = plan(device, SIZE, lights, p, source, fresh)
        expected = carried_out(device, lambda encoder, plans=plans: [step.record(encoder) for step in plans], fresh)
        assert expected.max() > 0.05
        # a larger texture of the sums rounds its coordinates otherwise
        np.testing.assert_allclose(moved, expected, rtol=2e-3, atol=2e-3 * expected.max())


@pytest.mark.parametrize("method", ["epipolar", "radial", "bands", "multipass", "additive"])
def test_nothing_is_made_anew_where_lights_have_been(device: Device, source: object, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    layer = device.texture(*SIZE, "rgba16float")
    moving = LightPasses(device, SIZE, Parameters(method=method, samples=40, density=0.9), source, layer)
    laps = [[Light(a), Light(b)] for a, b in zip(PLACES, PLACES[::-1], strict=True)]
    device.wait()  # which keeps a buffer for all that wait
    for lights in laps * 2:
        moving.update(lights)
    for name in ("texture", "buffer", "bind"):
        monkeypatch.setattr(Device, name, lambda *_, name=name, **__: pytest.fail(f"{name} is called for a light that moves"))
    monkeypatch.setattr(
        device.device, "create_compute_pipeline", lambda **_: pytest.fail("a shader is compiled for a light that moves"), raising=False
    )
    for lights in laps:
        moving.update([Light(light.position, (0.5, 1, 1)) for light in lights])
        assert carried_out(device, moving.record, layer).max() > 0


def test_without_lights_the_layer_is_black(device: Device, source: object) -> None:
    layer = device.texture(*SIZE, "rgba16float")
    moving = LightPasses(device, SIZE, Parameters(), source, layer)
    moving.update([Light((0.5, 0.5))])
    assert carried_out(device, moving.record, layer).max() > 0
    moving.update([])
    assert carried_out(device, moving.record, layer).max() == 0
