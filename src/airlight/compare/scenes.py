"""In a scene, each variant's light, its error against the truth, and its cost."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from airlight.bench.measure import Passes
from airlight.compare import rule
from airlight.compare.fine_cookies import doubt_of_cookies
from airlight.compare.measure import fit
from airlight.compare.result import SceneComparison, SceneRow, Truth
from airlight.compare.variants import Variant
from airlight.composite.adapt import adapt, measure_ramp
from airlight.errors import AirlightError, warn
from airlight.gpu.timing import run_ms
from airlight.jobs.seen import doubt_of_medium
from airlight.luminance import REC709_F32
from airlight.medium.resolve import ResolvedMedium
from airlight.options import March, Medium, Parameters, SceneOptions
from airlight.progress import SILENT, Work
from airlight.pygfx.basin import Basin
from airlight.pygfx.casters import Casters
from airlight.pygfx.dimmed_suns import doubt_of_suns
from airlight.pygfx.medium_effect import settle
from airlight.pygfx.origin import current_origin
from airlight.pygfx.punctual import punctual_lights
from airlight.reference import mitsuba, paths
from airlight.reference import panes as seen_through
from airlight.reference import scene as reference
from airlight.reference.medium import Layer
from airlight.reference.tone import displayed
from airlight.scatter.methods import FOR_MEDIUM, METHODS, ONE_SUN, WINDOWS, of_medium
from airlight.scatter.slices.records import has_window
from airlight.scenes import Stage
from airlight.scenes.exposure import Exposure
from airlight.scenes.offline import Shot, Studio
from airlight.scenes.replay import Replay
from airlight.scenes.triangles import world_panes, world_triangles

Array = npt.NDArray[Any]
MAX_TRACED = 1e9  # triangles, and what in the air costs as much, x lights x pixels up to which the tracer is asked, some minutes
MAX_SHADOW_SIDE, MAX_SHADOW_BYTES = 8192, 2**31  # texels along a side of a shadow map of the truth, and bytes of all of them
CASCADES = 4  # of it
# how many drawings of a variant take as long as a truth, if nothing better is known; triangles x lights x pixels that take as long as one
TRUTH_DRAWINGS, TRACED_PER_DRAWING = 10.0, 2e6


class ComparedView:
    """Shows a stage from where it is compared, at one time. Raises AirlightError, MachineError."""

    def __init__(self, stage: Stage, shot: Shot, time: float = 0.0, turn: float = 0.0, exclude: Sequence[str] = ()) -> None:
        self.stage, self.shot, self.moment, self.exclude = stage, shot, (time, turn), exclude
        self._replays: dict[Any, Replay] = {}
        self._exposure: Exposure | None = None
        first = Replay(self._studio(Parameters()))
        self._exposure = first.studio.exposure  # one for all, so that they can be compared
        first.frame(*self.moment)
        self.device, self.camera, self.lights = first.shafts.device, first.studio.camera, first.shafts.lights
        self.hidden = first.shafts.exclude
        self._casters = Casters(self.device, stage.scene, self.lights, self.hidden)
        self._basin = Basin(self._casters)
        self.set_up = first.studio.set_up
        with self.set_up():
            self.punctual = punctual_lights(self.lights, self._exposure.pre)
            known, unknown = world_panes(stage.scene, self.lights, self.hidden)
        self.has_panes = bool(known or unknown)
        self.in_view = first.studio.shafts.is_lit
        picture = first.studio.read(first.textures["color_tex"].texture, np.float16)
        self.surfaces = picture[..., :3].astype(np.float32)  # (H, W, 3) linear, before any light in the air

    def _studio(self, parameters: Parameters, **more: Any) -> Studio:
        turns = (self.moment[1],)
        return Studio(self.stage, self.shot, parameters, exclude=self.exclude, exposure=self._exposure, turns=turns, **more)

    def lacks(self, v: Variant) -> str | None:
        """Say why a variant does not go with the view; else None."""
        method = v.parameters.method
        if METHODS[method].lights == ONE_SUN and [light.directional for light in self.punctual] != [True]:
            return f"it takes one light, a sun (here: {', '.join(light.word for light in self.punctual) or 'none'})"
        if METHODS[method].lights == WINDOWS and not all(has_window(light) for light in self.punctual):
            return f"it takes {WINDOWS} (here: {', '.join(light.word for light in self.punctual)})"
        if not METHODS[method].lights_medium and not self.in_view:
            return "no light is before the eye, and it draws no other"
        return None

    def resolved(self, v: Variant) -> ResolvedMedium:
        """Settle its medium, in the scale of what is drawn."""
        with self.set_up():
            quality, radius, fields, time = v.parameters.quality, self.stage.radius, self.stage.fields, self.moment[0]
            medium = settle(v.medium, v.march, quality, radius, fields, time, self._casters.gather(), self._basin, self.camera)
        return medium if self._exposure is None else medium.exposed(self._exposure.pre)

    def replay(self, v: Variant) -> Replay:
        """Take the replay for the variant's settings, one for all whose textures are alike, so that none is made anew between two."""
        method, share = v.parameters.method, v.in_scene.share(v.parameters)
        in_medium = METHODS[method].lights_medium
        kind = (method, self.resolved(v).shadow_size, v.march.cascades) if in_medium else ("view", v.in_scene.occluders)
        if (kind, share) not in self._replays:
            self._replays[kind, share] = Replay(self._studio(v.parameters))
        found = self._replays[kind, share]
        shafts = found.shafts
        shafts.parameters, shafts.composite, shafts.in_scene, shafts.medium, shafts.march = (
            v.parameters,
            v.composite,
            v.in_scene,
            v.medium,
            v.march,
        )
        return found

    def light(self, v: Variant) -> tuple[Array, Array]:
        """Give (H, W, 3) the light alone, before a composite of its own, and (H, W, 3) the picture with it, as a display shows it."""
        frame = self.replay(v).frame(*self.moment, layer=True)
        layer = frame.shafts() / np.float32(frame.layer_scale)  # as it is drawn
        factor, offset = METHODS[v.parameters.method].light_of_layer
        return factor * layer + offset, frame.pixels()

    def composited(self, layer: Layer, v: Variant) -> Array:
        """Composite (H, W, 3) the surfaces seen through the layer of the variant's medium, as a display shows it."""
        share = v.medium.extinction_share if v.medium.extinction else 0.0
        transmittance, surfaces = reference.share_of_dimming(layer.transmittance, share), self.surfaces
        if self.has_panes and v.medium.transparency == "layers":  # each of them lies behind air of its own
            transmittance, surfaces = np.ones(3), self._through_dark_air(v.medium)
        color = reference.through_medium(surfaces, layer.radiance, transmittance, 1.0 if v.composite.mix is None else v.composite.mix)
        exposure = Exposure() if self._exposure is None else self._exposure
        color = (color * (2.0 ** (exposure.ev if v.in_scene.ev is None else v.in_scene.ev) / exposure.pre)).astype(np.float32)
        if v.composite.adapt > 0:
            adapt(color, measure_ramp(np.asarray(color @ REC709_F32)), v.composite.adapt)
        return np.asarray(displayed(color, v.in_scene.view_transform).clip(0, 1), np.float32)

    def _through_dark_air(self, medium: Medium) -> Array:
        """Draw (H, W, 3) the surfaces through a medium that scatters nothing."""
        dark = msgspec.structs.replace(medium, albedo=(0.0,) * 3, ambient=(0.0,) * 3)
        frame = self._studio(Parameters(method=FOR_MEDIUM), medium=dark, march=March(steps="exact"), linear=True).frame(*self.moment)
        return frame.pixels() * np.float32(1.0 if self._exposure is None else self._exposure.pre)

    def doubt(self, layer: Layer, v: Variant) -> str | None:
        """Word one line where the variant's medium, of a true layer, hides the scene or is not seen; else None."""
        exposure, medium = self._exposure or Exposure(), self.resolved(v)
        factor = 2.0 ** (exposure.ev if v.in_scene.ev is None else v.in_scene.ev) / exposure.pre
        length = np.minimum(layer.path_length, medium.max_distance).ravel()
        drawn = length < medium.max_distance
        if medium.settings.fog != "none" or medium.varies:
            length = medium.optical_length(layer.transmittance).ravel()
        shown = layer.radiance, self.surfaces, self.surfaces * layer.transmittance
        light, picture, own = ((factor * pixels).reshape(-1, 3) for pixels in shown)
        seen = self.camera.view_matrix, self.camera.projection_matrix
        return (
            doubt_of_medium(medium, length, drawn, light, picture, own)
            or doubt_of_suns(medium, self.punctual, *seen)
            or doubt_of_cookies(self.punctual, *seen, layer.path_length, medium.max_distance)
        )

    # ------------------------------------------------------------ truths

    def truth(self, medium: ResolvedMedium, against: str | None, work: Work = SILENT) -> tuple[Layer, str]:
        """Compute the true layer, and say by what. against: tracer, walk or mitsuba; None: the tracer where it can, else the walk.

        work: of which it is a part."""
        if against == "walk":
            return self._walked(medium, "as --against walk asks")
        try:
            with self.set_up():
                seen, casting = world_triangles(self.stage.scene, self.lights, self.hidden)
                panes, unknown = world_panes(self.stage.scene, self.lights, self.hidden)
                view, projection = self.camera.view_matrix.copy(), self.camera.projection_matrix
                medium = medium.seen_from(current_origin())
        except AirlightError as error:
            if against is not None:
                raise AirlightError(f"--against {against}: {error}; or use --against walk") from None
            return self._walked(medium, f"since the ray tracer knows triangles only ({str(error).partition(';')[0]})")
        if medium.settings.transparency == "none":
            panes, unknown = [], []
        count, size = max(len(seen), len(casting)), (self.shot.width, self.shot.height)
        if against == "mitsuba":
            _tell_lacking("Mitsuba", len(panes) + len(unknown), "is given no glass")
            layer, noise = mitsuba.layer(view, projection, size, seen, self.punctual, medium, casting)
            where = rule.clear(layer.path_length)
            alone = rule.errors(layer.radiance + noise, layer.radiance, where).rmse if where.any() else 0.0
            about = f"by Mitsuba over the scene's {count:,} triangles, whose noise alone makes an error of {100 * alone:.2g} %"
            return layer, about
        count += sum(len(pane.triangles) for pane in panes)
        in_air = paths.cost(medium, min(medium.max_distance, 2 * self.stage.radius))
        each = (count + in_air) * len(self.punctual) * size[0] * size[1]
        if against is None and each > MAX_TRACED:
            what = "density that varies so finely is too much" if in_air > count else f"{count:,} triangles are too many"
            return self._walked(medium, f"since {what} for the ray tracer at this size (--against tracer asks it all the same)")
        work.weigh(each / TRACED_PER_DRAWING)
        _tell_lacking("the ray tracer", len(unknown), "knows triangles of an even opacity and colour", unknown)
        layer = seen_through.layer(view, projection, size, seen, panes, self.punctual, medium, casting, work.share)
        glass = f", {len(panes)} of its meshes seen through" if panes else ""
        about = f"by a float64 ray tracer over the scene's {count:,} triangles{glass}, which has the exact lit segments of each ray"
        return layer, about

    def _walked(self, medium: ResolvedMedium, why: str) -> tuple[Layer, str]:
        cascades = CASCADES if any(light.directional for light in self.punctual) else 1
        march = March(steps="exact", cascades=cascades)
        layers = sum(light.shadow_layers(dataclasses.replace(medium, march=march)) for light in self.punctual)
        side = min(MAX_SHADOW_SIDE, self.device.max_side)
        while side > 1024 and 4 * side * side * layers > MAX_SHADOW_BYTES:
            side //= 2
        march = msgspec.structs.replace(march, shadow_size=side)
        studio = self._studio(Parameters(method=FOR_MEDIUM), in_scene=SceneOptions(resolution=1.0), medium=medium.settings, march=march)
        frame = studio.frame(*self.moment, layer=True)
        assert frame.layer is not None and frame.layer_transmittance is not None
        about = f"by the exact walk with shadow maps of {side} texels, {why}: what shadow maps miss, it misses too"
        return Layer(frame.layer[..., :3], frame.layer_transmittance, frame.layer[..., 3]), about


