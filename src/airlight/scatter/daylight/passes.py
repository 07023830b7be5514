"""Puts daylight on pictures: plans and records the pass that reads the table of view rays."""

from typing import Any, Literal

import numpy as np

from airlight.daylight.hoffman_preetham import BETA_MIE, BETA_RAYLEIGH
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, divide, timing
from airlight.projection import depth_terms, eye_rays
from airlight.reference.daylight import SUN_ANGULAR_RADIUS
from airlight.reference.daylight_view import drawn_disc
from airlight.scatter.daylight.table import ViewTable

Depth = Literal["buffer", "ray", "axis"]
Sky = Literal["keep", "replace", "air"]
BUFFER, METRES = "scatter/daylight/compose_depth.wgsl", "scatter/daylight/compose_metres.wgsl"
IN_METRES = {"ray": 1, "axis": 2}
SKIES = {"keep": 0, "replace": 1, "air": 2}
COMPOSE = struct_dtype(BUFFER, "Compose")
SUN_SOLID_ANGLE = float(2 * np.pi * (1 - np.cos(np.radians(SUN_ANGULAR_RADIUS))))  # sr


class DaylightPass:
    """Puts daylight on pictures of one size: L = L0 T + (1 - D) L1 + Lms.

    depth: what distances come in: "buffer", of a camera, depth32float, 1 where nothing is; "ray", metres along rays, or "axis", metres
    along the view's axis, r32float, infinite where nothing is. sky: what stands behind the air where nothing is: "keep" the picture's own
    sky, that has its daylight, and only misses light where D is more than 0; "replace" it by space with the sun's disc, and ground; "air":
    put air before it. even_air: Eq. 1 of GPU Gems 3 instead of the table, whose sky is as far as air of 8 km reaches that is everywhere as
    dense as below. attenuate: what D takes, the "source" or "all", Eq. 2 as printed.

    picture: rgba16float; radiance, transmittance: rgba32float, what is added to the picture times what is let through.
    """

    def __init__(
        self, device: Device, size: tuple[int, int], depth: Depth = "buffer", sky: Sky = "replace", even_air: bool = False,
        attenuate: str = "source",
    ) -> None:  # fmt: skip
        self.device, self.size = device, size
        self._file = METRES if depth in IN_METRES else BUFFER
        self._constants: dict[str, float] = {"SKY": SKIES[sky], "EVEN_AIR": even_air, "ALL": attenuate == "all"}
        if depth in IN_METRES:
            self._constants["IN_METRES"] = IN_METRES[depth]
        self._record = device.buffer(size=COMPOSE.itemsize, uniform=True)
        self._daylight: Any = None
        self._table: ViewTable | None = None
        self._made: dict[str, Any] = {}
        self._bound: tuple[tuple[Any, ...], Any] | None = None  # resources, and their bind group

    def _texture(self, name: str, format: str) -> Any:
        if name not in self._made:
            self._made[name] = self.device.texture(*self.size, format)
        return self._made[name]

    @property
    def picture(self) -> Any:
        return self._texture("picture", "rgba16float")

    @property
    def radiance(self) -> Any:
        return self._texture("radiance", "rgba32float")

    @property
    def transmittance(self) -> Any:
        return self._texture("transmittance", "rgba32float")

    def update(
        self, table: ViewTable, view: Any, projection: Any, to_sun: Any, up: Any = (0, 1, 0), irradiance: Any = 1.0, disc: bool = True,
        ground: Any = 0.0, beta_rayleigh: Any = BETA_RAYLEIGH, beta_mie: Any = BETA_MIE, g: float = 0.8, phase: str = "hp",
    ) -> None:  # fmt: skip
        """Write what the next picture sees.

        view: (4, 4) world to view space; projection: (4, 4); to_sun, up: unit vectors in the world, of to_sun only the azimuth counts;
        irradiance: of the sun above the air, in even air at the eye, one number or red, green, blue; disc: show the sun's; ground: radiance
        of the ground below a sky that is replaced. In even air: beta_rayleigh, beta_mie, 1/m; g, phase: "hp" or "hg", of the aerosol.
        """
        turn = np.asarray(view, float)[:3, :3]
        turn = turn / np.linalg.norm(turn, axis=1, keepdims=True)
        record = table.record(turn @ np.asarray(to_sun, float), turn @ np.asarray(up, float), irradiance)
        out = np.zeros((), COMPOSE)
        out["rays"], out["flat_rays"] = eye_rays(projection)
        out["depth"] = depth_terms(projection)
        out["ground"] = np.broadcast_to(ground, (3,))
        out["edge"] = 0.5 * abs(out["rays"][0]) / self.size[0]
        out["disc_radius"], share = drawn_disc(float(out["edge"]))
        out["disc"] = share * np.broadcast_to(irradiance, (3,)) / SUN_SOLID_ANGLE if disc else 0
        out["rayleigh"], out["mie"], out["g"], out["printed"] = beta_rayleigh, beta_mie, g, phase == "hp"
        out["irradiance"] = np.broadcast_to(irradiance, (3,))
        self.device.queue.write_buffer(self._record, 0, out.tobytes())
        if self._daylight is None:
            self._daylight = self.device.buffer(size=record.nbytes, uniform=True)
        self.device.queue.write_buffer(self._daylight, 0, record.tobytes())
        self._table = table

    def record(self, encoder: Any, depth: Any, source: Any, shadow: Any = None, parts: bool = False, timer: Timer | None = None) -> None:
        """Record the pass: into picture, or with parts into radiance and transmittance.

        depth, source: textures of this size; shadow: D, 0..1, rgb.
        """
        if self._table is None:
            raise ValueError("update comes first")
        targets = (self.radiance, self.transmittance) if parts else (self.picture,)
        formats = "+".join(texture.format for texture in targets)
        constants = {"SHADOWED": shadow is not None, **self._constants}
        pipeline = self.device.raster(self._file, "cover_rays", "parts" if parts else "compose", formats, **constants)
        given = depth, source, source if shadow is None else shadow, self._daylight, *self._table.resources
        if self._bound is None or any(one is not other for one, other in zip(self._bound[0], given)):
            self._bound = given, self.device.bind(self._file, self._record, *given)
        attachments = [{"view": one.create_view(), "load_op": "load", "store_op": "store"} for one in targets]
        run = encoder.begin_render_pass(color_attachments=attachments, **timing(timer, "daylight", encoder))
        run.set_pipeline(pipeline)
        run.set_bind_group(0, self._bound[1])
        run.draw(3)
        run.end()
        divide(encoder)
