"""Declares the march along rays through a medium, and its shadow maps."""

from typing import Literal

from airlight.options.declare import RGB, Options, choice, real, rgb, switch, whole

ARTICLE = "shadow-map article (unpublished, 2014)"
SHADERX3 = "Light Shaft Rendering"


class March(Options, group="march"):
    """Sum the light in a medium along rays, through shadow maps. Validated on construction; raises AirlightError."""

    steps: int | Literal["exact", "table"] | None = whole(
        None,
        "steps along a ray; exact: every texel of the shadow maps that it crosses, no step size; table: what is lit of rays is summed once "
        "for all pixels, where that goes, else as if unset; unset: 32, 64, exact, by quality",
        "Airlight", ge=1, le=4096, slider=(4, 256), log=True, words=("exact", "table"),
    )
    sun_steps: int | None = whole(
        None,
        "of suns, instead of steps; unset: as these; not where they are exact",
        "Hx Volumetric Lighting", ge=1, le=4096, slider=(4, 256), log=True,
    )
    snap: bool = switch(
        False,
        "look up shadows at the centres of texels, as nearest does: a filter then lies around one",
        ARTICLE,
    )
    shadow_size: int | None = whole(
        None,
        "side of a shadow map; unset: 1024, 2048, 4096, by quality",
        "Airlight", "texels", ge=16, le=16384, slider=(512, 1024, 2048, 4096),
    )
    cascades: int = whole(1, "shadow maps of a sun, one behind the other", "Engel, ShaderX5", ge=1, le=4)
    cascade_split: float = real(
        0.7,
        "how they share the distance: 0 evenly, 1 in equal ratios",
        "Zhang et al. 2006, practical split scheme", ge=0, le=1,
    )
    cascade_blend: float = real(
        0.1,
        "the last part of a cascade, over which it passes into the next; not where exact",
        "Airlight", ge=0, le=0.5,
    )
    shadow_filter: str = choice(
        "nearest", ("nearest", "pcf", "soft", "variance"),
        "edges of shadows: as the texels are; filtered over 2 x 2; as wide as the sun's size makes them (lamps: pcf); by mean and "
        "variance of the depths around. steps exact takes nearest",
        "Reeves et al. 1987; Fernando 2005; Donnelly and Lauritzen 2006",
    )
    variance_radius: int = whole(
        3, "with shadow-filter variance: texels to each side, over which depths are averaged",
        "Donnelly and Lauritzen 2006", "texels", ge=0, le=8,
    )
    variance_cut: float = real(
        0.2,
        "with shadow-filter variance: visibility up to which a place counts as dark, against light that leaks where shadows overlap",
        "Lauritzen, GPU Gems 3, ch. 8", ge=0, le=0.95,
    )
    sun_size: float = real(0.27, "half the angle under which a sun is seen", "Airlight", "degrees", ge=0, le=20)
    shadow_bias: float = real(0.0, "how far behind what hides the light shadows begin", "Airlight", "m", ge=0, le=1e6, slider=(0, 0.1))
    soften: int = whole(
        0,
        "artistic: passes of blur over the light at the size that is computed, each along rows and columns, not over edges of depth",
        "Hx Volumetric Lighting", ge=0, le=4,
    )
    soften_kernel: str = choice(
        "gaussian", ("gaussian", "box"), "with soften: weights of the three neighbours on each side", "Hx Volumetric Lighting"
    )
    depth_sharpness: float = real(
        24.0,
        "of soften, and of what a smaller resolution is enlarged by: how fast a neighbour's weight falls with the relative difference of "
        "its distance",
        "Airlight", ge=0, le=1000, slider=(0, 100),
    )
    depth_threshold: float = real(
        0.2,
        "with a smaller resolution: relative difference of distance from which on a neighbour shows something else, and one that is alike "
        "is looked for farther away",
        "Airlight", ge=0, le=10, slider=(0, 1),
    )
    refine: float = real(
        0.8,
        "with a smaller resolution and lamps: how much a pixel may be wrong by, as it seems, of the mean radiance, before it is marched by "
        "itself; 3 % of the picture at most; 0: none is",
        "Airlight", ge=0, le=100, slider=(0, 2),
    )
    article_share: str = choice(
        "code", ("code", "prose"),
        "with method article-prose: what a step's share is divided by: 750, as in the article's code; the ray's length, as its prose says",
        ARTICLE, group="article",
    )
    article_steps: int | None = whole(
        None,
        "with method article-prose: steps of half a metre: 500, or 2,000, as its prose says; unset: 600 of 0.8 m, as in its code",
        ARTICLE, ge=1, le=4096, slider=(100, 2000), group="article",
    )
    article_absorption: RGB = rgb(
        (0.0, 0.0, 0.0),
        "with method article-prose: how fast a step's share falls with its distance",
        ARTICLE, "1/m", ge=0, le=1e6, slider=(0, 0.1), group="article",
    )
    article_cap: float = real(
        1.0,
        "with method article-prose: most light before a surface in shadow; 1: as before any",
        ARTICLE, ge=0, le=1, group="article",
    )
    planes: int | None = whole(
        None,
        "planes at right angles to the view, over what is seen of a light, or with slices-printed over its whole volume; unset: 64, or 100",
        SHADERX3, ge=1, le=4096, slider=(8, 256), log=True, group="slices",
    )
    plane_cell: int = whole(
        2,
        "pixels along a cell in which planes lie between each other's, so that its mean has as many times more as it has pixels",
        "Keller and Heidrich 2001", "pixels", ge=1, le=8, group="slices",
    )
    plane_shadow: bool = switch(True, "whether samples on planes look up shadow maps", SHADERX3, group="slices")
    plane_cookie: bool = switch(True, "whether they look up a light's cookie", SHADERX3, group="slices")
    plane_noise: bool = switch(
        False, "whether samples are times two projected noise maps; else times 0.015", SHADERX3, group="slices-printed",
    )
    plane_noise_seed: int = whole(0, "with plane-noise: which maps", "Airlight", ge=0, le=9999, group="slices-printed")
    plane_scroll: float = real(
        0.02, "with plane-noise: speed of the first map", SHADERX3, "maps/s", ge=-10, le=10, slider=(0, 0.2), group="slices-printed"
    )
    plane_scroll_second: float = real(
        0.013, "with plane-noise: speed of the second map, another way", SHADERX3, "maps/s", ge=-10, le=10, slider=(0, 0.2),
        group="slices-printed",
    )
    plane_falloff: str = choice(
        "ambient", ("ambient", "inverse-square", "inverse", "none"),
        "with the distance d from lamps, none of which is physical: 0.35 + 20000 / d²; without the 0.35; √20000 / d; 1",
        SHADERX3, group="slices-printed",
    )
    plane_unit: float = real(
        100.0, "units of that distance in a metre; the chapter names none", "Airlight", "1/m", gt=0, le=1e6, slider=(1, 1000), log=True,
        group="slices-printed",
    )
    plane_clip: bool = switch(
        True, "whether planes are cut to the light's volume; else what lies outside of it is dark, and costs time", SHADERX3,
        group="slices-printed",
    )
    plane_mask: bool = switch(
        True, "whether planes go to four channels of 8 bits in turn, added at the end; else to one", SHADERX3, group="slices-printed"
    )
    plane_distance: float | None = real(
        None,
        "distance from the eye to the middle of a light's volume from which on there are fewer planes, as bright; unset: none",
        SHADERX3, "m", gt=0, le=1e9, slider=(1, 1000), log=True, group="slices-printed",
    )
    plane_blur: int = whole(
        1, "samples of a blur over the layer; 1: none", SHADERX3, ge=1, le=64, slider=(1, 16), group="slices-printed"
    )
    plane_blur_radius: float = real(
        2.0, "with plane-blur: its radius", "Airlight", "pixels", ge=0, le=100, slider=(0, 16), group="slices-printed"
    )
