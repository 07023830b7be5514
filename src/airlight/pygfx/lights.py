"""Describes what casts shafts in a scene."""

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
import pygfx as gfx

from airlight.errors import AirlightError
from airlight.files.photometry import read_photometry
from airlight.lights import ImageLight
from airlight.lights.numbers import are_finite, is_finite
from airlight.lights.shape import Cookie

BODY = 1.05  # of a body's radius: how far from its centre a pixel may lie


@dataclass
class SceneLight:
    """Describes a light of a scene: one of target, position and direction says where it is.

    target: an object whose world position it follows; a gfx.DirectionalLight gives its direction. position: fixed, world
    coordinates. direction: towards the light, for a sun. color: linear RGB factors >= 0; strength: factor >= 0; both of the shafts.
    emitter: a target that is a mesh is bright itself, and hides nothing.

    Methods of the screen take its light from the picture. screen_tint: linear RGB factors >= 0 of what they make of it, for lights of
    unlike intensity; disc_half_angle: degrees, 0 to 90, of a disc of radiance 1 that is drawn into the source where nothing hides it, for
    a sun without a mesh; 0: none. Methods that light a medium take the intensity of the gfx lights that are the target, or below it; of a
    position or direction alone, color and strength are that: candela, or lux. intensity: candela, or lux, in their stead, times
    strength. anisotropy: -0.99 to 0.99, instead of the medium's. density, extinction: factors, 0 to 1e6, of the medium's density and
    extinction as this light alone has them: artistic, since the air is not twice where two lights shine.

    cookie: a picture that a spot, a projector or a sun sends out. photometry: how strong a point or spot light is in which direction: the
    path of an .ies or .ldt file, or a Photometry; its peak is the intensity. A light has one of them. turned: (3, 3) the axes of its shape,
    rows right, up and ahead, in those of the gfx light, or the world's where there is none; None: ahead is where the light shines, of a
    point down, and up is the world's, or -Z where it shines up or down.
    """

    target: Any = None
    position: tuple[float, float, float] | None = None
    direction: tuple[float, float, float] | None = None
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    strength: float = 1.0
    disc_half_angle: float = 0.0
    emitter: bool = True
    screen_tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    anisotropy: float | None = None
    intensity: float | None = None
    cookie: Cookie | None = None
    density: float = 1.0
    extinction: float = 1.0
    photometry: Any = None
    turned: Any = None
    _measured: Any = field(default=None, init=False, repr=False, compare=False)
    _body: Any = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        self.check()

    def check(self) -> None:
        """Raise AirlightError for what a light cannot be; fields may be set at any time."""
        given = [name for name in ("target", "position", "direction") if getattr(self, name) is not None]
        if len(given) != 1:
            raise AirlightError(f"a SceneLight takes one of target, position and direction, not {' and '.join(given) or 'none'}")
        if self.target is not None and not isinstance(self.target, gfx.WorldObject):
            raise AirlightError(f"a SceneLight's target is an object of the scene, not {type(self.target).__name__}")
        for name in ("position", "direction"):
            value = getattr(self, name)
            if value is not None and not are_finite(value, 3):
                raise AirlightError(f"a SceneLight's {name} must be 3 finite numbers, not {value!r}")
        if self.direction is not None and not np.any(self.direction):
            raise AirlightError("a SceneLight's direction must not be 0, 0, 0")
        if not (is_finite(self.disc_half_angle) and 0 <= self.disc_half_angle < 90):
            raise AirlightError(f"a SceneLight's disc_half_angle must be 0 to 90 degrees, not {self.disc_half_angle!r}")
        for color in (self.color, self.screen_tint):
            ImageLight((0.5, 0.5), color, self.strength)  # raises for these
        if self.intensity is not None and not (is_finite(self.intensity) and self.intensity >= 0):
            raise AirlightError(f"a SceneLight's intensity must be 0 or more, candela or lux, not {self.intensity!r}")
        for name in ("density", "extinction"):
            if not 0 <= getattr(self, name) <= 1e6:
                raise AirlightError(f"a SceneLight's {name} must be 0 to 1e6 times the medium's, not {getattr(self, name)!r}")
        if self.photometry is not None and self.cookie is not None:
            raise AirlightError("a SceneLight takes one of cookie and photometry, not both")
        if self.photometry is not None and not (isinstance(self.photometry, str | os.PathLike) or hasattr(self.photometry, "at")):
            raise AirlightError(f"a SceneLight's photometry must be a file's path or have at(q), not {type(self.photometry).__name__}")
        if self.turned is not None and not _turns(self.turned):
            raise AirlightError("a SceneLight's turned must be unit vectors right, up and ahead at right angles, right x up = -ahead")
        if self.anisotropy is not None and not (is_finite(self.anisotropy) and abs(self.anisotropy) <= 0.99):
            raise AirlightError(f"a SceneLight's anisotropy must be -0.99 to 0.99, not {self.anisotropy!r}")

    def distribution(self) -> Any:
        """Give its photometry, read where it is a path, the same while that is the same; None where it has none. Raises AirlightError."""
        if not isinstance(self.photometry, str | os.PathLike):
            return self.photometry
        if self._measured is None or self._measured[0] != self.photometry:
            self._measured = self.photometry, read_photometry(os.fspath(self.photometry))
        return self._measured[1]

    def seen(self, position: tuple[float, float], fade: float = 1.0) -> ImageLight:
        """Makes the light that methods of the screen have, at a position in the picture. fade: a further factor."""
        r, g, b = (own * tint for own, tint in zip(self.color, self.screen_tint, strict=True))
        cookie = self.cookie if self.cookie is not None else getattr(self.target, "cookie", None)
        return ImageLight(position, (r, g, b), self.strength * fade, cookie=cookie)

    def homogeneous(self) -> npt.NDArray[np.float64]:
        """Computes (4,) homogeneous world coordinates; w = 0: the direction towards it."""
        target = self.target
        if target is None:
            return np.append(self.position, 1.0) if self.position is not None else np.append(np.asarray(self.direction, float), 0.0)
        if isinstance(target, gfx.DirectionalLight):
            return np.append(-beam(target), 0.0)
        return np.append(np.asarray(target.world.position, float), 1.0)

    def body(self) -> tuple[npt.NDArray[np.float64], float, bool] | None:
        """Finds (centre, radius, whether it writes depth) of a target that is a body of light, world coordinates; else None."""
        target = self.target
        if target is None or not self.emitter or getattr(target, "geometry", None) is None or not target.visible:
            return None
        positions = getattr(target.geometry, "positions", None)
        if positions is None or positions.data is None or not len(positions.data):
            return None
        key = positions, positions.rev
        if self._body is None or self._body[0] != key:
            points = np.asarray(positions.data, np.float64)[:, :3]
            points = points[np.isfinite(points).all(axis=1)]
            centre = (points.min(axis=0) + points.max(axis=0)) / 2 if len(points) else np.full(3, np.nan)
            self._body = key, centre, float(np.linalg.norm(points - centre, axis=1).max(initial=0))
        _, centre, radius = self._body
        if not np.isfinite(centre).all():
            return None
        matrix = np.asarray(target.world.matrix, np.float64)
        scale = float(np.linalg.norm(matrix[:3, :3], axis=0).max())
        return matrix[:3, :3] @ centre + matrix[:3, 3], radius * scale, bool(target.material.depth_write)


def beam(light: Any) -> npt.NDArray[np.float64]:
    """Finds the direction (3,), of any length, in which a gfx.DirectionalLight or gfx.SpotLight shines, as pygfx's surfaces have it: to its
    target, or to the point that is 1 ahead of a camera it hangs on; along -Z where that is its own position."""
    parent = light.parent
    ahead = (parent.world.matrix @ (0.0, 0.0, -1.0, 1.0))[:3] if isinstance(parent, gfx.Camera) else light.target.world.position
    direction = np.asarray(ahead, float) - light.world.position
    return direction if np.any(direction) else np.array((0.0, 0.0, -1.0))


def _turns(axes: Any) -> bool:
    try:
        found = np.asarray(axes, float)
    except (TypeError, ValueError):
        return False
    return found.shape == (3, 3) and np.allclose(found @ found.T, np.eye(3), atol=1e-4) and float(np.linalg.det(found)) < 0
