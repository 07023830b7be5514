"""The panel: Dear ImGui widgets, most of them made from the declared parameters. It draws a ViewerState, and changes it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from imgui_bundle import imgui
from wgpu.utils.imgui import ImguiRenderer

from airlight.jobs.light_text import OF_MEDIUM
from airlight.lights import IMAGE_LIGHT_KINDS
from airlight.options import presets
from airlight.scatter.methods import METHODS
from airlight.viewer import state as st
from airlight.viewer.command import as_text, command_line
from airlight.viewer.light_rows import LightRows
from airlight.viewer.state import ViewerState
from airlight.viewer.style import set_style

WIDTH = 344  # logical px
FIRST = ("shafts", "medium")  # groups that stand at the top, open
TITLES = {"scene": "Shafts in the scene", "look": "Look"}
AUTO = "auto"  # a kind of light that is told by what is there
HINT = "Drag the ring. Space: before. Ctrl+S: save. Ctrl+Z: undo."
DIM = (0.55, 0.58, 0.62, 1.0)
OWN = "own"  # a medium that is none of those that come with Airlight


class Panel(LightRows):
    """Draws the panel of a state onto a canvas, over what is there."""

    def __init__(self, device: Any, canvas: Any, state: ViewerState) -> None:
        super().__init__(state)
        self.visible = True
        self.listing = False  # whether a list or a palette is open, which may reach beyond the panel
        self.overlay: Callable[[Any], None] = lambda draw: None  # draws on the picture, below the panel
        self.renderer = ImguiRenderer(device, canvas)
        self.renderer.set_gui(self._draw)
        imgui.set_current_context(self.renderer.imgui_context)
        set_style()

    def use_clipboard(self, copy: Callable[[str], Any], paste: Callable[[], str]) -> None:
        """Let the panel's text fields copy to, and paste from, the clipboard that there is."""
        imgui.set_current_context(self.renderer.imgui_context)
        platform = imgui.get_platform_io()
        platform.platform_set_clipboard_text_fn = lambda _, text: copy(text)
        platform.platform_get_clipboard_text_fn = lambda _: paste()

    @property
    def width(self) -> float:
        """Measure the part of the canvas that the panel takes, logical px."""
        return WIDTH if self.visible else 0

    def render(self) -> None:
        self.renderer.render()

    @property
    def busy(self) -> bool:
        """Tell whether the panel is being used: it then follows each frame."""
        imgui.set_current_context(self.renderer.imgui_context)
        return bool(imgui.is_any_item_active())

    def claim(self, at: tuple[float, float]) -> None:
        """Decide whose a press is: Dear ImGui would go by where the pointer was in the last frame, which may be long ago."""
        if not self.listing:
            self.renderer.backend.io.want_capture_mouse = bool(at[0] < self.width)

    # sections

    def _draw(self) -> None:
        self.places.clear()
        self.overlay(imgui.get_background_draw_list())
        self.listing = imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
        if not self.visible:
            return
        height = imgui.get_io().display_size.y
        imgui.set_next_window_pos((0, 0))
        imgui.set_next_window_size((WIDTH, height))
        fixed = imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_title_bar
        still = imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_scroll_with_mouse
        imgui.begin("Airlight", None, fixed | still | imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_saved_settings)
        foot = 0.0
        message = self.state.message or self.state.doubt
        if message:
            wide = imgui.get_content_region_avail().x
            foot = imgui.calc_text_size(message, wrap_width=wide).y + 3 * imgui.get_style().item_spacing.y
        imgui.begin_child("all", (0, -foot))
        self._tools()
        if self.state.is_smart:
            self._smart()
        else:
            self._all()
        self._settings()
        self._times()
        imgui.end_child()
        if message:
            imgui.separator()
            color = (1.0, 0.45, 0.38, 1.0) if self.state.is_error else (0.72, 0.76, 0.8, 1.0)
            imgui.push_style_color(imgui.Col_.text, color)
            imgui.text_wrapped(message)
            imgui.pop_style_color()
            self._seen("message")
        imgui.end()

    def _tools(self) -> None:
        """Draw what is there whatever is shown."""
        s = self.state
        gap = imgui.get_style().item_spacing.x
        third = (imgui.get_content_region_avail().x - 2 * gap) / 3
        if self._button("choose", "Open ...", third):
            s.requests.append(("choose", ""))
        for request, text, there in (("undo", "Undo", s.can_undo), ("redo", "Redo", s.can_redo)):
            imgui.same_line()
            imgui.begin_disabled(not there)
            if self._button(request, text, third):
                s.requests.append((request, ""))
            imgui.end_disabled()
        imgui.spacing()

    def _smart(self) -> None:
        """Draw what a picture with the smart look needs: little of it open."""
        s = self.state
        for d in st.shown(s):
            if d.name in st.FIRST_LOOK:
                self._parameter(d)
        imgui.spacing()
        self._compared()
        imgui.same_line()
        s.candidates_shown = self._toggle("candidates", "Candidates", s.candidates_shown)
        if self._button("save picture", "Save picture", -1):
            s.requests.append(("save", ""))
        imgui.push_style_color(imgui.Col_.text, DIM)
        imgui.text_wrapped(HINT)
        imgui.pop_style_color()
        self._lights(opened=False)
        self._look()
        self._source(opened=False)
        self._view(opened=False)

    def _all(self) -> None:
        """Draw what a scene needs, or a picture whose shafts are the sum's."""
        groups = dict.fromkeys(d.group for d in st.shown(self.state) if d.group != "look")
        for group in groups:
            if group in FIRST:
                self._group(group, opened=True)
        self._source(opened=True)
        self._lights(opened=True)
        for group in groups:
            if group not in FIRST:
                self._group(group, opened=False)
        if self.state.is_image:
            self._look()
        self._view(opened=True)

    def _compared(self) -> None:
        """Draw whether there are shafts, and the picture without them beside."""
        s = self.state
        s.shafts = self._toggle("shafts", "Shafts" if s.is_smart else "##shafts", s.shafts)
        if s.is_image:
            imgui.same_line()
            split = self._toggle("split", "Before | after" if s.is_smart else "before | after", s.split is not None)
            s.split = (s.split or 0.5) if split else None

    def _look(self) -> None:
        """Draw the rest of the look, and which one it is."""
        s = self.state
        if not self._header("More of the look" if s.is_smart else "Look", False):
            return
        self._label("Look", "smart: shafts in the light's colour that stand out; classic: the sum of GPU Gems 3, with all its parameters")
        chosen = self._choose("look", "smart" if s.is_smart else "classic", ("smart", "classic"))
        for d in st.shown(s):
            if s.is_smart and d.name != "look" and d.name not in st.FIRST_LOOK:
                self._parameter(d)
        if s.is_smart and self._button("reset look", "Reset to defaults##look", -1):
            st.reset(s, "look")
        if chosen:
            s.debug = None
            st.change(s, "look", chosen)

    def _group(self, group: str, opened: bool) -> None:
        if not self._header(TITLES.get(group, group.capitalize()), opened):
            return
        if group == "medium":
            self._medium()
        for d in st.shown(self.state):
            if d.group == group:
                self._parameter(d)
        if self._button(f"reset {group}", f"Reset to defaults##{group}", -1):
            st.reset(self.state, group)

    def _medium(self) -> None:
        self._label("Medium", "stuff that comes with Airlight: how much light it takes, and where to it scatters it")
        chosen = self._choose("medium", st.medium(self.state) or OWN, (OWN, *st.media()))
        if chosen:
            st.load_medium(self.state, "" if chosen == OWN else chosen)

    def _source(self, opened: bool) -> None:
        s = self.state
        wanted, s.path_wanted = s.path_wanted, False
        if wanted:
            imgui.set_next_item_open(True)
        if not self._header("Picture" if s.is_image else "Scene", opened):
            return
        self._label("Show")
        names = {s.received.get(source, source): source for source in s.sources}
        chosen = self._choose("source", s.received.get(s.source, Path(s.source).name), tuple(names))
        if chosen:
            s.requests.append(("open", names[chosen]))
        if s.has_paths:
            self._path(wanted)
        if s.is_image:
            return
        if len(s.eye.names) > 1:
            self._label("Camera")
            name = self._choose("camera", s.eye.name, s.eye.names)
            if name:
                s.eye.name, s.eye.moved = name, False
        self._label("Steer", "orbit: drag, wheel, right button to pan; fly: w a s d, space, shift, q e, drag to look")
        mode = self._choose("steer", "fly" if s.eye.fly else "orbit", ("orbit", "fly"))
        if mode:
            s.eye.fly = mode == "fly"
        if s.path_drawn is not None:
            self._label("Path")
            s.path_drawn = self._toggle("path drawn", "##path drawn", s.path_drawn)
        if s.duration:
            self._label("Time")
            if self._button("play", "Pause" if s.playing else "Play", 56):
                s.playing = not s.playing
            imgui.same_line()
            imgui.set_next_item_width(-1)
            changed, v = imgui.slider_float("##time", s.time, 0, s.duration, "%.2f s")
            self._seen("time")
            if changed:
                s.time, s.playing = min(max(v, 0.0), s.duration), False

    def _path(self, wanted: bool) -> None:
        """Draw a field for a path to open. wanted: the keys go there."""
        s = self.state
        self._label("Open")
        imgui.set_next_item_width(-52)
        if wanted:
            imgui.set_keyboard_focus_here()
        s.path = self._text("path", s.path, "picture, .glb, .gltf, .obj, .vdb ...")
        imgui.same_line()
        if self._button("open", "Open", -1) and s.path:
            s.requests.append(("open", s.path))

    def _lights(self, opened: bool) -> None:
        s = self.state
        if not s.lights or not self._header("Light", opened):
            return
        for i, control in enumerate(s.lights):
            if len(s.lights) > 1:
                imgui.text_disabled(f"{i + 1}")
            imgui.push_id(i)
            if control.movable:
                self._label("Towards" if control.direction else "Position", "also by dragging it in the picture")
                if len(control.position) == 2:
                    changed, place = imgui.drag_float2("##place", list(control.position), 0.002, -10, 10, "%.3f")
                else:
                    changed, place = imgui.drag_float3("##place", list(control.position), 0.01, -1e4, 1e4, "%.2f")
                self._seen(f"light {i}")
                if changed:
                    st.move(s, i, tuple(place))
            has_units = METHODS[s.parameters.method].has_units and not s.is_image
            if control.aim is not None:
                self._projector(i, control)
            if control.takes_cookie and has_units:
                self._cookie(i, control)
            if control.aim is not None:
                imgui.pop_id()
                continue
            if s.is_smart:
                self._label("Kind", "a disc, an opening, a glow, lamps, or a light beyond the frame; auto: told by what is there")
                kind = self._choose(f"kind {i}", control.kind or AUTO, (AUTO, *IMAGE_LIGHT_KINDS))
                if kind:
                    control.kind = None if kind == AUTO else kind
            self._label("Colour", "white: the picture's own" if s.is_smart else "")
            changed, color = imgui.color_edit3("##color", list(control.color), imgui.ColorEditFlags_.float)
            self._seen(f"color {i}")
            if changed:
                control.color = (round(color[0], 3), round(color[1], 3), round(color[2], 3))
            self._label("Strength")
            changed, strength = imgui.slider_float("##strength", control.strength, 0, 4, "%.2f")
            self._seen(f"strength {i}")
            if changed:
                control.strength = float(f"{min(max(strength, 0), 1e6):.4g}")
            for name in OF_MEDIUM if has_units else ():
                self._label(name.capitalize(), "times the medium's, for this light alone: artistic")
                changed, factor = imgui.slider_float(f"##{name}", getattr(control, name), 0, 4, "%.2f")
                self._seen(f"{name} {i}")
                if changed:
                    setattr(control, name, float(f"{min(max(factor, 0), 1e6):.4g}"))
            imgui.pop_id()

    def _view(self, opened: bool) -> None:
        s = self.state
        wanted, s.command_wanted = s.command_wanted, False
        if wanted:
            imgui.set_next_item_open(True)
        if not self._header("View", opened):
            return
        if not s.is_smart:
            self._label("Shafts")
            self._compared()
        self._label("Debug", "what emits" if s.is_smart else "what emits, the light that is summed, or the lines along which it is")
        chosen = self._choose("debug", s.debug or "none", ("none", *(st.DEBUG_LOOK if s.is_smart else st.DEBUG)))
        if chosen:
            s.debug = None if chosen == "none" else chosen
        half = (imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2
        if self._button("screenshot", "Screenshot", half):
            s.requests.append(("screenshot", ""))
        imgui.same_line()
        if self._button("copy", "Copy command", -1):
            s.requests.append(("copy", ""))
        if s.is_image and not s.is_smart and self._button("save picture", "Save picture", -1):
            s.requests.append(("save", ""))
        if s.command:
            s.command = as_text(command_line(s))
            imgui.set_next_item_width(-1)
            imgui.input_text("##command", s.command, imgui.InputTextFlags_.read_only)
            self._seen("command")
            if wanted and not imgui.is_item_visible():
                imgui.set_scroll_here_y()

    def _settings(self) -> None:
        s = self.state
        if not self._header("Presets and settings", False):
            return
        self._label("Preset")
        chosen = self._choose("preset", s.preset or "none", ("none", *presets.names()))
        if chosen == "none":
            st.reset(s)
        elif chosen:
            st.load(s, chosen)
        self._label("File")
        s.file = self._text("file", s.file, "settings.toml")
        half = (imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2
        if self._button("save", "Save", half):
            st.save(s, s.file)
        imgui.same_line()
        if self._button("load", "Load", -1):
            st.load(s, s.file)

    def _times(self) -> None:
        s = self.state
        if not self._header("Times", False):
            s.timing = False
            return
        s.timing = True
        if not s.passes:
            imgui.text_disabled("no pass was timed yet")
        elif imgui.begin_table("passes", 2, imgui.TableFlags_.row_bg):
            imgui.table_setup_column("pass", imgui.TableColumnFlags_.width_stretch)
            imgui.table_setup_column("ms", imgui.TableColumnFlags_.width_fixed)
            for label, ms in (*s.passes, ("all", sum(ms for _, ms in s.passes))):
                imgui.table_next_row()
                imgui.table_next_column()
                imgui.text_unformatted(label)
                imgui.table_next_column()
                imgui.text_unformatted(f"{ms:7.2f} ms")
            imgui.end_table()
            self._seen("passes")
