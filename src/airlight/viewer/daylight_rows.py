"""Draw the panel's rows for daylight: whether there is any, where the sun stands, and the air."""

from imgui_bundle import imgui

from airlight.jobs.daylight_text import LOWEST_SUN, read_sun
from airlight.options import declared
from airlight.viewer import daylight
from airlight.viewer import state as st
from airlight.viewer.rows import Rows

SHOWN = ("visibility", "altitude", "north", "multiple")  # of the declared parameters


class DaylightRows(Rows):
    """Adds the section of daylight to the rows of a panel."""

    def _daylight(self) -> None:
        s = self.state
        if s.is_image or not self._header("Daylight", daylight.is_on(s)):
            return
        self._label("Daylight", "sun and sky of an atmosphere, and its haze, with shafts that are missing light")
        on = self._toggle("daylight", "##daylight", daylight.is_on(s))
        if on != daylight.is_on(s):
            daylight.switch(s, on)
        if not daylight.is_on(s):
            return
        self._label("Sun by", "azimuth from north and elevation; or a time and a place")
        way = self._choose("sun by", "angles" if s.daylight.when is None else "time", ("angles", "time"))
        if way:
            place = {"when": daylight.NOON, "where": s.daylight.where or daylight.PLACE}
            st.set_values(s, st.values(s) | ({"when": None} if way == "angles" else place))
        if s.daylight.when is None:
            before = read_sun(daylight.sun_text(s))
            azimuth = self._slider("azimuth", before[0] % 360, 0.0, 360.0, "%.1f")
            elevation = self._slider("elevation", before[1], LOWEST_SUN, 90.0, "%.1f")
            if (azimuth, elevation) != (before[0] % 360, before[1]):
                st.set_values(s, st.values(s) | {"sun": f"{azimuth:.5g},{elevation:.5g}"})
        else:
            known = daylight.hour_of(s.daylight.when)
            hour = self._slider("hour", known, 0.0, 24.0, "%.2f h")
            self._label("When")
            when = self._text("when", s.daylight.when, daylight.NOON)
            self._label("Where")
            where = self._text("where", s.daylight.where or "", daylight.PLACE)
            when = daylight.at_hour(when, hour) if hour != known else when
            if (when, where) != (s.daylight.when, s.daylight.where or ""):
                st.set_values(s, st.values(s) | {"when": when or None, "where": where or None})
        for d in declared(scenes=True):
            if d.group == "daylight" and d.name in SHOWN:
                self._parameter(d)

    def _slider(self, name: str, now: float, low: float, high: float, form: str) -> float:
        """Draw a slider of a number that is no declared parameter."""
        self._label(name.capitalize())
        changed, new = imgui.slider_float(f"##{name}", now, low, high, form)
        self._seen(name)
        return float(f"{min(max(new, low), high):.5g}") if changed else now
