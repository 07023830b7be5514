"""Declares what shafts on the view of a 3-D scene need beside those of pictures."""

from airlight.options.declare import Options, choice, real, text
from airlight.options.shafts import GEMS, Parameters
from airlight.scatter.methods import METHODS

RESOLUTION = 0.5  # of the view, where none is given


class SceneOptions(Options, group="scene"):
    """Shape the shafts of a rendered 3-D scene, beside Parameters. Validated on construction; raises AirlightError."""

    occluders: str = choice(
        "stencil", ("stencil", "prepass", "contrast"),
        "how occluders are found: stencil: from the picture's own depth; prepass: drawn once more, black, also beyond the view; "
        "contrast: the picture itself, its occluders flattened and fogged as the light is faced",
        GEMS + ", sec. 13.5",
    )
    resolution: float | None = real(
        None,
        f"size of source and shafts; unset: {RESOLUTION}, of a medium in quality final 1",
        "Vesper; " + GEMS + ", sec. 13.8", "of the view", ge=0.125, le=1,
    )
    region: float = real(
        1.2,
        "with prepass: how much wider and higher than the view the occluders are drawn, on the side of the lights, so that none "
        "flickers at its border",
        GEMS + ", sec. 13.6", "of the view", ge=1, le=2,
    )
    depth_aware: float = real(
        0.0,
        "distance from the eye over which shafts gather, so that they do not draw over what is nearer; 0: they draw over "
        "everything",
        GEMS + ", sec. 13.6", "m", ge=0, le=1e6, slider=(0, 20),
    )
    clear: str | None = text(
        None, "^#[0-9a-fA-F]{6}$",
        "colour of the source where nothing is drawn, sRGB as #101010; unset: the scene's background",
        "Vesper",
    )
    adapt_seconds: float = real(
        0.5,
        "time in which light adaptation follows the picture",
        GEMS + ", sec. 13.8", "s", ge=0, le=60, slider=(0, 5),
    )
    ev: float | None = real(
        None,
        "exposure: stops that pictures for a display are brighter; unset: automatic where a light has 100 lux, 1,000 candela or more, "
        "or a file's would burn the picture, else 0. Light in .exr and .hdr files does not know it",
        "Airlight", "stops", ge=-40, le=40, slider=(-20, 10),
    )
    view_transform: str = text(
        "filmic", r"^[^\r\n]{1,200}$",
        "how linear light becomes a picture: a filmic curve, AgX, cut off at 1, or a view by its name or a part of it, as aces, of $OCIO's "
        "config, else of OpenColorIO's built-in one",
        "Hill's fit; Sobotka; OpenColorIO", words=("filmic", "agx", "none"),
    )

    def share(self, p: Parameters) -> float:
        """Give the resolution, by method and quality where it is unset."""
        if self.resolution is not None:
            return self.resolution
        return 1.0 if METHODS[p.method].lights_medium and p.quality == "final" else RESOLUTION
