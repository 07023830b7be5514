"""Puts daylight on pictures: what `airlight image --daylight` asks for."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.errors import MachineError
from airlight.jobs import outputs
from airlight.jobs.clips import Settled
from airlight.jobs.daylight_doubts import Doubts
from airlight.jobs.daylight_request import OF_KNEE
from airlight.jobs.daylight_strength import STRONGEST, strength_of_sky
from airlight.jobs.daylight_sun import PRINTED, atmosphere
from airlight.jobs.daylight_text import LOWEST_SUN, read_span
from airlight.jobs.daylight_view import View, find_view
from airlight.jobs.image_work import ImageWork, Loaded
from airlight.jobs.light_text import place
from airlight.jobs.tasks import PictureTask
from airlight.jobs.verdict import percent
from airlight.messages import number
from airlight.options import Daylight, DaylightPicture, Parameters

if TYPE_CHECKING:
    from airlight.files import Picture
    from airlight.jobs.daylight_depth import Distances

PART = 1 << 21  # pixels that are on the device at a time
HALF_MOST = 65504.0
ALIKE = 1.25  # times: what daylight is brighter or darker by its own sky without a word


@dataclass
class DaylightWork(ImageWork):
    """Reads, renders, writes each picture with its daylight."""

    day: Daylight
    where: DaylightPicture

    def __post_init__(self) -> None:
        from airlight.daylight import Atmosphere

        super().__post_init__()
        self._span = read_span(self.where.depth_range) if self.where.depth_range is not None else None
        is_even = self.day.daylight == PRINTED
        self._air = Atmosphere(multiple="none") if is_even else atmosphere(self.day)  # of Eq. 1 none is read, nor waited for

    def planes(self, task: PictureTask, picture: "Picture") -> tuple[Any, ...]:
        """Read the mask of the sky, and depths as they are stored with whether they are whole numbers."""
        from airlight.files.depths import read_depths

        r = self.request
        depths = read_depths(task.depth, r.depth_layer, picture, r.on_damage, r.view) if r.has_depth else None
        return r.reading.mask(task.mask, picture), depths, None

    def render(self, task: PictureTask, loaded: Loaded) -> Any:
        """Give (pictures.Rendered, D or None, the settings)."""
        self.open_device()
        settled = self.clips.settled(task, loaded, self.read, self._settled)
        done, dark = settled.done or self._placed(task, loaded, settled, lambda _: None)
        return done, dark, self.request.settings.text(settled.lights)

    def _settled(self, task: PictureTask, loaded: Loaded, tell: Callable[[str], object]) -> Settled:
        """Find sun and camera of a picture, and render it."""
        begun, picture = time.perf_counter(), loaded.picture
        lines: list[str] = []  # told when all is well: what is refused is one line
        view, written = find_view(self.request, self.day, self.where, picture, self.many, lines.append)
        settled = Settled(written, self._knee(picture, written), view, None, True)
        begun = self.spent.add("find the light", begun)
        settled.done = self._placed(task, loaded, settled, lines.append)
        self.spent.add("render", begun)
        for line in lines:
            tell(line)
        return settled

    def _knee(self, picture: "Picture", written: list[Any]) -> Parameters:
        """Choose what is bright enough to be sky, where nothing else tells it."""
        from airlight.occlusion.automatic import auto_threshold

        coarse, integer = picture.rec709(picture.linear(coarse=True)), picture.codes.dtype.kind == "u"
        found: Parameters = auto_threshold(self.parameters, coarse, [place(one, picture) for one in written], bounded=integer)
        return found

    def _distances(self, task: PictureTask, loaded: Loaded, view: View, p: Parameters, tell: Callable[[str], object]) -> "Distances":
        """Find how far things are, and what is sky."""
        from airlight.detect.sky import find_sky
        from airlight.jobs.daylight_depth import at_one_distance, from_map, with_sky, with_soft_edge
        from airlight.luminance import luminance
        from airlight.planes import smoothstep

        picture, mask = loaded.picture, loaded.emits
        if loaded.far is not None:
            values, whole = loaded.far
            lengths = view.camera.lengths(*view.corner, picture.width, picture.height)
            found = from_map(values, whole, self.where, self._span, lengths, task.depth or task.source)
            if mask is None:
                return with_soft_edge(found, picture.rec709(picture.linear()))
            return with_sky(found, checked_mask(mask, picture))
        if mask is None:
            light = picture.rec709(picture.linear())
            mask = np.zeros(light.shape[:2], np.float32) if self.request.values.keys() & set(OF_KNEE) else find_sky(light)
            if not mask.any():  # what is seen of it may be gaps
                mask = smoothstep(luminance(light), *p.knee).astype(np.float32)
            share = percent(float(mask.mean()))
            tell(f"{share} of it is taken as sky, --mask FILE, white where it is sky, says it better")
        assert self.where.distance is not None
        return at_one_distance(checked_mask(mask, picture), self.where.distance)

    def _dark(self, picture: "Picture", found: "Distances", view: View, settled: Settled, is_map: bool) -> np.ndarray:
        """Estimate D, (H, W)."""
        if view.light is None:
            return np.zeros(found.sky.shape, np.float32)
        from airlight import api
        from airlight.jobs.daylight_shadows import dark_share

        p = settled.parameters
        keys = {name: getattr(p, name) for name in p.__struct_fields__}
        image, sun = picture.rec709(picture.linear()), place(settled.lights[0], picture)
        if "occlusion" in self.request.values and p.occlusion != "depth":
            return np.asarray(api.occlusion_fraction(image, sun, device=self._where, alpha=picture.alpha, **keys))

        def fraction(mask: np.ndarray) -> np.ndarray:
            return np.asarray(api.occlusion_fraction(image, sun, device=self._where, mask=mask, **(keys | {"occlusion": "none"})))

        return dark_share(found, fraction, is_map)

    def _strength(self, found: "Distances", light: np.ndarray, view: View, tell: Callable[[str], object]) -> float:
        """Choose the sun's irradiance above the air: as given, or as the photograph's own sky has it, or so that white in the sun is 1."""
        from airlight.daylight.picture import irradiance_of_white

        if self.day.sun_strength is not None:
            return self.day.sun_strength
        if self.day.daylight == PRINTED:
            return float(np.pi)
        white = irradiance_of_white(self._air, view.sun.elevation, view.altitude)
        own = strength_of_sky(self._air, view, found, light, self.day.sky != "replace") if self.day.sky != "air" else None
        if own is None:
            return white
        most = irradiance_of_white(self._air, view.sun.elevation, view.altitude, LOWEST_SUN)
        own = min(own, most, STRONGEST)  # mist and clouds are brighter than a clear sky, and no reason to expose for more
        if not 1 / ALIKE <= own / white <= ALIKE:
            given = f"--sun-strength {number(own, 2)}"
            tell(f"daylight is as bright as the photograph's sky, {given}; white in the sun would be 1 with {number(white, 2)}")
        return own

    def _placed(self, task: PictureTask, loaded: Loaded, settled: Settled, tell: Callable[[str], object]) -> Any:
        """Render one picture, (pictures.Rendered, D)."""
        from airlight.daylight.picture import displayed
        from airlight.detect.sky_edge import land_part
        from airlight.pictures import Rendered
        from airlight.scatter.daylight.on_picture import OnPicture
        from airlight.scenes.offline import FAR_METRES

        picture, day = loaded.picture, self.day
        lines: list[str] = []
        found = self._distances(task, loaded, settled.held, settled.parameters, lines.append)
        dark = self._dark(picture, found, settled.held, settled, loaded.far is not None)
        light, is_even = picture.rec709(picture.linear()), day.daylight == PRINTED
        if settled.held.strength is None:  # else that of another frame
            settled.held = replace(settled.held, strength=self._strength(found, light, settled.held, lines.append))
        view, strength = settled.held, settled.held.strength
        even = {"beta_rayleigh": day.beta_rayleigh, "beta_mie": day.beta_mie, "g": day.aerosol_anisotropy} if is_even else None
        if not hasattr(self._where, "device"):
            raise MachineError("daylight on a picture is computed by a graphics adapter, and there is none; one in software will do")
        on = OnPicture(
            self._where.device, self._air, view.camera, view.azimuth, view.sun.elevation, view.altitude, strength,
            day.sky or "keep", day.attenuate or ("all" if is_even else "source"), even,
        )  # fmt: skip
        of_land = land_part(light, found.sky)
        through, added = np.empty_like(light), np.empty_like(light)
        step = max(1, PART // picture.width)
        left, top = view.corner
        for first in range(0, picture.height, step):
            some = slice(first, first + step)
            planes = (one[some] for one in (light, found.metres, found.sky, dark, of_land))
            through[some], added[some] = on.part(left, top + first, *planes)
        np.clip(added, -HALF_MOST, HALF_MOST, out=added)
        Doubts(None if is_even else self._air, view, found, day).tell(light, through, added, lines.append)
        if lines:
            tell(f"{picture.path}: {'; '.join(lines)}")
        axial = found.metres / view.camera.lengths(left, top, picture.width, picture.height)
        z = np.where(np.isfinite(axial), axial, FAR_METRES).astype(np.float32)
        changed = (through != 1).any(axis=2) | (added != 0).any(axis=2)
        pixels, layer = picture.from_rec709(light * through), picture.from_rec709(added)
        if outputs.is_float(task.output, picture):
            pixels = pixels + layer
        else:
            pixels = displayed(pixels, layer, picture.luminance)
        return Rendered(pixels, layer, changed, transmittance=through, z=z), dark


def checked_mask(mask: np.ndarray, picture: "Picture") -> np.ndarray:
    """Check the mask of the sky against the picture's size. Raises AirlightError."""
    from airlight.layers import checked_plane

    found = checked_plane("mask", mask, (picture.height, picture.width))
    assert found is not None
    return found
