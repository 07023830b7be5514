"""From a picture's small copy, its lights and a Look to all that the passes need: what the look is for this picture."""
import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from airlight.lights import ImageLight
from airlight.lights.around import around_table
from airlight.look import measure
from airlight.look.grid import Array, RayGrid
from airlight.look.measure import Contrast, Found, Seen, Small
from airlight.luminance import luminance
from airlight.options import Look
from airlight.reference import look as twin
from airlight.reference.look import RaySettings, Tones

FINENESS, SHADE, DRAWN_RAYS = 0.55, 0.8, 24  # where none are given
LEAST_DEVIATION = 0.05  # what stands out less than this is not raised to the full
SMALL_LENGTH, SMALL_SOFT = 0.4, 0.08  # of lamps, which do not reach far: of the length; diagonals within which they have no rays yet
LEAST_CONTRAST_SHARE = 0.05  # of the asked contrast: a picture that holds less is left as it was
Bands = Callable[[int, RayGrid, Tones, Array, float, "Array | None"], tuple[Array, Array]]  # the fifth: fineness, degrees


@dataclass(frozen=True)
class LightLook:
    """Holds what was resolved for one light; frames of a sequence keep it."""

    settings: RaySettings
    kind: str
    found: Found
    rays: int


@dataclass(frozen=True)
class ResolvedLook:
    """Holds what a look is for one picture. strength: solved; contrast: that it gives, of `wanted`; message: a line for the user, or ""."""

    lights: tuple[LightLook, ...]
    strength: float
    shade: float
    wanted: float
    contrast: float
    message: str = ""

    @property
    def dark(self) -> tuple[float, float]:
        """Return `reference.look.darkness` of the first light."""
        return twin.darkness(self.lights[0].settings.tones) if self.lights else twin.DARK

    @property
    def changes(self) -> bool:
        """Tells whether the picture is changed at all."""
        return self.strength > 0 and bool(self.lights)


def resolve(
    small: Small,
    size: tuple[int, int],
    lights: Sequence[ImageLight],
    look: Look,
    bands: Bands,
    *,
    additive: bool = False,
    grey: bool = False,
    masked: Array | None = None,
    held: ResolvedLook | None = None,
) -> ResolvedLook:
    """Look at each light through `bands`, and solve the strength.

    size: (width, height) of the whole picture; additive: nothing is to be taken from it unless a shade is given; grey: it has no colours,
    and gets none but those asked for; masked: (h, w), what may emit; held: of a frame before, kept as it is.
    """
    shade = look.shade if look.shade is not None else 0.0 if additive else SHADE
    strengths = [light.strength if max(light.color) > 0 else 0.0 for light in lights]
    if max(strengths) <= 0 or look.strength <= 0:
        return ResolvedLook((), 0.0, shade, 0.0, 0.0)
    if held is not None and not held.changes:
        return dataclasses.replace(held, message="")
    fineness = FINENESS if look.fineness is None else look.fineness
    founds: list[Found] = []
    seen: list[Seen] = []
    rays: list[int] = []
    for number, light in enumerate(lights):
        asked = held.lights[number].rays if held is not None else look.rays
        draws = None if asked is None else asked > 0
        one = measure.see(small, light.position, size, light.kind, masked, draws, held is not None)
        if held is not None:
            one = dataclasses.replace(one, tones=held.lights[number].settings.tones, kind=held.lights[number].kind)
        automatic = DRAWN_RAYS if one.kind == "beyond" and measure.is_misty(one) else 0
        count = automatic if asked is None else asked
        pattern = twin.drawn_pattern(count, one.grid, look.rays_seed + number, look.rays_shimmer) if count else None
        usual: Found | None = None
        if held is None and fineness != FINENESS:  # whether a picture holds rays is not told by ones that are smoothed away
            one.bands, one.distance = bands(number, one.grid, one.tones, one.parts, FINENESS, pattern)
            usual = measure.found(small, one)
        one.bands, one.distance = bands(number, one.grid, one.tones, one.parts, fineness, pattern)
        if held is None:
            found = measure.found(small, one)
            founds.append(found if usual is None else dataclasses.replace(found, fine=usual.fine))
        seen.append(one)
        rays.append(count)
    if held is not None:
        tables = [around_table(light.cookie) for light in lights]  # of this frame
        shaped = [dataclasses.replace(one.settings, around=table) for one, table in zip(held.lights, tables, strict=True)]
        own = [dataclasses.replace(one, settings=settings) for one, settings in zip(held.lights, shaped, strict=True)]
        return dataclasses.replace(held, message="", lights=tuple(own))
    holds = [1.0 if count else found.holds for found, count in zip(founds, rays, strict=True)]
    weights = [strength * held_share for strength, held_share in zip(strengths, holds, strict=True)]
    share = max(h for h, strength in zip(holds, strengths, strict=True) if strength > 0)
    most = max(weights)
    plain = grey and look.warmth is None
    found_lights = tuple(
        LightLook(
            RaySettings(
                grid=one.grid,
                tones=one.tones,
                deviation=max(found.deviation, LEAST_DEVIATION),
                rest=found.rest,
                length=found.length * (SMALL_LENGTH if one.kind == "lamps" else 1.0) if look.length is None else look.length,
                mist=look.mist,
                soft=twin.BEYOND_SOFT if not one.grid.inside else SMALL_SOFT if one.kind == "lamps" else twin.SOFT,
                weight=weight / most if most > 0 else 0.0,
                color=_tint(light) or measure.light_color(small, one.tones, one.grid, one.kind, 0.0 if plain else look.warmth),
                around=around_table(light.cookie),
            ),
            one.kind,
            found,
            count,
        )
        for light, one, found, weight, count in zip(lights, seen, founds, weights, rays, strict=True)
    )
    if share < LEAST_CONTRAST_SHARE:
        dark = max(found.visible for found in founds) < measure.SEEN_ENOUGH[0]
        if masked is not None and all(not one.emits.any() for one in seen):
            nothing = "the mask lets nothing shine: make it white where light is, or invert it"
            return ResolvedLook(found_lights, 0.0, shade, 0.0, 0.0, nothing)
        black = "what lies round the light is black: no air shows there; brighten the shadows first, or --look classic draws on black"
        clear = "nothing stands before the light: no shafts; --rays 24 draws some"
        return ResolvedLook(found_lights, 0.0, shade, 0.0, 0.0, black if dark else clear)
    pairs = [(one, known.settings) for one, known in zip(seen, found_lights, strict=True)]
    wanted = measure.VISIBLE * look.strength * share
    strength, contrast = Contrast(small, *measure.sums(small, pairs), shade, twin.darkness(seen[0].tones)).solve(wanted)
    drawn = max(rays)
    message = f"no gaps for light to come through: {drawn} rays drawn; --rays 0 for none" if drawn and look.rays is None else ""
    return ResolvedLook(found_lights, strength, shade, wanted, contrast, message)


def _tint(light: ImageLight) -> tuple[float, float, float] | None:
    """Scale the colour that the user gave a light to luminance 1; None where none is given."""
    if light.color == (1.0, 1.0, 1.0) or max(light.color) <= 0:
        return None
    hue = np.array(light.color) / max(light.color)
    r, g, b = hue / max(float(luminance(hue)), 1e-3)
    return float(r), float(g), float(b)
