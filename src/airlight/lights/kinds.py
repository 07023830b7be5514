"""Lists the kinds of lights that shine on media. A new one: a subclass of PunctualLight in a file of its own, and its line here."""

from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.projector import ProjectorLight
from airlight.lights.punctual import PunctualLight
from airlight.lights.spot import SpotLight

KINDS: dict[str, type[PunctualLight]] = {kind.kind: kind for kind in (DirectionalLight, SpotLight, PointLight, ProjectorLight)}
