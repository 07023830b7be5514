"""Declares how the layer is put on the picture."""

from airlight.options.declare import Options, choice, real
from airlight.options.shafts import GEMS

VEIL = 0.35  # of the layer's peak, where none is given and the picture has 8 or 16 bits


class Composite(Options, group="composite"):
    """Put the layer on the picture. Validated on construction; raises AirlightError."""

    blend: str = choice(
        "auto", ("auto", "add", "screen"),
        "auto: add for float files, screen for 8 and 16 bit; screen never clips",
        "compositing practice",
    )
    mix: float | None = real(
        None,
        "share of the layer that is put on the picture; unset: 1, in 8 and 16 bit less where the shafts would cover much of it",
        "Resolve", ge=0, le=1,
    )
    veil: float | None = real(
        None,
        f"luminance, as a share of the layer's peak, below which the layer is haze and is taken away; unset: {VEIL} for 8 and 16 "
        "bit, 0 for float files",
        "Airlight", ge=0, le=1,
    )
    adapt: float = real(
        0.0,
        "light adaptation: how much of a tone balance from its average, least and greatest luminance the picture is given; 0: "
        "none, it keeps its level. With it an unset blend is add, and an unset threshold follows the light in float pictures too",
        GEMS + ", sec. 13.8; Reinhard 2003", ge=0, le=1,
    )
