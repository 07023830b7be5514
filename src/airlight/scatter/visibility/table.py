"""Plans and records tables of visibility: of suns, counts of lit samples, their sums, and the look-up of each pixel."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.errors import warn
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, compute
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import FOGS, ResolvedMedium
from airlight.projection import eye_rays
from airlight.scatter.march.cookies import SHAPES, shape_of
from airlight.scatter.march.records import FRAME, frame_record, light_record
from airlight.scatter.visibility.base import FOLDER, GROUP, Table
from airlight.scatter.visibility.grid import Fineness, RowGrid, block_count, row_grid
from airlight.scatter.visibility.lamps import LampTable
from airlight.shadows import Shadow

ENDS, BITS, TABLE, APPLY, CORE = (f"{FOLDER}/{name}.wgsl" for name in ("ends", "bits", "table", "apply", "core"))
ROW = struct_dtype(f"{FOLDER}/grid.wgsl", "Row")
FINENESS = {"draft": Fineness(8, 12, 8), "normal": Fineness(6, 12, 8), "fine": Fineness(4, 8, 16)}
SPOT_FINENESS = {"draft": Fineness(8, 12, blocks=48), "normal": Fineness(5.5, 10, blocks=60), "fine": Fineness(4, 4, blocks=96)}
POINT_FINENESS = {"draft": Fineness(12, 8, blocks=48), "normal": Fineness(10, 6, blocks=60), "fine": Fineness(6, 4, blocks=90)}
BUDGET = 2**28  # bytes of a picture's tables
CORE_RADIUS_PX = 40.0  # around the epipole, in which pixels are walked
CORE_SHARE = 1 / 32  # of the picture's width, that it is at most
Lit = tuple[PunctualLight, Shadow | None]


def refusal(light: PunctualLight, shadow: Shadow | None, medium: ResolvedMedium, flat: bool, panes: bool) -> str | None:
    """Words why a light does not go by a table, to follow "a table of visibility is "; None: it does."""
    m = medium.march
    if flat:
        return "for cameras with perspective"
    if m.shadow_filter != "nearest" or m.soften:
        return "for shadow-filter nearest, without soften"
    if shadow is None or not shadow.views or (light.directional and m.sun_steps is not None):
        return "for light with shadows, and for suns whose steps are not said"
    if not light.directional:
        if medium.varies or medium.settings.fog != "none":
            return "for lamps in even air"
        if len(light.planes()) or light.falloff_terms() != (1.0, 0.0, 0.0):
            return "for lamps whose light falls with the square of the distance, and not for projectors"
    elif medium.varies or (medium.fades_suns and medium.settings.fog == "linear"):
        return "for even air and for exponential fog"
    if panes or shadow.glass is not None or SHAPES.index(shape_of(light)) or light.own_medium(medium) is not medium:
        return "for light without glass, cookies, or a medium of its own"
    return None


class SunTable(Table):
    """Holds one sun's table."""

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        super().__init__(device, pixels)
        self._rises, self._step = False, 3
        self._constants: tuple[dict[str, Any], ...] = ()  # of pipelines: fineness, fog, whether it dims the sun, colours, maps
        self._phase: dict[str, Any] = {}
        self._biased: dict[str, Any] = {}
        self._looks: dict[str, Any] = {}  # of the look-up

    def update(
        self, view: Any, projection: Any, light: PunctualLight, shadow: Shadow, medium: ResolvedMedium, fineness: Fineness, room: int
    ) -> int:
        """Sets what the next `record` sees, as March.update; returns the bytes that it takes: 0 where they are more than `room`, or a
        texture would be too large."""
        light_data = light_record(light, shadow, view, medium)
        size = self.pixels
        rows = row_grid(light_data["position"], eye_rays(projection)[0], size, fineness.of_picture(size))
        colours = bool(np.ptp(medium.sigma_t) > 0)
        step = 2 if colours else 3
        maps = len(shadow.views)
        records, rises = _row_records(rows, shadow, view, projection)
        reach = min(medium.max_distance, medium.sun_reach)
        stops = [_stop(one, view, shadow.size) for one in shadow.views]
        longest = max(min(stop, reach / one.texel) for stop, one in zip(stops, shadow.views, strict=True))
        layers = -(-block_count(longest, fineness.per, fineness.widest) // step)
        blocks, count = layers * step, len(records)
        total = self._fit(rows, count, blocks, layers, ROW.itemsize, room)
        if total == 0:
            return 0
        out = self._grid_record(rows, count, layers, medium)
        for i, (at, one) in enumerate(zip(out["map"], shadow.views, strict=False)):
            at["eye"] = (one.matrix @ np.linalg.inv(view))[:3, 3]
            at["stop"], at["near"], at["far"] = stops[i], one.span[0], min(one.span[1], 3e38)
            at["first_row"], at["bias"] = i * len(rows.begin), medium.march.shadow_bias / one.depth_scale
        write = self.device.queue.write_buffer
        write(self._grid, 0, out.tobytes())
        write(self._light, 0, light_data.tobytes())
        write(self.buffers["rows"], 0, records.tobytes())
        self._divide(rows)
        self.counts = blocks, maps
        self._core_groups = self._place_core(rows, min(CORE_RADIUS_PX, CORE_SHARE * self.pixels[0]))
        self._shadow = shadow.texture
        fog = {"FOG": FOGS.index(medium.settings.fog)}
        fineness_constants = {"PER": fineness.per, "WIDEST": fineness.widest}
        fades = {"FADES": medium.fades_suns}
        self._constants = fineness_constants, fog, fades, {"COLOURS": colours}, {"MAPS": maps}
        self._rises, self._step = rises, step
        self._phase = {"PHASE": medium.lobes(light.anisotropy)[0]}
        self._biased = {"BIASED": bool(medium.march.shadow_bias)}
        self._looks = {
            "SHORT": medium.sun_reach < medium.max_distance,
            "GLOWS": medium.settings.sun_glow > 0,
            "AMBIENT": bool(medium.ambient.any()),
        }
        self._looks["BEYOND"] = any(reach / one.texel > stop for stop, one in zip(stops, shadow.views, strict=True))
        return total

    def record(
        self, encoder: Any, frame: Any, depth: Any, textures: tuple[Any, Any, Any], first: bool, last: bool, timer: Timer | None
    ) -> None:
        """Records the table, and adds its light to what was before, or to the ambient light if it is the first.

        frame: the uniform buffer of a FRAME. textures: (before, target, transmittance). last: whether it writes transmittance too.
        """
        before, target, transmittance = textures
        b = self.buffers
        fineness, fog, fades, colours, maps = self._constants
        common = frame, self._light, depth, self._shadow, before

        def run(path: str, entry: str, label: str, key: Any, held: Sequence[Any], counts: tuple[int, ...], **constants: Any) -> None:
            pipeline = self.device.pipeline(path, entry, **constants)
            to = target if path in (APPLY, CORE) else transmittance
            compute(encoder, pipeline, self._bound((path, key), path, *common, to, self._grid, *held), counts, label, timer)

        rows = sum(count for _, count, _ in self._dispatches) * self.counts[1]
        spread = self._record_farthest(encoder, (*common, transmittance, self._grid), before, timer)
        run(ENDS, "ends", "table ends", 0, (b["rows"], b["ray_ends"], b["word_ends"], spread), (-(-rows // GROUP),))
        for k, count, words in self._dispatches:
            bound = (b["rows"], b["word_ends"], b["planes"], self._parts[k], self.device.sampler("nearest"))
            own = {"WORDS": words, "STEP": self._step, "RISES": self._rises, **fineness}
            run(BITS, "count", "table bits", k, bound, (-(-count // GROUP), *self.counts), **own)
        for k, count, words in self._dispatches:
            held = b["rows"], b["word_ends"], b["planes"], self._parts[k], b["ray_ends"], self.atlas
            own = {**fineness, **fog, **fades, **colours, **maps}
            run(TABLE, "accumulate", "table sums", k, held, (-(-count // GROUP), 4 * words, self.counts[1]), **own)
        lit = {"FIRST": first, **fog, **maps, **fades, **self._phase}
        counts = -(-self.pixels[0] // GROUP), self.pixels[1]
        looked_up = self.atlas, self.device.sampler(), transmittance
        run(APPLY, "apply", "table look-up", first, looked_up, counts, LAST=last, **lit, **fineness, **colours, **self._looks)
        if self._core_groups[0]:
            run(CORE, "walk_core", "table core", first, (self._core,), self._core_groups, DIRECTIONAL=True, **lit, **self._biased)


def _row_records(rows: RowGrid, shadow: Shadow, view: Any, projection: Any) -> tuple[np.ndarray, bool]:
    """Fills a ROW for each row of each of a shadow's views; tells whether the slope towards the sun rises along them."""
    into, ends = np.linalg.inv(np.asarray(view, np.float64)), rows.rays_of_ends(eye_rays(projection)[0])
    counts, out, turn = rows.rays[rows.edge], [], 0.0
    for i, one in enumerate(shadow.views):
        matrix = (one.matrix @ into)[:3, :3]
        first, last = (end @ matrix.T for end in ends)
        length = np.linalg.norm(last[:, :2], axis=1)
        along = np.where(length[:, None] > 1e-9, last[:, :2] / np.maximum(length, 1e-30)[:, None], [1.0, 0.0])
        pace = (first[:, :2] * along).sum(axis=1)
        own = np.zeros(len(first), ROW)
        own["ends"] = np.column_stack([pace, first[:, 2], length, last[:, 2]])
        own["along"], own["begin"], own["end"], own["rays"], own["map"] = along, rows.begin, rows.end, counts, i
        turn += float((last[:, 2] * pace - first[:, 2] * length).sum())
        out.append(own)
    return np.concatenate(out), turn > 0


def _stop(one: Any, view: Any, side: int) -> float:
    """Measures, texels, from the eye to the farthest corner of a shadow view's map."""
    x, y = (one.matrix @ np.linalg.inv(view))[:2, 3]
    return math.hypot(max(abs(x), abs(side - x)), max(abs(y), abs(side - y)))


class VisibilityTables:
    """Adds the light of those lights that go by tables, at the picture's size.

    layer, transmittance: textures of the march, that are written. alone: whether there are no others, and none that goes by steps has to be
    summed before: then transmittance is written too. below: the texture from which the sum of those that go by steps is read. tables: of
    the lights, in their order, of which the first `count` are in use.
    """

    def __init__(self, device: Device, pixels: tuple[int, int], layer: Any, transmittance: Any) -> None:
        self.device, self.pixels, self.layer, self.transmittance = device, pixels, layer, transmittance
        self.frame = device.buffer(size=FRAME.itemsize, uniform=True)
        self.count, self.alone = 0, False
        self._other: Any = None
        self.tables: list[SunTable | LampTable] = []
        self._told = False

    @property
    def below(self) -> Any:
        """Chooses where the march without tables writes: the layer itself where there are none."""
        return self.layer if self.count % 2 == 0 else self._other

    def update(self, view: Any, projection: Any, lights: Sequence[Lit], medium: ResolvedMedium, panes: bool = False) -> Sequence[Lit]:
        """Sets what the next `record` sees, as March.update; returns the lights that go by steps."""
        self.count, self.alone = 0, False
        if medium.table is None:
            return lights
        others, room, why = [], BUDGET, None
        flat = bool(eye_rays(projection)[1])
        eye = np.linalg.inv(np.asarray(view, np.float64))[:3, 3]
        for light, shadow in lights:
            if light.fade(eye, medium) == 0:
                continue
            refused = refusal(light, shadow, medium, flat, panes)
            if refused is None and shadow is not None:
                table = self._table(SunTable if light.directional else LampTable)
                around = POINT_FINENESS if light.flags.get("CUBE") else SPOT_FINENESS
                fineness = (FINENESS if light.directional else around)[medium.table]
                used = table.update(view, projection, light, shadow, medium, fineness, room)
                if used:
                    room -= used
                    self.count += 1
                    continue
                refused = f"for pictures and maps that need no more than {BUDGET >> 20} MB"
            why = why or refused
            others.append((light, shadow))
        del self.tables[self.count :]
        if why is not None and medium.march.steps == "table" and not self._told:
            self._told = True
            warn(f"a table of visibility is {why}: other light goes by steps")
        self.alone = self.count > 0 and not others
        if self.count > 1 or (self.count and others):
            if self._other is None:
                self._other = self.device.texture(*self.pixels, "rgba32float")
        else:
            self._other = None
        if self.count:
            self.device.queue.write_buffer(self.frame, 0, frame_record(view, projection, medium, self.pixels, self.pixels).tobytes())
        return others

    def _table(self, kind: type[SunTable] | type[LampTable]) -> SunTable | LampTable:
        """Keeps the table that is next in order, or makes one if it is of another kind."""
        if self.count == len(self.tables) or type(self.tables[self.count]) is not kind:
            self.tables[self.count : self.count + 1] = [kind(self.device, self.pixels)]
        return self.tables[self.count]

    def record(self, encoder: Any, depth: Any, nothing: Any, timer: Timer | None = None) -> None:
        """Records the tables, and adds their light to what is `below`. nothing: a texture that is bound where nothing is read."""
        for i, table in enumerate(self.tables[: self.count]):
            begins = i == 0 and self.alone
            target, before = (self.layer, self._other) if (self.count - i) % 2 else (self._other, self.layer)
            last = self.alone and i == self.count - 1
            textures = nothing if begins else before, target, self.transmittance
            table.record(encoder, self.frame, depth, textures, begins, last, timer)
