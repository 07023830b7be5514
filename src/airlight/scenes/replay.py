"""One frame of a stage as pygfx hands it to the effect pass, to be carried out and timed again."""

from collections.abc import Callable
from typing import Any

from airlight.gpu.timing import run_ms
from airlight.scenes.offline import Frame, Studio


class Replay:
    """A studio whose last frame can be repeated: only the effect pass, over the picture and depth that it was given.

    The settings of `studio.shafts` may be changed in between.
    """

    def __init__(self, studio: Studio) -> None:
        self.studio, self.shafts = studio, studio.shafts
        self.textures: dict[str, Any] = {}

    def frame(self, *arguments: Any, **keywords: Any) -> Frame:
        """Film a frame as Studio.frame does, and keep what the pass is given there."""
        inner = self.shafts.render

        def render(command_encoder: Any, color_tex: Any, depth_tex: Any, target_tex: Any) -> None:
            self.textures.update(color_tex=color_tex, depth_tex=depth_tex, target_tex=target_tex)
            inner(command_encoder, color_tex, depth_tex, target_tex)

        self.shafts.render = render  # type: ignore[method-assign]
        try:
            return self.studio.frame(*arguments, **keywords)
        finally:
            del self.shafts.render  # the class's own again

    def record(self, encoder: Any) -> None:
        with self.studio.set_up():
            self.shafts.render(encoder, **self.textures)

    def spent(self, record: Callable[[Any], None] | None = None) -> tuple[float, dict[str, float]]:
        """Time one run of `record`, None: its own: (ms of wall time, ms of each pass by label); {} where the device has no timestamps."""
        self.shafts.timing = True
        try:
            whole = run_ms(self.shafts.device, record or self.record)
            passes: dict[str, float] = {}
            for label, ms in self.shafts.profile():
                passes[label] = passes.get(label, 0.0) + ms
        finally:
            self.shafts.timing = False
        return whole, passes
