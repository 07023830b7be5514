"""Rows of the panel: labels, buttons, lists, and a widget for each kind of declared parameter."""

from typing import Any

from imgui_bundle import imgui

from airlight.options import Option
from airlight.options.words import label
from airlight.viewer import state as st
from airlight.viewer.state import ViewerState

LABEL = 104  # logical px
Rect = tuple[float, float, float, float]


class Rows:
    """Draws rows of widgets for a state; `places` holds where each of them lies, (x0, y0, x1, y1) logical px."""

    def __init__(self, state: ViewerState) -> None:
        self.state = state
        self.places: dict[str, Rect] = {}

    def _seen(self, name: str) -> None:
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        self.places[name] = (low.x, low.y, high.x, high.y)

    def _label(self, text: str, about: str = "") -> None:
        imgui.align_text_to_frame_padding()
        imgui.text_unformatted(text)
        if about and imgui.is_item_hovered(imgui.HoveredFlags_.delay_normal):
            imgui.push_text_wrap_pos(320)
            imgui.set_tooltip(about)
            imgui.pop_text_wrap_pos()
        imgui.same_line(LABEL)
        imgui.set_next_item_width(-1)

    def _button(self, name: str, text: str, width: float = 0) -> bool:
        pressed = imgui.button(text, (width, 0))
        self._seen(name)
        return bool(pressed)

    def _choose(self, name: str, now: str, choices: tuple[str, ...]) -> str | None:
        """Draw a combo box; what was chosen, if it is another one."""
        chosen = None
        opened = imgui.begin_combo(f"##{name}", now, imgui.ComboFlags_.height_largest)
        self._seen(name)
        if opened:
            for choice in choices:
                if imgui.selectable(choice, choice == now)[0] and choice != now:
                    chosen = choice
                self._seen(f"{name}:{choice}")
            imgui.end_combo()
        return chosen

    def _toggle(self, name: str, text: str, on: bool) -> bool:
        _, on = imgui.checkbox(text, on)
        self._seen(name)
        return on

    def _header(self, name: str, opened: bool) -> bool:
        flags = imgui.TreeNodeFlags_.default_open if opened else 0
        shown = imgui.collapsing_header(f"{name}##{opened}", flags)
        self._seen(f"group {name}")
        return bool(shown)

    def _text(self, name: str, text: str, hint: str) -> str:
        _, text = imgui.input_text_with_hint(f"##{name}", hint, text)
        self._seen(name)
        return str(text)

    # declared parameters

    def _parameter(self, d: Option) -> None:
        about = f"{d.description}{f' ({d.unit})' if d.unit else ''}\n{d.source}"
        self._label(label(d.name), about)
        now = st.value(self.state, d.name)
        new: Any = None
        if d.choices or (d.kind is str and d.words) or (d.slider and len(d.slider) > 2):
            new = self._listed(d, now)
        elif d.kind is bool:
            on = self._toggle(d.name, f"##{d.name}", now)
            new = on if on != now else None
        elif d.default is None:
            new = self._optional(d, now)
        else:
            new = self._number(d, now)
        if new is not None:
            st.change(self.state, d.name, None if new == () else new)

    def _listed(self, d: Option, now: Any) -> Any:
        """Draw one of a few values; () for unset."""
        known = self.state.allowed.get(d.name, d.choices or d.words)
        read = {f"{v:g}": d.kind(v) for v in d.slider or ()} or {name: name for name in known}
        names = tuple(read)
        if d.default is None:
            automatic = self.state.automatic.get(d.name)
            unset = "auto" if automatic is None else f"auto ({automatic})"
            read, names = {unset: (), **read}, (unset, *names)
        name = unset if now is None else f"{now:g}" if d.slider else now
        chosen = self._choose(d.name, name, names)
        return None if chosen is None else read[chosen]

    def _number(self, d: Option, now: Any) -> Any:
        """Draw a slider, or three side by side; what it was moved to, or None."""
        low, high = d.slider or (0, 1)
        flags = imgui.SliderFlags_.logarithmic if d.is_log else 0
        digits = 2 if high - low > 1 or d.is_triple else 3 if high - low > 0.2 else 4
        form = "%.4g" if d.is_log else f"%.{digits}f"  # which also says how near to 0 ratios end
        new: Any
        v: Any
        if d.is_triple:
            changed, v = imgui.slider_float3(f"##{d.name}", list(now), low, high, form, flags)
            new = tuple(self._bounded(d, float(f"{part:.5g}")) for part in v)
        elif d.kind is int:
            changed, v = imgui.slider_int(f"##{d.name}", now, int(low), int(high), "%d", flags)
            new = self._bounded(d, v)
        else:
            changed, v = imgui.slider_float(f"##{d.name}", now, low, high, form, flags)
            new = self._bounded(d, float(f"{v:.5g}"))
        self._seen(d.name)
        return new if changed and new != now else None

    def _bounded(self, d: Option, v: Any) -> Any:
        """Clamp a number: by ctrl + click any may be typed."""
        return d.kind(max(v if d.low is None else d.low, min(v if d.high is None else d.high, v)))

    def _tick(self, name: str, text: str, on: bool) -> bool:
        """Draw a tick, and tell whether it was changed."""
        changed, _ = imgui.checkbox(f"{text}##{name}", on)
        self._seen(f"{name} {text}")
        return bool(changed)

    def _optional(self, d: Option, now: Any) -> Any:
        """Draw a parameter that may be unset: () is that."""
        unset = now is None
        guess: Any = "#101010" if d.kind is str else self.state.automatic.get(d.name, d.slider[1] / 2 if d.slider else 0.0)
        if self._tick(d.name, "auto", unset):
            if not unset:
                return ()
            return guess if isinstance(guess, (str, tuple)) else d.kind(float(f"{guess:.4g}"))
        shown: Any = d.kind(guess) if unset and d.kind is int else guess if unset else now
        if not d.is_triple:  # whose sliders take the whole row below
            imgui.same_line()
        imgui.begin_disabled(unset)
        try:
            for word in d.words:
                if self._tick(d.name, word, shown == word):
                    return self._plain(d) if shown == word else word
                imgui.same_line()
            imgui.set_next_item_width(-1)
            if d.kind is not str:
                imgui.begin_disabled(shown in d.words)
                try:
                    return self._number(d, self._plain(d) if shown in d.words else shown)
                finally:
                    imgui.end_disabled()
            rgb = [int(shown[i : i + 2], 16) / 255 for i in (1, 3, 5)]
            changed, rgb = imgui.color_edit3(f"##{d.name}", rgb)
            self._seen(d.name)
            return "#" + "".join(f"{round(255 * v):02x}" for v in rgb) if changed else None
        finally:
            imgui.end_disabled()

    @staticmethod
    def _plain(d: Option) -> Any:
        """Choose a number for what was a word."""
        low, high = d.slider or (0, 1)
        return d.kind(high / 4 if high / 4 > low else high)
