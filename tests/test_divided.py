"""Scenes drawn in parts: whatever is submitted on the way, each part sees its own frame's camera, lights and maps."""

from typing import Any

import numpy as np
import pytest

gfx = pytest.importorskip("pygfx")

from airlight.gpu.device import shared_device  # noqa: E402
from airlight.gpu.slices import Sliced, watching  # noqa: E402
from airlight.gpu.timing import Timer, timing  # noqa: E402
from airlight.options import March, Parameters, SceneOptions  # noqa: E402
from airlight.pygfx import LightShafts, SceneLight, divided, use_hdr  # noqa: E402
from airlight.pygfx.divided import DividedRenderer  # noqa: E402
from airlight.scatter.radial import radial  # noqa: E402

SIZE = 64, 40
WAYS: dict[str, tuple[Parameters, SceneOptions]] = {
    **{
        f"{method} {occluders}": (Parameters(method=method), SceneOptions(occluders=occluders, view_transform="none"))  # type: ignore[arg-type]
        for method in ("epipolar", "radial", "bands", "multipass", "additive")
        for occluders in ("stencil", "contrast", "prepass")
    },
    "adapted": (Parameters(), SceneOptions(depth_aware=2.0, occluders="contrast", clear="#405060")),
    "march": (Parameters(method="march"), SceneOptions(view_transform="none")),
    "march steps": (Parameters(method="march"), SceneOptions(view_transform="none", resolution=0.5)),
    "article": (Parameters(method="article"), SceneOptions(view_transform="none")),
}


class Room:
    """A slab before a lamp, two suns' discs, and a floor; with a renderer whose work may be divided."""

    def __init__(self, way: str) -> None:
        self.scene, self.camera = gfx.Scene(), gfx.PerspectiveCamera(60, SIZE[0] / SIZE[1], depth_range=(0.1, 60))
        slab, floor = (gfx.Mesh(gfx.box_geometry(*size), gfx.MeshStandardMaterial(color="#864")) for size in ((1, 1.4, 0.3), (9, 0.2, 9)))
        floor.local.y = -1.5
        self.lamp = gfx.Mesh(gfx.sphere_geometry(0.5), gfx.MeshBasicMaterial(color=gfx.Color.from_physical(5, 4, 2)))
        self.sun = gfx.DirectionalLight(intensity=3, cast_shadow=True)
        glow = gfx.PointLight(intensity=30, decay=2)
        self.scene.add(gfx.Background.from_color("#445566"), slab, floor, self.lamp.add(glow), self.sun)
        self.lights = [SceneLight(self.lamp), SceneLight(self.sun, disc_half_angle=3.0)]
        self.renderer = DividedRenderer(gfx.Texture(dim=2, size=(*SIZE, 1), format="rgba8unorm"), pixel_scale=1, ppaa="none")
        use_hdr(self.renderer)
        parameters, in_scene = WAYS[way]
        lights = self.lights[1:] if parameters.method == "article" else self.lights  # which takes one sun
        march = March(steps=16 if "steps" in way else "exact", shadow_size=64)
        self.shafts = LightShafts(self.renderer, self.scene, self.camera, lights, parameters, in_scene=in_scene, march=march)
        self.shafts.doubts = False
        self.renderer.effect_passes = [self.shafts]

    def move(self, number: int) -> None:
        """Let camera and lights be where they are at the n-th picture."""
        self.camera.local.position = (0.9 * number, 0.3, 5 - number)
        self.camera.look_at((0, 0, 0))
        self.lamp.local.position = (0.7 - 0.8 * number, 0.5, -2.0)
        self.sun.local.position = (1 - 2 * number, 3, -6)
        self.lights[0].color = (1.0, 1.0 - 0.4 * number, 1.0)

    def picture(self) -> np.ndarray:
        self.renderer.render(self.scene, self.camera)
        return np.asarray(self.renderer.snapshot())


