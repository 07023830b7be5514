"""Every parameter, declared once, a module a group; command line, panel, presets and docs follow from it."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from airlight.errors import AirlightError
from airlight.options.composite import Composite
from airlight.options.daylight import OF_PICTURE, Daylight, DaylightPicture, DaylightScene
from airlight.options.declare import Option, Options
from airlight.options.look import OF_LOOK, OF_SUM, Look, chosen_look, refuse_look
from airlight.options.march import March
from airlight.options.medium import Medium
from airlight.options.scene import SceneOptions
from airlight.options.shafts import Parameters
from airlight.scatter import methods

__all__ = [
    "ALL", "NOT_IN_SCENES", "OF_LOOK", "OF_SCENES", "OF_SUM", "Composite", "Daylight", "DaylightPicture", "DaylightScene", "Look", "March",
    "Medium", "Option", "Options", "Parameters", "SceneOptions", "build", "chosen_look", "declared", "of_medium_alone",
    "refuse_look", "refuse_medium", "settled_method",
]  # fmt: skip

OF_PICTURES: tuple[type[Options], ...] = (Look, Parameters, Composite, Daylight, DaylightPicture)
OF_SCENES: tuple[type[Options], ...] = (SceneOptions, Medium, March, DaylightScene)  # which a picture has no use for
ALL = OF_PICTURES + OF_SCENES
# What a picture's own light and border need; a scene knows what emits, and is added to before its tone curve.
NOT_IN_SCENES = frozenset({"occlusion", "threshold", "smoothness", "border", "scale", "blend", "veil"}) | OF_LOOK | OF_PICTURE


def declared(scenes: bool = False) -> tuple[Option, ...]:
    """List every parameter, in the order of its declaration. scenes: those of 3-D scenes too, and the methods that only these have."""
    found = [one for group in (ALL if scenes else OF_PICTURES) for one in group.options()]
    if scenes:
        return tuple(found)
    return tuple(replace(one, choices_of=methods.of_screen) if one.name == "method" else one for one in found)


def of_medium_alone(names: Iterable[str]) -> Option | None:
    """Find the first of some options that only methods that light a medium read, as sigma_t: whoever writes it wants such a method."""
    some, screen = set(names), set(methods.of_screen())
    return next((one for one in declared(scenes=True) if one.name in some and one.methods and not screen & set(one.methods)), None)


def settled_method(values: dict[str, Any], has_densities: bool = False) -> str:
    """Give the method of some values of a scene: of auto what it is without a medium, if none of them, and no density, makes one."""
    method: str = values.get("method", methods.DEFAULT)
    has_medium = has_densities or of_medium_alone(values) is not None
    return methods.DEFAULT if method == methods.AUTO and not has_medium else method


def refuse_medium(names: Iterable[str], write: Callable[[Option], str] = lambda one: one.flag) -> None:
    """Raise AirlightError for an option of a medium, which a picture does not have. write: how the user wrote it."""
    one = of_medium_alone(names)
    if one is not None:
        of_scene = "is for the air of a 3-D scene, as of `airlight render SCENE`"
        raise AirlightError(f"{write(one)} {of_scene}: leave it out; the shafts of a picture have strength and length")


def build(values: dict[str, Any]) -> dict[type, Any]:
    """Make an instance of each group, with its share of the values. Raises AirlightError for a bad one."""
    return {group: group(**{one.name: values[one.name] for one in group.options() if one.name in values}) for group in ALL}
