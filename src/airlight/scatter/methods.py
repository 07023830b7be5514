"""The table of methods: all that the rest of the program knows of each. It imports no other code, so that help needs no NumPy.

A method is a folder in `scatter/` and an entry here. A method of the screen sums what a picture emits, along rays to a light of the
image plane; one of a medium integrates what the lights of a scene send into the eye, through shadow maps.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

from airlight.errors import AirlightError

ONE_SUN, WINDOWS = "one sun", "projectors and spots"  # of Method.lights
Code = str | Callable[..., Any]  # a function or class, or `module:name` within the package, imported when it is first needed


def _load(code: Code) -> Callable[..., Any]:
    """Import what `module:name` names."""
    if not isinstance(code, str):
        return code
    module, _, name = code.partition(":")
    return getattr(import_module(f"airlight.{module}"), name)  # type: ignore[no-any-return]


@dataclass(frozen=True)
class Method:
    """Describes a method.

    about: a phrase for the help. options: names of the declared options that it reads, or of their whole groups; what no method names,
    all read. jitter: where samples lie in their step, where that is unset.
    plan_by: of the screen, `plan(device, size, light, parameters, target)`, which gives passes of one light with
    `record(encoder, timer)`, see `scatter.screen.Target`; of a medium, a class as `scatter.march.march.March`.
    reference_by: of the screen, a function in float64 as `reference.radial.direct`; of a medium, one of arrays.
    lights_medium: whether it works on the medium of a scene, else on a picture. follows_fields: whether it knows
    densities that vary, volumes among them, and what lies before and behind what is seen through. follows_glass: whether light that passes
    such things is dimmed and coloured in it. has_units: whether its layer is radiance.
    lights: what lights it takes, in words, where not all. is_converged: whether it gives the limit of infinitely many samples.
    follows_past_light: whether its rays may pass the light. sums_listing: whether it has Listing 13-1's sum beside Eq. 4's.
    per_sample: whether its raw sum is over samples, not an integral. stencilled: whether it draws in a buffer of 8 bits what a stencil
    lets through. full_size: why it has no lower resolution, where it has none.
    light_of_layer: (factor, offset) that make its light of its layer.
    """

    about: str
    plan_by: Code
    reference_by: Code
    options: frozenset[str]
    jitter: str = "fixed"
    lights_medium: bool = False
    follows_fields: bool = False
    follows_glass: bool = False
    has_units: bool = False
    lights: str = ""
    is_converged: bool = False
    follows_past_light: bool = True
    sums_listing: bool = False
    per_sample: bool = False
    stencilled: bool = False
    full_size: str = "works at full resolution"
    light_of_layer: tuple[float, float] = (1.0, 0.0)

    @property
    def plan(self) -> Callable[..., Any]:
        return _load(self.plan_by)

    @property
    def reference(self) -> Callable[..., Any]:
        return _load(self.reference_by)


_SCREEN = frozenset(
    {"shafts", "occlusion", "normalization", "border", "scale", "occluders", "resolution", "region", "depth_aware", "clear", "jitter"}
)  # shafts, occlusion, medium, march: groups
_SHADOWS = frozenset(
    {"max_distance", "shadow_size", "cascades", "cascade_split", "cascade_blend", "sun_size", "shadow_bias"}
)  # of the groups medium and march, what all shadow maps need
_EVEN_AIR = frozenset(
    {"sigma_t", "albedo", "phase", "anisotropy", "back_anisotropy", "back_share", "ambient", "lamp_distance", "lamp_fade", "sun_distance"}
    | {"sun_glow", "sun_glow_size", "fog", "fog_base", "fog_depth", "fog_above", "sun_extinction", "extinction", "extinction_share"}
)  # of the group medium, what does not vary
_EARLIER = frozenset({"max_distance", "resolution", "plane_noise_seed", "plane_scroll", "plane_scroll_second"})

METHODS: dict[str, Method] = {
    "epipolar": Method(
        "the converged sum, at a cost that does not depend on samples",
        "scatter.epipolar.epipolar:plan",
        "reference.radial:limit",
        _SCREEN,
        is_converged=True,
        sums_listing=True,
        full_size="is faster than half resolution already; use quality draft",
    ),
    "radial": Method(
        "the direct sum", "scatter.radial.radial:plan", "reference.radial:direct", _SCREEN, sums_listing=True, per_sample=True, full_size=""
    ),
    "bands": Method(
        "ring by ring around the light", "scatter.bands.bands:plan", "reference.bands:reference", _SCREEN, follows_past_light=False
    ),
    "multipass": Method(
        "three passes of eight samples",
        "scatter.multipass.multipass:plan",
        "reference.multipass:reference",
        _SCREEN,
        follows_past_light=False,
    ),
    "additive": Method(
        "scaled copies added in an 8-bit buffer, with a stencil",
        "scatter.additive.additive:plan",
        "reference.additive:reference",
        _SCREEN,
        stencilled=True,
    ),
    "march": Method(
        "the light that a medium scatters, through shadow maps",
        "scatter.march.march:March",
        "reference.tracer:layer",
        frozenset({"medium", "march", "resolution", "jitter"}),
        jitter="blue",
        lights_medium=True,
        follows_fields=True,
        follows_glass=True,
        has_units=True,
    ),
    "article": Method(
        "its shadows, as the code of an early article sums them",
        "scatter.article.article:Article",
        "reference.article:article",
        frozenset({"shadow_size", "cascade_split", "cascade_blend"}),
        lights_medium=True,
        lights=ONE_SUN,
        light_of_layer=(5.0, 0.5),
    ),
    "article-prose": Method(
        "as that article's prose says",
        "scatter.article.article:ArticleProse",
        "reference.article:prose",
        _SHADOWS | {"article", "jitter"},
        lights_medium=True,
        lights=ONE_SUN,
        light_of_layer=(5.0, 0.5),
    ),
    "slices": Method(
        "the same light, on planes across the view",
        "scatter.slices.slices:Slices",
        "reference.tracer:layer",
        _SHADOWS | _EVEN_AIR | {"slices", "resolution", "shadow_filter", "variance_radius", "variance_cut", "snap"}
        | {"depth_sharpness", "depth_threshold", "transparency"},
        lights_medium=True,
        follows_glass=True,
        has_units=True,
    ),
    "slices-printed": Method(
        "planes across the view, as a chapter of 2004 adds them in buffers of 8 bits",
        "scatter.slices.printed:Printed",
        "reference.slices:printed",
        _SHADOWS | {"planes", "plane_shadow", "plane_cookie", "slices-printed", "resolution"},
        lights_medium=True,
    ),
    "slices-extruded": Method(
        "before that, polygons that a light's window is extruded to",
        "scatter.slices.printed:Extruded",
        "reference.slices:polygons",
        _EARLIER,
        lights_medium=True,
        lights=WINDOWS,
    ),
    "slices-diced": Method(
        "the same, and more of them inside",
        "scatter.slices.printed:Diced",
        "reference.slices:polygons",
        _EARLIER,
        lights_medium=True,
        lights=WINDOWS,
    ),
    "slices-thickness": Method(
        "the thickness of a light's volume",
        "scatter.slices.printed:Thickness",
        "reference.slices:thickness",
        frozenset({"max_distance", "resolution"}),
        lights_medium=True,
        lights=WINDOWS,
    ),
}
METHODS["auto"] = replace(
    METHODS["march"],
    about="of a light in view the same, with the shadows of what the picture shows, the rest by march; without a medium epipolar",
)
AUTO = "auto"  # DEFAULT without a medium
DEFAULT, FOR_MEDIUM, CONVERGED = "epipolar", "march", "epipolar"  # unset; with a medium that names none; the limit of the screen's others


def of_screen() -> tuple[str, ...]:
    """Name the methods that work on pictures, and in scenes on the view."""
    return tuple(name for name, method in METHODS.items() if not method.lights_medium)


def of_medium() -> tuple[str, ...]:
    """Name the methods that light a medium."""
    return tuple(name for name, method in METHODS.items() if method.lights_medium)


def reading(option: str, group: str) -> tuple[str, ...]:
    """Name the methods that read an option of a group; () where all do."""
    return tuple(name for name, method in METHODS.items() if option in method.options or group in method.options)


def check_picture(method: str) -> None:
    """Raise AirlightError for a method that needs a scene."""
    if method in METHODS and METHODS[method].lights_medium:
        raise AirlightError(f"method {method} lights the air of a 3-D scene, not of a picture: use it with `airlight render SCENE`")


def check_ray(method: str, density: float) -> None:
    """Raise AirlightError for a ray that the method cannot follow. density: in ways to the light."""
    if density > 1 and not METHODS[method].follows_past_light:
        raise AirlightError(f"the rays of method {method} end at the light: use a density of at most 1, or method epipolar or radial")
