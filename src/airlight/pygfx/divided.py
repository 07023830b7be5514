"""A renderer of pygfx that draws onto a texture instead of its canvas, if it has one, and in parts where work is carried out in slices."""

import contextlib
from collections.abc import Iterator
from typing import Any

import pygfx as gfx

from airlight.gpu.device import Device
from airlight.gpu.slices import current, parts


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

    def __init__(self, flat: Any, recorder: Recorder) -> None:
        self.flat, self.recorder = flat, recorder

    def __getattr__(self, name: str) -> Any:
        return getattr(self.flat, name)

    def iter_render_pipelines_per_pass_type(self) -> Iterator[tuple[str, Any]]:
        for kind, containers in self.flat.iter_render_pipelines_per_pass_type():
            if kind == "weighted":  # resolved after its pass
                yield kind, containers
                continue
            drawn = list(containers)
            for first, count in parts(len(drawn)):
                yield kind, drawn[first : first + count]
                self.recorder.last.divide()


class DividedRenderer(gfx.WgpuRenderer):  # type: ignore[misc]
    """Draws what its base draws: onto `texture`, and a slice at a time in work of `gpu.slices`.

    Touches _device, _canvas_context and _render_recording, which takes (renderstate, flat, viewport).
    """

    _canvas_context: Any
    _device: Any
    texture: Any = None
    recorder: Recorder | None = None

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
            return super()._render_recording(renderstate, _Parts(flat, recorder), viewport)

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