def _tell_lacking(tracer: str, count: int, why: str, names: Sequence[str] = ()) -> None:
    """Say in a line that a truth lacks so many things of a scene that are seen through."""
    if count:
        what = f"{count} {'thing that is' if count == 1 else 'things that are'} seen through"
        called = f" ({', '.join(dict.fromkeys(names))})" if names else ""
        warn(f"the truth of {tracer} lacks {what}{called}: it {why}; --against walk has all")


def compare(
    view: ComparedView,
    variants: Sequence[Variant],
    *,
    against: str | None = None,
    runs: int = 5,
    box: int = 960,
    say: Callable[[SceneRow], None] = lambda row: None,
    work: Work = SILENT,
) -> SceneComparison:
    """Measure the variants; say gets each row when it is complete, work what is done. Pictures fit into box x box pixels.

    Error: by `rule`, of the light against the truth of the variant's own medium; of methods without units,
    after the one factor that fits best. Cost: the passes of shadow maps, source and shafts over the wall time of a one-tap copy, medians of
    interleaved runs; the pass as a whole where the device has no timestamps. Raises AirlightError, MachineError.
    """
    if against == "mitsuba":
        mitsuba.ready()
    found: dict[Medium, tuple[int, Array, Array, float]] = {}
    truths: list[Truth] = []
    media = len({v.medium for v in variants})
    work.total = media * TRUTH_DRAWINGS + len(variants) * (1 + runs)
    for v in variants:
        if v.medium in found:
            continue
        work.part(f"truth {len(found) + 1} of {media}", TRUTH_DRAWINGS)
        medium = view.resolved(v)
        layer, about = view.truth(medium, against, work)
        true, where = layer.radiance, rule.clear(layer.path_length)
        if medium.air == 0:  # where there is nothing nothing can be wrong
            where &= true.any(axis=2)
        if not where.any():
            raise AirlightError(f"{view.stage.name}: every pixel lies at an edge of depth; compare at a larger size")
        mean = float(true[where].mean())
        if not mean > 0:
            raise AirlightError(f"{view.stage.name}: the medium scatters no light here; give it a denser --medium, or a light")
        found[v.medium] = len(truths), true, where, mean
        if METHODS[v.parameters.method].has_units and (line := view.doubt(layer, v)) is not None:
            warn(f"{v.name}: {line}")
        shown = fit(view.composited(layer, v), box)
        truths.append(Truth(about, int(where.sum()), shown, fit(true.astype(np.float32), box)))
    lights = []
    for v in variants:
        work.part(f"light of {v.name}", 1)
        lights.append(view.light(v))
        if (line := view.replay(v).shafts.lacks) is not None:
            warn(f"{v.name}: {line}")
    copy_ms, costs = _costs(view, variants, runs, work)
    rows = []
    for v, (light, picture), parts in zip(variants, lights, costs, strict=True):
        number, true, where, mean = found[v.medium]
        has_units = METHODS[v.parameters.method].has_units
        factor = None if has_units else rule.factor(light, true, where)
        light = light if factor is None else factor * light
        wrong = rule.errors(light, true, where)
        ms = sum(parts.values())
        off = (np.abs(light - true).mean(axis=2) / mean).astype(np.float32)
        row = SceneRow(
            variant=v,
            rmse=wrong.rmse,
            p99=wrong.p99,
            worst=wrong.worst,
            ms=ms,
            copies=ms / copy_ms,
            shown=fit(picture, box),
            difference=fit(off, box),
            layer=fit(light.astype(np.float32), box),
            truth=number,
            bias=wrong.bias if has_units else None,
            factor=factor,
            parts=None if WHOLE in parts else list(parts.items()),
        )
        rows.append(row)
        say(row)
    return SceneComparison(rows, view.device.described, copy_ms, (view.shot.width, view.shot.height), truths)


