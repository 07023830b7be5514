"""A renderer of pygfx that draws onto a texture instead of its canvas, if it has one, and in parts where work is carried out in slices."""

import contextlib
from collections.abc import Iterator
from typing import Any

import pygfx as gfx

from airlight.gpu.device import Device, Recording
from airlight.gpu.slices import Watched, current, parts
from airlight.pygfx import private

MOST_BANDS = 16  # of a picture's rows, that are drawn one after the other where that is told
BAND_PIXELS = 2**20  # about 0.15 s on software Vulkan, and at least that many
VERTEX_PIXELS = 10  # pixels of a band, for each vertex at least: they are placed again for every band


def bands(height: int, pixels: int, count: int) -> list[tuple[int, int]]:
    """Divide the rows of a picture of so many pixels into (first, number), from all over it. count: of vertices."""
    most = min(MOST_BANDS, height, pixels // max(BAND_PIXELS, VERTEX_PIXELS * count))
    edges = [height * i // most for i in range(most + 1)] if most > 1 else [0, height]
    order = sorted(range(len(edges) - 1), key=lambda i: f"{i:016b}"[::-1])
    return [(edges[i], edges[i + 1] - edges[i]) for i in order]


class _Banded(Recording):
    """Draws in a band (x, y, width, height) alone, where there is one."""

    band: tuple[int, int, int, int] | None = None

    def begin_render_pass(self, **given: Any) -> Any:
        run = self._encoder.begin_render_pass(**given)
        if self.band is not None:
            run.set_scissor_rect(*self.band)
        return run


class Recorder:
    """Stands in for a renderer's device: its encoders are ours, which can be divided. last: the one that was made last."""

    def __init__(self, device: Device) -> None:
        self.device, self.last = device, _Banded(device)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.device.device, name)

    def create_command_encoder(self) -> Any:
        self.last = _Banded(self.device)
        return self.last


class _Parts:
    """Stands in for pygfx's list of what is drawn: a pass is divided into several, with the same pixels."""

    def __init__(self, flat: Any, recorder: Recorder, size: tuple[int, int]) -> None:
        self.flat, self.recorder, self.size = flat, recorder, size

    def __getattr__(self, name: str) -> Any:
        return getattr(self.flat, name)

    def iter_render_pipelines_per_pass_type(self) -> Iterator[tuple[str, Any]]:
        work = current()
        if isinstance(work, Watched) and work.drawing:
            yield from self._in_bands(work)
            return
        for kind, containers in self.flat.iter_render_pipelines_per_pass_type():
            if kind == "weighted":  # resolved after its pass
                yield kind, containers
                continue
            drawn = list(containers)
            for first, count in parts(len(drawn), kind=("surfaces", self.size)):
                yield kind, drawn[first : first + count]
                self.recorder.last.divide()

    def _in_bands(self, work: Watched) -> Iterator[tuple[str, Any]]:
        """Give all of what is drawn for each band, and tell how much is done."""
        passes = [(kind, list(containers)) for kind, containers in self.flat.iter_render_pipelines_per_pass_type()]
        width, height = self.size
        pixels = 0 if any(kind == "weighted" for kind, _ in passes) else width * height
        done = 0
        for first, rows in bands(height, pixels, sum(private.vertices(container) for _, drawn in passes for container in drawn)):
            self.recorder.last.band = (0, first, width, rows) if rows < height else None
            yield from passes
            self.recorder.last.divide()
            done += rows
            work.tell(done / height)
        self.recorder.last.band = None


class DividedRenderer(gfx.WgpuRenderer):  # type: ignore[misc]
    """Draws what its base draws: onto `texture`, and a slice at a time in work of `gpu.slices`.

    Touches _device, _canvas_context, _name_of_texture_with_effects and _render_recording, which takes (renderstate, flat, viewport).
    """

    _canvas_context: Any
    _device: Any
    texture: Any = None
    recorder: Recorder | None = None
    kept: Any = None  # a copy of what was drawn, before the effects
    kept_for: Any = None  # what it shows

    def show(self, scene: Any, camera: Any, key: Any) -> None:
        """Render, but put only the effects on what was drawn last, if the key says that it would be drawn the same."""
        key = key, self.physical_size
        if key != self.kept_for:
            if self.kept is None:
                private.use_copies(self)
            self.kept_for = None
            self.render(scene, camera, clear=True, flush=False)
            self._copy(private.drawn(self), None)
            self.kept_for = key
        else:
            self._copy(self.kept, private.drawn(self))
            self._name_of_texture_with_effects = None
        self.flush()

    def _copy(self, source: Any, onto: Any) -> None:
        """Copy a picture; onto None: onto the one that is kept."""
        if onto is None:
            if self.kept is None or self.kept.size != source.size:
                self.kept = self.device.create_texture(size=source.size, format=source.format, usage=source.usage)
            onto = self.kept
        encoder = self.device.create_command_encoder()
        encoder.copy_texture_to_texture({"texture": source}, {"texture": onto}, source.size)
        self.device.queue.submit([encoder.finish()])

    @property
    def device(self) -> Any:
        """Returns the wgpu device, also while a stand-in records: whoever makes resources, as effects do, is given no other."""
        return self._device.device.device if isinstance(self._device, Recorder) else self._device

    def get_current_texture(self) -> Any:
        """Give the texture, as a canvas's context would."""
        return self.texture

    def _render_recording(self, renderstate: Any, flat: Any, viewport: Any) -> Any:
        if current() is None:
            return super()._render_recording(renderstate, flat, viewport)
        with _Recording(self) as recorder:
            return super()._render_recording(renderstate, _Parts(flat, recorder, self.physical_size), viewport)

    def flush(self, target: Any = None) -> None:
        """Put the effects on what is drawn, and draw it onto the texture."""
        with contextlib.ExitStack() as restored, _Recording(self) as recorder:
            if self.texture is not None:
                restored.callback(setattr, self, "_canvas_context", self._canvas_context)
                self._canvas_context = self
            super().flush(target)
            if work := current():
                recorder.device.wait()
                work.pause()


class _Recording:
    """Lets a renderer record on encoders of ours for a while."""

    def __init__(self, renderer: Any) -> None:
        self.renderer, self.device = renderer, renderer._device

    def __enter__(self) -> Recorder:
        own = self.renderer.recorder
        if own is None:
            own = self.renderer.recorder = Recorder(Device(self.device))
        self.renderer._device = own
        return own

    def __exit__(self, *_: object) -> None:
        self.renderer._device = self.device
