"""Shadow maps that are kept while what casts stands still: drawn anew when it does not, whatever is declared, and else left as they are."""

import functools
import gc
import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

gfx = pytest.importorskip("pygfx")

from airlight.gpu.device import shared_device  # noqa: E402
from airlight.medium.resolve import resolve  # noqa: E402
from airlight.options import March, Medium, Parameters, SceneOptions  # noqa: E402
from airlight.pygfx import LightShafts, SceneLight  # noqa: E402
from airlight.pygfx.casters import Casters  # noqa: E402
from airlight.pygfx.punctual import punctual_lights  # noqa: E402
from airlight.scenes.offline import Shot, make_renderer  # noqa: E402

PLAIN = SceneOptions(view_transform="none")


def box(x: float, *size: float) -> Any:
    mesh = gfx.Mesh(gfx.box_geometry(*size), gfx.MeshStandardMaterial(color="#999", alpha_mode="solid"))
    mesh.local.position, mesh.cast_shadow, mesh.receive_shadow = (x, 0, 0), True, True
    return mesh


@functools.cache
def _renderer(other: bool) -> Any:
    return make_renderer(Shot(64, 40, samples=1))


class Hall:
    """Boxes under a sun and beside two lamps, all of whose maps are kept by what is in `still`."""

    def __init__(self, still: Any = (), other: bool = False) -> None:
        """still: as of LightShafts; other: by another renderer."""
        self.scene, self.camera = gfx.Scene(), gfx.PerspectiveCamera(60, 1.6, depth_range=(0.1, 30))
        self.camera.local.position = (0, 1, 6)
        self.post, self.cube, self.hidden = box(-1, 0.4, 2, 0.4), box(1, 0.8, 0.8, 0.8), box(0, 0.3, 1.5, 0.3)
        self.hidden.visible = False
        self.floor = box(0, 8, 0.2, 8)
        self.floor.local.y = -1.2
        self.sun, self.lamp = gfx.DirectionalLight(intensity=3, cast_shadow=True), gfx.PointLight(intensity=9, decay=2)
        self.spot = gfx.SpotLight(intensity=30, decay=2, angle=0.8)
        self.sun.local.position, self.lamp.local.position, self.spot.local.position = (2, 5, 3), (0, 1.5, -1), (-3, 2, 1)
        self.scene.add(self.post, self.cube, self.hidden, self.floor, self.sun, self.lamp, self.spot)
        self.renderer = _renderer(other)
        self.shafts = LightShafts(
            self.renderer,
            self.scene,
            self.camera,
            [SceneLight(self.sun), SceneLight(self.lamp), SceneLight(self.spot)],
            Parameters(method="march"),
            in_scene=PLAIN,
            medium=Medium(max_distance=15.0, sigma_t=(0.03, 0.03, 0.03)),
            march=March(shadow_size=64, steps=16, cascades=2),
        )
        self.shafts.doubts, self.shafts.still = False, still
        self.renderer.effect_passes = [self.shafts]

    def picture(self) -> np.ndarray:
        self.renderer.render(self.shafts.scene, self.camera)
        return np.asarray(self.renderer.snapshot())


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The side of each layer that is drawn."""
    sizes: list[int] = []
    draw = Casters.draw_layer

    def counted(self: Casters, clip: Any, size: int, *rest: Any) -> None:
        sizes.append(size)
        draw(self, clip, size, *rest)

    monkeypatch.setattr(Casters, "draw_layer", counted)
    return sizes


SUN, LAMP, SPOT, SURFACE = 2, 6, 1, 1  # layers of the maps: cascades, faces, one; and of the map for surfaces


def _move_a_box(hall: Hall) -> None:
    hall.cube.local.position = (1.2, 0.3, 0.1)


def _turn_a_box(hall: Hall) -> None:
    hall.post.local.euler = (0, 0, 0.5)


def _show(hall: Hall) -> None:
    hall.hidden.visible = True


def _hide(hall: Hall) -> None:
    hall.post.visible = False


def _exclude(hall: Hall) -> None:
    hall.shafts.exclude = [hall.cube]


def _see_through(hall: Hall) -> None:
    hall.cube.material = gfx.MeshStandardMaterial(color="#999", opacity=0.5)


def _grow(hall: Hall) -> None:
    hall.cube.geometry = gfx.box_geometry(0.8, 1.2, 0.8)


def _morph(hall: Hall) -> None:
    positions = hall.cube.geometry.positions
    positions.data[:, 1] *= 1.5
    positions.update_full()


def _other_stage(hall: Hall) -> None:
    hall.scene.remove(hall.post, hall.cube)
    other = gfx.Scene().add(box(0.5, 1, 1, 1), hall.floor, hall.sun, hall.lamp, hall.spot)
    hall.shafts.scene = other


def _move_the_lamp(hall: Hall) -> None:
    hall.lamp.local.position = (0.5, 1.8, -0.8)


def _turn_the_sun(hall: Hall) -> None:
    hall.sun.local.position = (-2, 5, 3)


def _aim_the_spot(hall: Hall) -> None:
    hall.spot.target.local.position = (1, 0, 0)


def _move_the_camera(hall: Hall) -> None:
    hall.camera.local.position = (1.5, 1, 4)


def _declare(hall: Hall) -> None:
    hall.shafts.still = "moved"


def _nothing(hall: Hall) -> None:
    pass


def _light(hall: Hall) -> None:
    hall.sun.intensity, hall.lamp.color, hall.shafts.lights[2].strength = 5.0, "#f80", 0.5


def _thicken(hall: Hall) -> None:
    hall.shafts.medium, hall.cube.material.color = Medium(max_distance=15.0, sigma_t=(0.1, 0.1, 0.1)), "#f00"


ALL = SUN + LAMP + SPOT + SURFACE
CHANGES: list[tuple[Callable[[Hall], None], int, int]] = [  # and how many layers are drawn for it, at least and at most
    (_move_a_box, SUN + SURFACE + 1, ALL),
    (_turn_a_box, SUN + SURFACE + 1, ALL),
    (_show, SUN + SURFACE + 1, ALL),
    (_hide, SUN + SURFACE + 1, ALL),
    (_exclude, SUN + 1, ALL - SURFACE),  # surfaces go by cast_shadow
    (_see_through, SUN + SURFACE + 1, ALL),
    (_grow, SUN + SURFACE + 1, ALL),
    (_morph, SUN + SURFACE + 1, ALL),
    (_other_stage, ALL - 3, ALL),
    (_move_the_lamp, LAMP, LAMP),
    (_turn_the_sun, SUN + SURFACE, SUN + SURFACE),
    (_aim_the_spot, SPOT, SPOT),
    (_move_the_camera, 1, SUN),  # whose cascades lie in the view, and hold all that casts at most
    (_declare, ALL, ALL),
    (_nothing, 0, 0),
    (_light, 0, 0),
    (_thicken, 0, 0),
]


@pytest.mark.parametrize(("change", "least", "most"), CHANGES, ids=[change.__name__[1:] for change, _, _ in CHANGES])
def test_maps_are_kept_until_something_moves(change: Callable[[Hall], None], least: int, most: int, drawn: list[int]) -> None:
    hall, anew = Hall(), Hall(still=None, other=True)
    hall.picture()
    assert len(drawn) == ALL
    drawn.clear()
    before = hall.picture()
    assert not drawn  # nothing has moved
    change(hall)
    after = hall.picture()
    count = len(drawn)
    assert least <= count <= most and np.array_equal(before, after) is (change in (_nothing, _declare))
    drawn.clear()
    assert np.array_equal(hall.picture(), after) and not drawn
    change(anew)
    assert np.array_equal(after, anew.picture())


def test_what_changes_within_its_bounds_has_to_be_declared(drawn: list[int]) -> None:
    hall = Hall()
    hall.picture()
    hall.cube.material.alpha_test = 0.5  # no hole of a map, nor anything that moves
    drawn.clear()
    hall.picture()
    assert not drawn
    hall.shafts.still = "another"
    hall.picture()
    assert len(drawn) == ALL


def test_without_a_word_all_maps_are_drawn_in_each_frame(drawn: list[int]) -> None:
    hall = Hall(still=None)
    for _ in range(2):
        drawn.clear()
        hall.picture()
        assert len(drawn) == ALL


def test_maps_of_other_sizes_are_let_go(drawn: list[int]) -> None:
    """As a draft's are, which are smaller, and those of lights that are gone."""
    hall = Hall()
    casters = Casters(shared_device(), hall.scene)
    casters.still = "always"
    lamps = punctual_lights(hall.shafts.lights)

    def draw(lights: Any, size: int) -> list[Any]:
        air = resolve(hall.shafts.medium, March(shadow_size=size, cascades=2), "normal", 5.0)
        drawn.clear()
        return [
            weakref.ref(shadow.texture) for shadow in casters.draw(hall.camera.view_matrix, hall.camera.projection_matrix, lights, air)
        ]

    seen = []
    for size in (64, 32, 64):
        seen.append(draw(lamps, size))
        assert len(drawn) == SUN + LAMP + SPOT
    draw(lamps[:1], 64)
    gc.collect()
    assert not drawn and [[texture() is not None for texture in one] for one in seen] == [[False] * 3, [False] * 3, [True, False, False]]


def test_another_renderers_maps_are_not_taken_for_ones_own() -> None:
    """Two whose lights are of the same kinds share the textures of surfaces' maps."""
    first, second = Hall(), Hall(other=True)
    second.sun.local.position = (-4, 3, 2)
    expected, other = first.picture(), second.picture()
    for _ in range(2):
        assert np.array_equal(first.picture(), expected) and np.array_equal(second.picture(), other)
