"""Rows of the panel for what shapes a scene's light: of a projector its aim and frustum, and cookies."""

import os

from imgui_bundle import imgui

from airlight.lights.projector import FALLOFFS, LIMITS
from airlight.viewer import state as st
from airlight.viewer.rows import Rows
from airlight.viewer.state import LightControl

MOST_CANDELA = 1e9  # typed; sliders go to ten thousand
MOST_SIZE = 1e6  # m, of a cookie


class LightRows(Rows):
    """Draws them for the lights of a state."""

    def _projector(self, i: int, control: LightControl) -> None:
        """Draw where a projector aims, its colour, intensity, angles and falloff."""
        assert control.aim is not None and control.fov is not None
        self._label("Aim", "where it shines to; also by dragging its cross in the picture")
        changed, place = imgui.drag_float3("##aim", list(control.aim), 0.01, -1e4, 1e4, "%.2f")
        self._seen(f"aim {i}")
        if changed:
            st.aim(self.state, i, tuple(place))
        self._label("Colour")
        changed, color = imgui.color_edit3("##color", list(control.color), imgui.ColorEditFlags_.float)
        self._seen(f"color {i}")
        if changed:
            control.color = (round(color[0], 3), round(color[1], 3), round(color[2], 3))
        self._label("Intensity", "on its axis, of surfaces and air (cd)")
        changed, v = imgui.slider_float("##intensity", control.intensity, 1, 1e4, "%.4g", imgui.SliderFlags_.logarithmic)
        self._seen(f"intensity {i}")
        if changed:
            control.intensity = float(f"{min(max(v, 0), MOST_CANDELA):.4g}")
        self._label("Angles", "of its frustum, across and up (degrees)")
        changed, angles = imgui.slider_float2("##angles", list(control.fov), 1, 170, "%.1f")
        self._seen(f"fov {i}")
        if changed:
            low, high = LIMITS["fov"]
            across, along = (float(f"{min(max(v, low), high):.4g}") for v in angles)
            control.fov = across, along
        self._label("Falloff", "with the distance; only inverse-square is physical")
        chosen = self._choose(f"falloff {i}", control.falloff, FALLOFFS)
        if chosen:
            control.falloff = chosen

    def _cookie(self, i: int, control: LightControl) -> None:
        """Draw which picture a light sends out, and what chooses one."""
        s = self.state
        self._label("Cookie", "a picture that it sends out, also called gobo; any image will do")
        gap = imgui.get_style().item_spacing.x
        shown = os.path.basename(s.received.get(control.gobo, control.gobo)) or "Choose ..."
        if self._button(f"cookie {i}", f"{shown}##cookie", imgui.get_content_region_avail().x - 52 - gap):
            s.requests.append(("choose cookie", str(i)))
        imgui.same_line()
        imgui.begin_disabled(not control.gobo)
        if self._button(f"own cookie {i}", "Own##cookie", -1):
            control.gobo = ""
        imgui.end_disabled()
        if s.has_paths:
            self._label("")
            imgui.set_next_item_width(-52 - gap)
            s.cookie_paths[i] = self._text(f"cookie path {i}", s.cookie_paths.get(i, ""), "gobo.png ...")
            imgui.same_line()
            if self._button(f"load cookie {i}", "Load##cookie", -1) and s.cookie_paths[i]:
                s.requests.append(("cookie", f"{i}:{s.cookie_paths[i]}"))
        if control.direction and control.gobo:
            self._label("Width", "of its picture, which repeats (m)")
            changed, v = imgui.slider_float("##size", control.gobo_size, 0.01, 100, "%.3g", imgui.SliderFlags_.logarithmic)
            self._seen(f"cookie size {i}")
            if changed:
                control.gobo_size = float(f"{min(max(v, 1e-3), MOST_SIZE):.4g}")
