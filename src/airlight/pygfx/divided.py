"""A renderer of pygfx that draws onto a texture instead of its canvas, if it has one, and in parts where work is carried out in slices."""

import contextlib
from collections.abc import Iterator
from typing import Any

import pygfx as gfx

from airlight.gpu.device import Device
from airlight.gpu.slices import current, parts
from airlight.pygfx import private


class Recorder:
    """Stands in for a renderer's device: its encoders are ours, which can be divided. last: the one that was made last."""

    def __init__(self, device: Device) -> None:
        self.device, self.last = device, device.encoder()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.device.device, name)

    def create_command_encoder(self) -> Any:
        self.last = self.device.encoder()
        return self.last


class _Parts:
    """Stands in for pygfx's list of what is drawn: a pass is divided into several, with the same pixels."""

    def __init__(self, flat: Any, recorder: Recorder, size: tuple[int, int]) -> None:
        self.flat, self.recorder, self.size = flat, recorder, size

    def __getattr__(self, name: str) -> Any:
        return getattr(self.flat, name)

    def iter_render_pipelines_per_pass_type(self) -> Iterator[tuple[str, Any]]:
        for kind, containers in self.flat.iter_render_pipelines_per_pass_type():
            if kind == "weighted":  # resolved after its pass
                yield kind, containers
                continue
            drawn = list(containers)
            for first, count in parts(len(drawn), kind=("surfaces", self.size)):
                yield kind, drawn[first : first + count]
                self.recorder.last.divide()


class DividedRenderer(gfx.WgpuRenderer):  # type: ignore[misc]
    """Draws what its base draws: onto `texture`, and a slice at a time in work of `gpu.slices`.

    Touches _device, _canvas_context, _name_of_texture_with_effects and _render_recording, which takes (renderstate, flat, viewport).
    """

    _canvas_context: Any
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
