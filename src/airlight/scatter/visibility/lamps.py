"""Plans and records tables of visibility for spots and points: counts of lit samples, their sums, and the look-up of each pixel."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, compute
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import eye_rays
from airlight.scatter.march.records import light_record
from airlight.scatter.visibility.base import FOLDER, GROUP, Table
from airlight.scatter.visibility.grid import Fineness, RowGrid, row_grid
from airlight.shadows import Shadow

Array = npt.NDArray[Any]
ENDS, BITS, TABLE, FULL, APPLY, CORE = (f"{FOLDER}/lamp_{name}.wgsl" for name in ("ends", "bits", "table", "full", "apply", "core"))
LAMP, ROW = (struct_dtype(f"{FOLDER}/lamps.wgsl", name) for name in ("Lamp", "LampRow"))
SAMPLES = 15  # of a block, as in counters.wgsl
FULL_SIDE, FULL_GROUP = 128, 8  # as in in_full.wgsl, lamp_full.wgsl
SUMS_GROUP = 16  # as in lamp_table.wgsl
CORE_RADIUS_PX, CORE_STEPS = 3.5, 256  # around the lamp, in which pixels go by steps: one workgroup
OPPOSITE_RADIUS_PX, OPPOSITE_SHARE, OPPOSITE_STEPS = 40.0, 1 / 32, 128  # around where a lamp behind is opposite; of the picture's width
LEAST_AWAY = 1e-6  # m, from the eye


class LampTable(Table):
    """Holds one lamp's table, and what it scatters where all is lit, `full`."""

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        super().__init__(device, pixels)
        self._lamp = device.buffer(size=LAMP.itemsize, uniform=True)
        self.lamp = np.zeros((), LAMP)  # of the last update
        self.full = device.texture(FULL_SIDE, FULL_SIDE, "rgba16float")
        self._own: dict[str, dict[str, Any]] = {}  # constants of each shader

    def update(
        self, view: Any, projection: Any, light: PunctualLight, shadow: Shadow, medium: ResolvedMedium, fineness: Fineness, room: int
    ) -> int:
        """Sets what the next `record` sees, as SunTable.update."""
        data = light_record(light, shadow, view, medium)
        place = np.asarray(light.in_view(np.asarray(view, np.float64)), float)
        away = max(float(np.linalg.norm(place)), LEAST_AWAY)
        towards = place / away if np.linalg.norm(place) >= LEAST_AWAY else np.array([0.0, 0.0, -1.0])
        rows = row_grid(towards, eye_rays(projection)[0], self.pixels, fineness.of_picture(self.pixels))
        colours = bool(np.ptp(medium.sigma_t) > 0)
        step = 2 if colours else 3
        layers = -(-fineness.blocks // step)
        blocks = layers * step
        total = self._fit(rows, len(rows.begin), blocks, layers, ROW.itemsize, room)
        if total == 0:
            return 0
        records, rises = _row_records(rows, towards, projection)
        axis = np.asarray(data["axis"], float)
        cone = math.acos(min(max(float(data["cone_cosine"]), -1.0), 1.0)) if "CONE" in light.flags else None
        begin, end = angles(records, away, towards, medium.max_distance, axis, cone)
        wide = (end - begin) / blocks
        _set_cones(records, towards, axis, cone, begin, wide, blocks)
        out = self.lamp = np.zeros((), LAMP)
        out["towards"], out["away"], out["begin"], out["end"] = towards, away, begin, end
        out["wide"], out["blocks"] = wide, blocks
        out["power"] = medium.sigma_s * data["intensity"] * np.exp(-medium.sigma_t * away)
        out["turn"] = math.cos(wide / SAMPLES), math.sin(wide / SAMPLES)
        write = self.device.queue.write_buffer
        write(self._lamp, 0, out.tobytes())
        write(self._grid, 0, self._grid_record(rows, len(rows.begin), layers, medium).tobytes())
        write(self._light, 0, data.tobytes())
        write(self.buffers["rows"], 0, records.tobytes())
        self._divide(rows)
        self.counts = blocks, 1
        opposite = towards[2] >= 0
        radius = min(OPPOSITE_RADIUS_PX, OPPOSITE_SHARE * self.pixels[0]) if opposite else CORE_RADIUS_PX
        self._core_groups = self._place_core(rows, radius)
        self._shadow = shadow.texture
        phase, shades = {"PHASE": medium.lobes(light.anisotropy)[0]}, {"COLOURS": colours}
        flags = {name: True for name in ("CONE", "CUBE") if light.flags.get(name)}
        dense = {"DENSER": True}
        self._own = {
            BITS: {"STEP": step, "RISES": rises, "BIASED": bool(medium.march.shadow_bias), **flags, **dense},
            # Around a lamp one often sees the dark side of things, close before where it shines
            TABLE: {**phase, **shades, **flags, "WARY": True, "RANGED": bool(data["range"] > 0)},
            FULL: phase,
            CORE: {**phase, **flags, "CORE_STEPS": OPPOSITE_STEPS if opposite else CORE_STEPS, "BIASED": bool(medium.march.shadow_bias)},
            APPLY: {**shades, **dense, "AMBIENT": bool(medium.ambient.any())},
        }
        return total

    def record(
        self, encoder: Any, frame: Any, depth: Any, textures: tuple[Any, Any, Any], first: bool, last: bool, timer: Timer | None
    ) -> None:
        """Records the table, and adds its light to what was before, as SunTable.record."""
        before, target, transmittance = textures
        b = self.buffers
        common = frame, self._light, depth, self._shadow, before

        def run(path: str, entry: str, label: str, key: Any, held: Sequence[Any], counts: tuple[int, ...], **constants: Any) -> None:
            pipeline = self.device.pipeline(path, entry, **self._own.get(path, {}), **constants)
            to = target if path in (APPLY, CORE) else transmittance
            compute(encoder, pipeline, self._bound((path, key), path, *common, to, self._grid, *held, self._lamp), counts, label, timer)

        rows = sum(count for _, count, _ in self._dispatches)
        spread = self._record_farthest(encoder, (*common, transmittance, self._grid), before, timer)
        run(ENDS, "ends", "table ends", 0, (b["rows"], b["ray_ends"], b["word_ends"], spread), (-(-rows // GROUP),))
        for k, count, words in self._dispatches:
            bound = (b["rows"], b["word_ends"], b["planes"], self._parts[k], self.device.sampler("nearest"))
            run(BITS, "count", "table bits", k, bound, (-(-count // GROUP), self.counts[0]), WORDS=words)
        for k, count, words in self._dispatches:
            held = b["rows"], b["word_ends"], b["planes"], self._parts[k], b["ray_ends"], self.atlas
            run(TABLE, "accumulate", "table sums", k, held, (-(-count // SUMS_GROUP), 4 * words))
        run(FULL, "fill", "table in full", 0, (self.full,), (FULL_SIDE // FULL_GROUP,))
        counts = -(-self.pixels[0] // GROUP), self.pixels[1]
        looked_up = self.atlas, self.device.sampler(), transmittance, self.full
        run(APPLY, "apply", "table look-up", first, looked_up, counts, LAST=last, FIRST=first)
        if self._core_groups[0]:
            run(CORE, "step_core", "table core", first, (self._core, self.device.sampler("nearest")), self._core_groups, FIRST=first)


def _row_records(rows: RowGrid, towards: Array, projection: Any) -> tuple[np.ndarray, bool]:
    """Fills a ROW for each row, but for where its cone is; tells whether rays come to lie towards the lamp along them."""
    first, last = rows.rays_of_ends(eye_rays(projection)[0])
    across = last - (last @ towards)[:, None] * towards
    across /= np.maximum(np.linalg.norm(across, axis=1), 1e-30)[:, None]
    own = np.zeros(len(first), ROW)
    ends = np.column_stack([(first * across).sum(axis=1), first @ towards, (last * across).sum(axis=1), last @ towards])
    own["ends"], own["across"] = ends, across
    own["begin"], own["end"], own["rays"] = rows.begin, rows.end, rows.rays[rows.edge]
    turn = float((ends[:, 3] * ends[:, 0] - ends[:, 1] * ends[:, 2]).sum())
    return own, turn > 0


def angles(records: Array, away: float, towards: Array, reach: float, axis: Array, cone: float | None) -> tuple[float, float]:
    """Bounds the angles at a lamp at which rays of up to `reach` m meet its light: (begin, end). away: m; cone: half angle, None: none."""
    across = np.maximum(np.concatenate([records["ends"][:, 0], records["ends"][:, 2]]).astype(float), 0)
    ahead = np.concatenate([records["ends"][:, 1], records["ends"][:, 3]]).astype(float)
    long = np.hypot(across, ahead)
    begin, end = 0.0, float(np.arctan2(reach * across / long, away - reach * ahead / long).max())
    end = min(end * 1.01 + 1e-4, math.pi)
    if cone is not None:
        off = math.acos(min(max(float(-axis @ towards), -1.0), 1.0))
        begin, end = min(max(off - cone, 0.0), end - 1e-4), min(end, off + cone)
    return begin, max(end, begin + 1e-4)


def _set_cones(records: Array, towards: Array, axis: Array, cone: float | None, begin: float, wide: float, blocks: int) -> None:
    """Sets between which blocks rows meet the light's cone."""
    across, along = records["across"].astype(float) @ axis, float(axis @ towards)
    records["axis"] = np.column_stack([across, np.full(len(across), along)])
    records["blocks"] = 0, blocks
    if cone is None:
        return
    most = np.hypot(across, along)
    middle = np.arctan2(across, -along)
    half = np.arccos(np.clip(math.cos(cone) / np.maximum(most, 1e-9), -1, 1))
    half = np.where(most < 1e-9, math.pi * (cone > math.pi / 2), half)
    low, high = (middle - half - begin) / wide, (middle + half - begin) / wide
    # A wide cone may hold the far side of the circle of directions
    round_about = (low + begin / wide < 0) & (high * wide + begin > math.pi) | (middle + half > 2 * math.pi) | (middle - half < -math.pi)
    records["blocks"] = np.column_stack([np.where(round_about, 0, low), np.where(round_about, blocks, high)])
