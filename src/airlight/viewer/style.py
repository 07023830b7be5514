"""Colours, spacing and the font of the panel."""

from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui

ACCENT = (0.96, 0.70, 0.28)


def set_style() -> None:
    """Set colours, spacing and the font of the current context."""
    imgui.style_colors_dark()
    style = imgui.get_style()
    style.window_border_size = style.child_border_size = 0
    style.frame_rounding = style.grab_rounding = style.popup_rounding = 3
    style.scrollbar_size = 10
    style.window_padding = imgui.ImVec2(10, 10)
    style.item_spacing = imgui.ImVec2(6, 5)
    r, g, b = ACCENT
    colors = {
        "window_bg": (0.09, 0.10, 0.115, 0.94),
        "popup_bg": (0.12, 0.13, 0.15, 0.98),
        "frame_bg": (0.17, 0.185, 0.21, 1),
        "frame_bg_hovered": (0.22, 0.24, 0.27, 1),
        "frame_bg_active": (0.25, 0.27, 0.30, 1),
        "header": (0.145, 0.16, 0.185, 1),
        "header_hovered": (0.20, 0.22, 0.25, 1),
        "header_active": (0.24, 0.26, 0.30, 1),
        "button": (0.20, 0.22, 0.25, 1),
        "button_hovered": (0.26, 0.285, 0.32, 1),
        "button_active": (0.32, 0.34, 0.38, 1),
        "slider_grab": (r, g, b, 0.5),
        "slider_grab_active": (r, g, b, 0.75),
        "check_mark": (r, g, b, 1),
        "text": (0.90, 0.91, 0.92, 1),
        "text_selected_bg": (r, g, b, 0.35),
    }
    for name, color in colors.items():
        style.set_color_(getattr(imgui.Col_, name), color)
    font = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
    if font.is_file():  # else the built-in one
        imgui.get_io().fonts.add_font_from_file_ttf(str(font), 15)
