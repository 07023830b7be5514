"""Draw the lights, the candidates and the split over the picture, and find where they are on the canvas."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.viewer import controls
from airlight.viewer import state as st

if TYPE_CHECKING:
    from airlight.viewer.app import Viewer

DOT = 9  # logical px, the radius of a candidate's ring
RIM = 2.0  # logical px: of dark beside what is light, so that both are seen on any picture
APART = 0.02  # picture sizes: nearer to a light a candidate is where it is
EDGE = 14  # logical px from the border at which the mark of what lies beyond it is drawn
Place = tuple[float, float]
Held = int | tuple[str, int]


class Marks:
    """Finds and draws what stands over a viewer's picture, on the canvas, logical px."""

    def __init__(self, viewer: "Viewer") -> None:
        self.viewer = viewer

    def draw(self, draw: Any) -> None:
        """Draw the lights and the split over the picture."""
        from imgui_bundle import imgui

        viewer = self.viewer
        state, area = viewer.state, viewer.area()
        light, dark = imgui.get_color_u32((1.0, 1.0, 1.0, 0.95)), imgui.get_color_u32((0.0, 0.0, 0.0, 0.9))
        for i, dot in self.dots():
            mark, away = controls.clamped(dot, area, EDGE)
            draw.add_circle_filled(mark, DOT + 1.5, dark)
            draw.add_circle(mark, DOT, light, 0, 1.2)
            size = imgui.calc_text_size(str(i + 1))
            draw.add_text((mark[0] - size.x / 2, mark[1] - size.y / 2), light, str(i + 1))
            _arrow(draw, mark, away, DOT, light, dark)
        for i, at in enumerate(self.lights()):
            if at is not None:
                mark, away = controls.clamped(at, self.room(), EDGE) if state.is_image else (at, None)
                radius = 9 if viewer.dragging == i else 7
                for rim in (radius - RIM, radius + RIM):
                    draw.add_circle(mark, rim, dark, 0, RIM)
                draw.add_circle(mark, radius, light, 0, 2)
                _arrow(draw, mark, away, radius, light, dark)
        for i, aim in enumerate(self.aims()):
            start = self.lights()[i]
            if aim is not None:
                arm = 8 if viewer.dragging == ("aim", i) else 6
                for color, width in ((dark, 3.0), (light, 1.2)):
                    if start is not None:
                        draw.add_line(start, aim, color, width / 2)
                    for slope in (-1, 1):
                        draw.add_line((aim[0] - arm, aim[1] - slope * arm), (aim[0] + arm, aim[1] + slope * arm), color, width + 1)
        if state.is_image and state.split is not None and state.is_lit and not state.debug:
            x = area[0] + state.split * area[2]
            draw.add_line((x, area[1]), (x, area[1] + area[3]), dark, 3)
            draw.add_line((x, area[1]), (x, area[1] + area[3]), light, 1)
            draw.add_circle_filled((x, area[1] + area[3] / 2), 6, light)
            draw.add_text((x - 50, area[1] + 8), light, "before")
            draw.add_text((x + 10, area[1] + 8), light, "after")

    def lights(self) -> list[Place | None]:
        """Find where the lights that can be dragged are on the canvas, logical px."""
        viewer = self.viewer
        state, area = viewer.state, viewer.area()
        if viewer.picture is not None:
            return [controls.to_canvas(control.position, area) for control in state.lights]
        marks: list[Place | None] = viewer.scene.marks(state, area)
        return marks

    def aims(self) -> list[Place | None]:
        """Find where on the canvas projectors shine to, logical px; None of what does not aim."""
        viewer = self.viewer
        return [] if viewer.picture is not None or viewer.scene is None else viewer.scene.aims(viewer.state, viewer.area())

    def nearest(self, at: Place, marks: Sequence[Place | None]) -> Held | None:
        """Find what is taken hold of: a light by its number, or ("aim", number); a light before an aim that lies upon it."""
        found = controls.nearest(at, marks)
        aim = controls.nearest(at, self.aims()) if found is None else None
        return found if aim is None else ("aim", aim)

    def drag(self, held: Held, at: Place) -> None:
        """Put a scene's light, or where it aims."""
        viewer = self.viewer
        state, area = viewer.state, viewer.area()
        if isinstance(held, int):
            st.move(state, held, viewer.scene.dragged(state, held, at, area))
        else:
            st.aim(state, held[1], viewer.scene.dragged(state, held[1], at, area, aim=True))

    def room(self) -> controls.Area:
        """Find where the picture is, logical px, and what is free above, below and beside it."""
        x, y, width, height = (v / self.viewer.canvas.get_pixel_ratio() for v in self.viewer.room())
        return x, y, width, height

    def dots(self) -> list[tuple[int, Place]]:
        """List the candidates that are drawn, by number, and where on the canvas: not those at which a light is, and none in a drag."""
        viewer = self.viewer
        state = viewer.state
        if viewer.picture is None or not state.candidates_shown or viewer.dragging is not None or not state.is_smart:
            return []
        places = [control.position for control in state.lights]
        free = [(i, c) for i, c in enumerate(state.candidates) if all(np.hypot(*np.subtract(c.position, p)) > APART for p in places)]
        return [(i, controls.to_canvas(c.position, viewer.area())) for i, c in free]


def _arrow(draw: Any, mark: Place, away: Place | None, radius: float, color: int, rim: int) -> None:
    """Draw a tip with a rim beside a mark, towards what lies beyond the border; away: the unit direction, None: it lies within."""
    if away is None:
        return
    (x, y), (dx, dy) = mark, away
    for tip, base, half, drawn in ((radius + 12, radius + 1, 8, rim), (radius + 9, radius + 2.5, 5, color)):
        sides = [(x + base * dx + half * s * dy, y + base * dy - half * s * dx) for s in (-1, 1)]
        draw.add_triangle_filled((x + tip * dx, y + tip * dy), *sides, drawn)
