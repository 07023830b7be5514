"""Daylight in the viewer: what its rows set, what the command says, and that a scene gets back its own light."""

import pytest

from airlight.errors import AirlightError
from airlight.viewer import daylight
from airlight.viewer import state as st
from airlight.viewer.command import command_line
from airlight.viewer.state import ViewerState


def state() -> ViewerState:
    made = ViewerState("table", False)
    made.size = (64, 36)
    return made


def test_switched_on_and_off() -> None:
    s = state()
    daylight.switch(s, True)
    assert daylight.is_on(s) and s.parameters.method == "march" and s.medium.sigma_t == (0.0, 0.0, 0.0)
    daylight.switch(s, False)
    assert not daylight.is_on(s) and st.values(s) == {}
    st.set_values(s, {"sigma_t": (0.1, 0.1, 0.1), "method": "march"})
    daylight.switch(s, True)
    assert s.medium.sigma_t == (0.1, 0.1, 0.1)  # a medium on top of it


def test_the_command_says_the_sun_and_the_air() -> None:
    s = state()
    assert not any("sun" in word for word in command_line(s))
    daylight.switch(s, True)
    st.set_values(s, st.values(s) | {"sun": "200,-4", "visibility": 30.0, "north": 12.0})
    words = command_line(s)
    assert "--sun=200,-4" in words and daylight.sun_of(s) == (212.0, -4.0)
    for name, value in (("--daylight", "air"), ("--visibility", "30.0"), ("--north", "12.0"), ("--method", "march")):
        assert words[words.index(name) + 1] == value
    st.set_values(s, st.values(s) | {"when": daylight.NOON})
    words = command_line(s)
    assert not any(word.startswith("--sun=") for word in words) and words[words.index("--where") + 1] == daylight.PLACE


def test_the_hour_of_the_day() -> None:
    assert daylight.hour_of("2026-06-21T19:30+02:00") == 19.5 and daylight.hour_of("soon") == 12
    assert daylight.at_hour("2026-06-21T19:30:10+02:00", 6.25) == "2026-06-21T06:15+02:00"
    assert daylight.at_hour("2026-06-21T19:30Z", 24) == "2026-06-21T23:59+00:00" and daylight.at_hour("soon", 3) == "soon"
    s = state()
    daylight.switch(s, True)
    st.set_values(s, st.values(s) | {"when": "2026-06-21T12:00", "where": "1,2"})
    with pytest.raises(AirlightError, match="no zone"):
        daylight.sun_of(s)