@pytest.fixture(autouse=True)
def _small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Sliced, "part", 0.0)


def in_slices(draw: Any) -> int:
    """Carry work out, as little at a time as can be: in so many slices."""
    work, count = Sliced(draw), 1
    while not work.go_on(0.0):
        count += 1
    return count


@pytest.mark.parametrize("way", WAYS)
def test_a_picture_in_parts_is_of_its_own_frame(way: str) -> None:
    """After another frame, whose camera and lights nothing may see any more; and one that is dropped on the way."""
    whole, parted = Room(way), Room(way)
    whole.move(1)
    found: list[np.ndarray] = []
    parted.move(0)
    assert in_slices(lambda: found.append(parted.picture())) > 4
    parted.move(2)
    dropped = Sliced(parted.picture)  # type: ignore[arg-type]
    for _ in range(5):
        dropped.go_on(0.0)
    dropped.drop()
    parted.move(1)
    in_slices(lambda: found.append(parted.picture()))
    expected = whole.picture()
    assert np.array_equal(found[1], expected) and not np.array_equal(found[0], expected)


@pytest.mark.parametrize("way", ["radial contrast", "radial prepass", "additive stencil", "march"])
def test_a_long_sum_that_is_waited_for_is_of_its_own_frame(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without slices too a long sum is submitted part by part, lest nothing answers an interrupt."""
    whole, parted = Room(way), Room(way)
    whole.move(1)
    expected = whole.picture()
    monkeypatch.setattr(radial, "TAPS_A_DISPATCH", 1)
    for number in (0, 1):
        parted.move(number)
        found = parted.picture()
    assert np.array_equal(found, expected)


@pytest.mark.parametrize("way", ["epipolar stencil", "radial prepass", "march"])
def test_a_picture_in_bands_that_are_told_is_the_same(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, parted = Room(way), Room(way)
    shares: list[float] = []
    monkeypatch.setattr(divided, "BAND_PIXELS", SIZE[0] * SIZE[1] // 7)
    monkeypatch.setattr(divided, "VERTEX_PIXELS", 0)
    for room in (whole, parted):
        room.scene.add(gfx.Points(gfx.Geometry(positions=[(0, 0, 1), (1, 1, 1)]), gfx.PointsMaterial(size=9, alpha_mode="blend")))
        room.move(1)
    with watching(shares.append, drawing=True):
        found = parted.picture()
    drawn = shares[: shares.index(1.0) + 1]
    assert drawn == sorted(drawn) and len(drawn) == 7 and np.array_equal(found, whole.picture())
    assert np.array_equal(parted.picture(), found)


def test_all_parts_of_a_frame_have_their_times() -> None:
    """A march of some seconds has hundreds of parts in slices, and the passes after it are told too."""
    device = shared_device()
    timer, encoder = Timer(device), device.encoder()
    labels = [*["march"] * 300, "merge"]
    for label in labels:
        encoder.begin_compute_pass(**timing(timer, label, encoder)).end()
    timer.resolve(encoder)
    device.submit(encoder)
    if device.timestamps:
        assert [label for label, ms in timer.milliseconds() if ms >= 0] == labels


def test_bands_are_of_large_pictures_of_few_vertices() -> None:
    assert divided.bands(720, 1280 * 720, 1000) == [(0, 720)]  # a quick one costs what it did
    found = divided.bands(2160, 3840 * 2160, 1000)
    assert sorted(row for first, count in found for row in range(first, first + count)) == list(range(2160)) and len(found) == 7
    assert len(divided.bands(20000, 2**27, 100)) == divided.MOST_BANDS
    assert len(divided.bands(20000, 2**27, 2**21)) == 6
    assert divided.bands(2160, 3840 * 2160, 10**7) == [(0, 2160)]
    assert divided.bands(3, 2**27, 100) == [(0, 1), (2, 1), (1, 1)] and divided.bands(9, 0, 100) == [(0, 9)]
