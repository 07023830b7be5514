"""Makes what is compared: the user's own parameters, each time with a few changed."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec

from airlight.errors import AirlightError
from airlight.options import (
    NOT_IN_SCENES,
    OF_SCENES,
    Composite,
    March,
    Medium,
    Parameters,
    SceneOptions,
    build,
    declared,
    of_medium_alone,
    presets,
    refuse_look,
)
from airlight.scatter.methods import CONVERGED, FOR_MEDIUM, check_picture, of_medium, of_screen

DEFAULT = (
    "method=epipolar,quality=draft",
    "method=epipolar,quality=normal",
    "method=epipolar,quality=final",
    "method=radial,samples=16",
    "method=radial,samples=64",
    "method=radial,samples=150",
    "method=radial,samples=64,scale=0.5",
    "method=radial,samples=64,jitter=blue",
)
IN_SCENES = (
    "method=march,quality=final,steps=exact",
    "method=march,quality=final,steps=2000",
    "method=march,quality=final,steps=500",
    "method=march,quality=final,steps=64",
    "method=march,quality=final,steps=64,resolution=0.5",
    "method=slices,quality=final,planes=64,resolution=0.5",
    "method=slices-printed,quality=final",
    "method=article",
    "method=article-prose",
    "method=epipolar,occluders=stencil",
    "method=epipolar,occluders=prepass",
    "method=radial",
)


@dataclass(frozen=True)
class Variant:
    text: str  # as written
    parameters: Parameters
    composite: Composite
    in_scene: SceneOptions
    medium: Medium
    march: March

    @property
    def name(self) -> str:
        """Write it short: `radial, n = 64, jitter blue`."""
        short, parts = {"method": "{}", "samples": "n = {}"}, presets.divided(self.text)
        return ", ".join(key if value is None else short.get(key, f"{key.replace('_', ' ')} {{}}").format(value) for key, value in parts)


def variant(text: str, base: dict[str, Any], in_scene: bool = False) -> Variant:
    """Put the values of a text, see `presets.written`, over the base's. Raises AirlightError.

    samples without decay keep lambda: the sum is finer or coarser, the shafts are as long. In a scene what only a medium has asks for
    march, where no method is said.
    """
    try:
        named = {key for key, _ in presets.divided(text)}  # what presets hold besides is left as it is
        for one in ("volume", "particles"):
            if one in named:
                raise AirlightError(f"{one} lies in the air of all that is compared: give --{one} beside --variant")
        own = presets.written(text)
        refuse_look(own, "a comparison of methods")
        _check_keys(named, in_scene)
        asked = {"method": FOR_MEDIUM} if in_scene and of_medium_alone(own) is not None else {}
        values = asked | base | own
        if "samples" in own and "decay" not in own:
            values["decay"] = math.exp(-build(base)[Parameters].lam / own["samples"])
        built = build(values)
        method = built[Parameters].method
        if not in_scene:
            check_picture(method)
        else:
            _check_methods(named, method)
    except AirlightError as error:
        raise AirlightError(f"--variant {text!r}: {error}") from None
    return Variant(text, *(built[struct] for struct in (Parameters, Composite, SceneOptions, Medium, March)))


def _check_keys(named: set[str], in_scene: bool) -> None:
    """Raise AirlightError for a key that is for the other kind: pictures or scenes."""
    other = NOT_IN_SCENES if in_scene else {name for struct in OF_SCENES for name in struct.__struct_fields__}
    wrong = sorted(named & other)
    if wrong:
        kinds = ("pictures", "scenes") if in_scene else ("scenes", "pictures")
        raise AirlightError(f"{wrong[0]} is for {kinds[0]}, not for {kinds[1]}: leave it out")


def _check_methods(named: set[str], method: str) -> None:
    """Raise AirlightError for a key that means nothing with the method."""
    for one in declared(scenes=True):
        if one.name in named and one.methods and method not in one.methods:
            raise AirlightError(f"{one.name} means nothing with method {method}: leave it out, or add method={' or '.join(one.methods)}")


def usual(
    base: dict[str, Any], in_scene: bool = False, lacks: Callable[[Variant], str | None] = lambda variant: None
) -> tuple[list[Variant], list[str]]:
    """List what is compared by default, of pictures with every method that it lacks; and say why some do not go with the base. lacks: why a
    variant does not go with a scene, else None."""
    texts = list(IN_SCENES if in_scene else DEFAULT)
    texts += [f"method={m}" for m in (of_medium() if in_scene else of_screen()) if not any(f"method={m}," in f"{text}," for text in texts)]
    found, lacking = [], []
    for text in texts:
        try:
            one = variant(text, base, in_scene)
        except AirlightError as error:
            lacking.append(str(error))
            continue
        why = lacks(one)
        if why is None:
            found.append(one)
        else:
            lacking.append(f"{one.name}: {why}")
    return found, lacking


def limit(p: Parameters) -> Parameters:
    """Give what p converges to: the same shafts by the finest converged sum. What belongs to the method alone is left out."""
    kept = ("normalization", "border")
    plain = {one.name: one.default for one in p.options() if one.group == "method" and one.name not in kept}
    return msgspec.structs.replace(p, **plain | {"method": CONVERGED, "quality": "final"})


def limit_key(p: Parameters) -> tuple[Any, ...]:
    """Key parameters by their limit: of samples and decay only lambda counts, and for the listing samples."""
    plain = msgspec.structs.replace(limit(p), samples=1, decay=1.0)
    return (*msgspec.structs.astuple(plain), f"{p.lam:.9g}", p.samples if p.normalization == "listing" else 0)


def source_key(p: Parameters) -> tuple[Any, ...]:
    """Key parameters by the source that they sum."""
    return (p.border, *(getattr(p, one.name) for one in p.options() if one.group == "occlusion"))
