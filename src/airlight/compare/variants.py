"""What is compared: the user's own parameters, each time with a few changed."""

import math
from dataclasses import dataclass
from typing import Any

import msgspec

from airlight import presets
from airlight.errors import AirlightError
from airlight.parameters import IN_VIEW, Composite, Parameters, check_picture

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


@dataclass(frozen=True)
class Variant:
    text: str  # as written
    parameters: Parameters
    composite: Composite

    @property
    def name(self) -> str:
        """`radial, n = 64, jitter blue`."""
        parts = [[word.strip() for word in part.split("=")] for part in self.text.split(",")]
        short = {"method": "{}", "samples": "n = {}"}
        return ", ".join(short.get(part[0], f"{part[0].replace('_', ' ')} {{}}").format(part[1]) if part[1:] else part[0] for part in parts)


def variant(text: str, base: dict[str, Any]) -> Variant:
    """The base's values with those of a text, see `presets.written`, over them. Raises AirlightError.

    samples without decay keep lambda: the sum is finer or coarser, the shafts are as long.
    """
    try:
        own = presets.written(text)
        values = base | own
        if "samples" in own and "decay" not in own:
            values["decay"] = math.exp(-presets.build(base)[Parameters].lam / own["samples"])
        built = presets.build(values)
        check_picture(built[Parameters].method)
    except AirlightError as error:
        raise AirlightError(f"--variant {text!r}: {error}") from None
    return Variant(text, built[Parameters], built[Composite])


def usual(base: dict[str, Any]) -> tuple[list[Variant], list[str]]:
    """The default list, and every method of pictures that it lacks; and why some of them do not go with the base."""
    texts = list(DEFAULT)
    texts += [f"method={m}" for m in IN_VIEW if not any(f"method={m}," in text for text in texts)]
    found, lacking = [], []
    for text in texts:
        try:
            found.append(variant(text, base))
        except AirlightError as error:
            lacking.append(str(error))
    return found, lacking


def limit(p: Parameters) -> Parameters:
    """What p converges to: the same shafts by the finest converged sum. What belongs to the method alone is left out."""
    kept = ("normalization", "border")
    plain = {f.name: f.default for f in msgspec.structs.fields(p) if presets.group(f.type) == "method" and f.name not in kept}
    return msgspec.structs.replace(p, **plain | {"method": "epipolar", "quality": "final"})


def limit_key(p: Parameters) -> tuple[Any, ...]:
    """Equal for parameters whose limits are equal: of samples and decay only lambda counts, and for the listing samples."""
    plain = msgspec.structs.replace(limit(p), samples=1, decay=1.0)
    return (*msgspec.structs.astuple(plain), f"{p.lam:.9g}", p.samples if p.normalization == "listing" else 0)


def source_key(p: Parameters) -> tuple[Any, ...]:
    """Equal for parameters that sum the same source."""
    fields = msgspec.structs.fields(p)
    return (p.border, *(getattr(p, f.name) for f in fields if presets.group(f.type) == "occlusion"))
