"""Settings of a scene's lights in the viewer that they have to themselves of a medium."""

import numpy as np
from viewer_driver import Driver

from airlight.viewer import command
from airlight.viewer import state as st


def test_a_lights_own_density_and_extinction(scene: Driver) -> None:
    state = scene.state
    if "strength 0" not in scene.places:
        scene.open_group("Light")
    assert "strength 0" in scene.places and "density 0" not in scene.places  # of a method that works on the picture
    st.set_values(state, {"method": "march", "steps": 8, "shadow_size": 64, "resolution": 0.25})
    plain = scene.frame(2)[:, 360:].astype(int)
    assert {"density 0", "extinction 0"} <= set(scene.places)
    scene.drag(scene.where("density 0", 0.25), scene.where("density 0", 0.75))
    dense = scene.frame(2)[:, 360:].astype(int)
    (control,) = state.lights
    assert 2 < control.density < 4 and control.extinction == 1 and np.abs(dense - plain).max() > 3
    (word,) = command.light_words(state)
    assert word.endswith(f";density={control.density}")
    state.lights[0].density = 1.0
    assert np.array_equal(scene.frame(2)[:, 360:], plain) and not command.light_words(state)
