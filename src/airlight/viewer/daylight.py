"""Light the viewer's scene by the daylight that its state says, and write the options that say the same."""

import datetime
import math
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError
from airlight.jobs.daylight_sun import atmosphere
from airlight.jobs.daylight_text import read_sun, read_when, read_where
from airlight.jobs.sun_of_scene import OF_AIR, altitude_of, with_daylight
from airlight.luminance import REC709
from airlight.options import NOT_IN_SCENES, declared
from airlight.options.daylight import OF_PICTURE
from airlight.options.declare import as_text
from airlight.scatter.methods import METHODS
from airlight.scenes.exposure import FAR_STOPS, expose
from airlight.viewer import state as st
from airlight.viewer.state import ViewerState

if TYPE_CHECKING:
    from airlight.viewer.stage import SceneView

AFTERNOON = "150,25"  # a sun by angles, at first
NOON, PLACE = "2026-06-21T12:00+02:00", "47.42,10.98"  # of a sun by time and place, at first


def is_on(state: ViewerState) -> bool:
    return state.daylight.daylight == "air" and not state.is_image


def switch(state: ViewerState, on: bool) -> None:
    """Turn daylight on, with no medium but the air unless one is set, or off."""
    values = st.values(state)
    if on:
        values = with_daylight(values | {"daylight": "air"}, False)
    else:
        clear = ("daylight", "method") if values.get("sigma_t") != (0.0, 0.0, 0.0) else ("daylight", "method", "sigma_t")
        values = {name: value for name, value in values.items() if name not in clear}
    st.set_values(state, values)
    st.tell(state, "")


def sun_text(state: ViewerState) -> str:
    """Give the sun by angles, AZ,EL, as it is written."""
    return state.daylight_picture.sun or AFTERNOON


def sun_of(state: ViewerState) -> tuple[float, float]:
    """Find azimuth and elevation of the sun in the scene, degrees. Raises AirlightError."""
    north = state.daylight_scene.north
    if state.daylight.when is None:
        azimuth, elevation = read_sun(sun_text(state))
        return azimuth + north, elevation
    from airlight.daylight import sun_position

    latitude, longitude, height = read_where(state.daylight.where or PLACE)
    time = read_when(state.daylight.when)
    _, azimuth, elevation = (float(one) for one in sun_position(time, latitude, longitude, height or 0.0))
    return azimuth + north, elevation


def hour_of(when: str) -> float:
    """Read the hour of the day of a time, 0..24, in its own zone; 12 of what is none."""
    try:
        time = datetime.datetime.fromisoformat(when)
    except ValueError:
        return 12.0
    return time.hour + time.minute / 60


def at_hour(when: str, hour: float) -> str:
    """Write the same day's time at an hour, 0..24."""
    try:
        time = datetime.datetime.fromisoformat(when)
    except ValueError:
        return when
    minutes = min(max(round(60 * hour), 0), 1439)
    return time.replace(hour=minutes // 60, minute=minutes % 60, second=0, microsecond=0).isoformat(timespec="minutes")


def words(state: ViewerState) -> list[str]:
    """Write the options of what is shown; none without daylight."""
    if not is_on(state):
        return []
    found = [] if state.daylight.when is not None else [f"--sun={sun_text(state)}"]
    for d in declared(scenes=True):
        if d.group == "daylight" and d.name not in OF_PICTURE | NOT_IN_SCENES and st.value(state, d.name) != d.default:
            found += [d.flag, as_text(st.value(state, d.name))]
    if state.daylight.when is not None and state.daylight.where is None:
        found += ["--where", PLACE]
    return found


class DaylightOfView:
    """Keeps the daylight of the stage that is shown."""

    def __init__(self) -> None:
        self._of: Any = None  # the air's options
        self._air: Any = None
        self._metered = (0.0, 1.0)  # stops, and the sky's luminance that they were measured at
        self.key: Any = None  # of what is lit, and how

    def follow(self, view: "SceneView", state: ViewerState) -> None:
        """Light the stage as the state says; what cannot be is told, and the light stays."""
        stage = view.stage
        if not is_on(state):
            if stage.daylight is not None:
                stage.daylight.take_off(stage)
                self.key = None
                view.relit(state)
            return
        try:
            azimuth, elevation = sun_of(state)
            options = tuple(getattr(state.daylight, name) for name in OF_AIR)
            if options != self._of:
                self._air, self._of = atmosphere(state.daylight), options
        except AirlightError as error:
            st.tell(state, str(error), error=True)
            return
        self._light(view, state, azimuth, elevation)

    def _light(self, view: "SceneView", state: ViewerState, azimuth: float, elevation: float) -> None:
        """Put the sun there, in the air as it is."""
        from airlight.scenes.daylight import SUN_LUX, Daylight

        stage = view.stage
        new = stage.daylight is None
        daylight = Daylight(self._air, lambda _: (azimuth, elevation)) if new else stage.daylight
        where = None if state.daylight.when is None else read_where(state.daylight.where or PLACE)
        daylight.air, daylight.track = self._air, lambda _: (azimuth, elevation)
        daylight.altitude = state.automatic["altitude"] = altitude_of(state.daylight, where)
        daylight.lux = SUN_LUX if state.daylight.sun_strength is None else state.daylight.sun_strength
        if new:
            daylight.put(stage)
            view.relit(state)
            self._metered = state.automatic["ev"], self._luminance(daylight)
        shows = not state.shafts or not METHODS[state.parameters.method].lights_medium
        key = self._of, azimuth, elevation, daylight.altitude, daylight.lux, shows
        if key == self.key and not new:
            return
        self.key = key
        daylight.move(stage, 0.0, background=shows)
        self._expose(view, state, daylight)
        daylight.move(stage, 0.0, background=shows)

    def _expose(self, view: "SceneView", state: ViewerState, daylight: Any) -> None:
        """Let the exposure follow the sky's light, as it was metered once."""
        stops = self._metered[0] + math.log2(self._metered[1] / self._luminance(daylight))
        if abs(math.log2(view.stage.pre_exposure) - stops) > FAR_STOPS:
            expose(view.stage, 2.0 ** round(stops))
            view.shafts.pre_exposure = view.stage.pre_exposure
        view.shafts.automatic_ev = state.automatic["ev"] = round(stops, 2)

    @staticmethod
    def _luminance(daylight: Any) -> float:
        return max(float(daylight.ambient @ REC709), 1e-12)