WHOLE = "whole"  # the part of a cost that has no parts


def part_of(label: str) -> str | None:
    """Tell to which part of the light's cost a pass belongs; None: to none, it puts the light on the picture."""
    if label in ("merge", "adapt", "panes"):
        return None
    if label in ("mask", "look", "prepass"):
        return "source"
    if label.startswith(("march", "upsample", "pane spans")):
        return "march"
    return "shadow maps" if label in ("shadows", "glass") else label if label in of_medium() else "shafts"


def _costs(view: ComparedView, variants: Sequence[Variant], runs: int, work: Work) -> tuple[float, list[dict[str, float]]]:
    """Time a copy, and each variant's parts: (ms, a dict of ms each), medians of runs."""
    size = view.shot.width, view.shot.height
    copy = Passes(view.device, *(view.device.texture(*size, "rgba16float") for _ in range(2))).copy()
    copies: list[float] = []
    times: list[dict[str, list[float]]] = [{} for _ in variants]
    for turn in range(runs):
        work.part(f"timing, run {turn + 1} of {runs}", len(variants))
        copies.append(run_ms(view.device, copy))
        for v, own in zip(variants, times, strict=True):
            whole, passes = view.replay(v).spent()
            parts: dict[str, float] = {} if passes else {WHOLE: whole}
            for label, ms in passes.items():
                name = part_of(label)
                if name is not None:
                    parts[name] = parts.get(name, 0.0) + ms
            for name, ms in parts.items():
                own.setdefault(name, []).append(ms)
    return float(np.median(copies)), [{name: float(np.median(ms)) for name, ms in own.items()} for own in times]
