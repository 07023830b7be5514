"""Every parameter, declared once: type, range, unit, default, source. The command line, presets, docs follow from it."""

import math
from collections.abc import Iterable
from typing import Annotated, Any, Literal, get_args, get_origin

import msgspec
from msgspec import Meta

from airlight.errors import AirlightError

THRESHOLD, SMOOTHNESS, VEIL, RESOLUTION = 0.85, 0.2, 0.35, 0.5  # where none are given
Method = Literal["epipolar", "radial", "bands", "multipass", "additive", "march", "article", "article-prose"]
IN_WORLD = ("march", "article", "article-prose")  # methods that light a medium
ARTICLES = ("article", "article-prose")  # of these, which know no units
IN_VIEW: tuple[str, ...] = tuple(m for m in get_args(Method) if m not in IN_WORLD)  # which work on pictures, and in scenes on the view
_STEPPED = ("march", "article-prose")  # which the settings of steps, suns and biases reach
_METHODS = {"shafts": IN_VIEW, "occlusion": IN_VIEW, "medium": ("march",), "march": IN_WORLD, "article": ("article-prose",)}  # of groups
MAX_SAMPLES = 16384  # software Vulkan stops an invocation's loops at 65,535 trips


def _meta(
    description: str,
    group: str,
    source: str,
    unit: str = "",
    slider: tuple[float, ...] | None = None,
    log: bool = False,
    methods: tuple[str, ...] | None = None,
    **bounds: Any,
) -> Meta:
    """slider: the range in which it is usually moved by hand, where that is narrower than its bounds; or its only values, three or more.

    log: moved in ratios. methods: with which it means something, where these are not those of its group; of a group of no _METHODS, all.
    """
    extra = {"group": group, "source": source, "unit": unit, "slider": slider, "log": log, "methods": methods or _METHODS.get(group, ())}
    return Meta(description=description, extra=extra, **bounds)


_GG3 = "GPU Gems 3, ch. 13"


class _Checked(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Validates its fields on construction; raises AirlightError."""

    def __post_init__(self) -> None:
        for field in msgspec.structs.fields(self):
            value = getattr(self, field.name)
            if hasattr(value, "tolist"):  # NumPy's
                value = value.tolist()
            if is_triple(field.type):
                value = (value,) * 3 if isinstance(value, (int, float)) else value
                value = tuple(value) if isinstance(value, list) else value
            if value is not getattr(self, field.name):
                msgspec.structs.force_setattr(self, field.name, value)
            try:
                msgspec.convert(value, field.type)
            except msgspec.ValidationError as error:
                raise AirlightError(f"{field.name} = {value!r}: {error}") from None


def is_triple(annotation: Any) -> bool:
    """Whether a field of this type holds three numbers, for red, green and blue; one number stands for three that are equal."""
    return get_origin(annotation) is tuple or any(is_triple(part) for part in get_args(annotation))


_LOOK = "Airlight, docs/look.md"


class Look(_Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Says what shafts on a picture look like. Validated on construction; raises AirlightError."""

    look: Annotated[
        Literal["smart", "classic"] | None,
        _meta(
            "smart: shafts that stand out by as much as the strength says, in the light's own colour, on what lies behind them;"
            " classic: the sum of the method, put on the picture; unset: smart, or classic where an option of the sum is given",
            "look",
            _LOOK,
        ),
    ] = None
    strength: Annotated[
        float,
        _meta(
            "how much one sees of the shafts: 95 % of the pixels change by at most 8 times this, in hundredths of OKLab", "look", _LOOK,
            slider=(0, 2), ge=0, le=4,
        ),
    ] = 1.0
    warmth: Annotated[
        Annotated[float, Meta(ge=-1, le=1)] | None,
        _meta(
            "how far the light's colour is drawn to a warm white, or below 0 to a cool one; unset: as far as it is pale", "look", _LOOK,
            slider=(-1, 1),
        ),
    ] = None
    length: Annotated[
        Annotated[float, Meta(ge=0.02, le=10)] | None,
        _meta(
            "distance from the light at which shafts have faded to a third; unset: by where the picture can show them", "look", _LOOK,
            "picture diagonals", slider=(0.05, 1.5), log=True,
        ),
    ] = None
    fineness: Annotated[
        Annotated[float, Meta(ge=0.1, le=6)] | None,
        _meta("angle over which rays are smoothed; unset: 0.55", "look", _LOOK, "degrees", slider=(0.2, 3), log=True),
    ] = None
    shade: Annotated[
        Annotated[float, Meta(ge=0, le=1)] | None,
        _meta(
            "how dark it gets where light is missing between shafts; unset: 0.8, in float files 0, so that the layer only adds",
            "look",
            _LOOK,
        ),
    ] = None
    mist: Annotated[
        float, _meta("how much of the glow that is even all round the light is shown beside its shafts", "look", _LOOK, ge=0, le=1)
    ] = 0.0
    rays: Annotated[
        Annotated[int, Meta(ge=0, le=200)] | None,
        _meta(
            "rays that are drawn where the picture has no gaps for light to come through; unset: 24 where mist hides all gaps, else none",
            "look", _LOOK, slider=(0, 60),
        ),
    ] = None
    rays_seed: Annotated[int, _meta("other drawn rays", "look", _LOOK, slider=(0, 20), ge=0, le=2**31 - 1)] = 0
    rays_shimmer: Annotated[
        float, _meta("moves drawn rays on, each on its own, as time does", "look", _LOOK, "turns", slider=(0, 5), ge=-1e6, le=1e6)
    ] = 0.0
    wrap: Annotated[float, _meta("how much of the light wraps round the edge of a subject's mask", "look", _LOOK, ge=0, le=1)] = 0.0


class Parameters(_Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What shapes the light shafts of an image. Validated on construction; raises AirlightError."""

    method: Annotated[
        Method,
        _meta(
            "epipolar: the converged sum, at a cost that does not depend on samples; radial: the direct sum; bands: ring by ring around the"
            " light; multipass: three passes of eight samples; additive: scaled copies added in an 8-bit buffer, with a stencil; in scenes"
            " also march: the light that a medium scatters, through shadow maps; article: its shadows, as the code of an early article sums"
            " them; article-prose: as that article's prose says",
            "method",
            "Airlight; " + _GG3,
        ),
    ] = "epipolar"
    samples: Annotated[
        int,
        _meta(
            "samples n along the ray; for epipolar it only sets lambda = -n ln(decay)",
            "shafts",
            _GG3 + ", Eq. 4",
            slider=(1, 300),
            ge=1,
            le=MAX_SAMPLES,
        ),
    ] = 100
    density: Annotated[
        float,
        _meta(
            "part of the way to the light that a ray covers; above 1 it passes the light; where light is parallel, the ray's length in"
            " image widths",
            "shafts",
            _GG3 + ", Listing 13-1",
            "ray lengths",
            slider=(0.05, 1.5),
            gt=0,
            le=16,
        ),
    ] = 0.97
    decay: Annotated[
        float, _meta("factor from one sample to the next", "shafts", _GG3 + ", Eq. 3", "per sample", slider=(0.9, 1), ge=1e-6, le=1)
    ] = 0.98
    weight: Annotated[float, _meta("factor of every sample", "shafts", _GG3 + ", Eq. 3", slider=(0, 2), ge=0, le=1e6)] = 1.0
    exposure: Annotated[float, _meta("factor of the whole sum", "shafts", _GG3 + ", Eq. 3", slider=(0, 3), ge=0, le=1e6)] = 1.5
    normalization: Annotated[
        Literal["mean", "listing"],
        _meta(
            "mean: Eq. 4, the sum over n; listing: Listing 13-1 as printed, no 1/n and the first sample unweighted",
            "method",
            _GG3,
            methods=IN_VIEW,
        ),
    ] = "mean"
    border: Annotated[
        Literal["clamp", "black"],
        _meta("what lies outside the image: its border pixels, or nothing", "method", _GG3 + ", sec. 13.6", methods=IN_VIEW),
    ] = "clamp"
    jitter: Annotated[
        Literal["fixed", "midpoint", "gradient", "blue"] | None,
        _meta(
            "where samples lie in their step: start, middle, interleaved-gradient noise, blue noise; unset: fixed, with march blue",
            "method",
            _GG3 + ", sec. 13.8",
            methods=(*IN_VIEW, *_STEPPED),
        ),
    ] = None
    scale: Annotated[
        float,
        _meta(
            "resolution of the radial sum: 1, 0.5 or 0.25, filtered down and up",
            "method",
            _GG3 + ", sec. 13.3.1",
            slider=(1, 0.5, 0.25),
            methods=IN_VIEW,
            ge=0.25,
            le=1,
        ),
    ] = 1.0
    quality: Annotated[Literal["draft", "normal", "final"], _meta("fineness of the epipolar grid", "method", "Airlight")] = "normal"
    occlusion: Annotated[
        Literal["luminance", "alpha", "depth", "contrast", "none"],
        _meta(
            "what emits: pixels above a luminance, transparent ones, far ones, or all; contrast: all, those below the luminance with a"
            " quarter of their contrast, so that their texture draws no streaks",
            "occlusion",
            _GG3 + ", sec. 13.5",
        ),
    ] = "luminance"
    threshold: Annotated[
        Annotated[float, Meta(ge=0, le=65504)] | None,
        _meta(
            f"linear luminance (or depth) at which a pixel counts half as emitting; unset: {THRESHOLD}, in 8 and 16 bit of the light's own"
            " luminance",
            "occlusion",
            "Blender, Resolve",
            "linear",
            slider=(0, 2),
        ),
    ] = None
    smoothness: Annotated[
        Annotated[float, Meta(ge=0, le=65504)] | None,
        _meta(
            f"half width of the soft knee around the threshold; unset: {SMOOTHNESS}, in 8 and 16 bit of the light's own luminance unless a"
            " threshold is given",
            "occlusion",
            "Blender Sun Beams",
            "linear",
            slider=(0, 2),
        ),
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.scale not in (1.0, 0.5, 0.25):
            raise AirlightError(f"scale = {self.scale!r}: use 1, 0.5 or 0.25")
        if self.scale != 1.0 and self.method == "epipolar":
            raise AirlightError("scale goes with method radial: epipolar is faster than half resolution already; use quality draft")
        if self.scale != 1.0 and self.method != "radial":
            raise AirlightError(f"scale goes with method radial: {self.method} works at full resolution")
        if self.normalization == "listing" and self.method not in ("epipolar", "radial"):
            raise AirlightError(f"normalization listing goes with methods epipolar and radial: with {self.method} use mean")

    @property
    def offset(self) -> str:
        """Where samples lie in their step: `jitter`, or what suits the method."""
        return self.jitter or ("blue" if self.method == "march" else "fixed")

    @property
    def knee(self) -> tuple[float, float]:
        """(low, high): where a pixel begins to emit, and where it does so fully; linear luminance, or depth."""
        threshold = THRESHOLD if self.threshold is None else self.threshold
        smoothness = SMOOTHNESS if self.smoothness is None else self.smoothness
        return threshold - smoothness, threshold + smoothness

    @property
    def lam(self) -> float:
        """lambda = -samples ln(decay): the optical length of the whole ray."""
        return -self.samples * math.log(self.decay)


def check_picture(method: str) -> None:
    """Raise AirlightError for a method that needs a scene."""
    if method in IN_WORLD:
        raise AirlightError(f"method {method} lights the air of a 3-D scene, not of a picture: use it with `airlight render SCENE`")


def check_ray(method: str, density: float) -> None:
    """Raise AirlightError for a ray that the method cannot follow. density: in ways to the light."""
    if method in ("bands", "multipass") and density > 1:
        raise AirlightError(f"the rays of method {method} end at the light: use a density of at most 1, or method epipolar or radial")


class Composite(_Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the layer is put on the picture. Validated on construction; raises AirlightError."""

    blend: Annotated[
        Literal["auto", "add", "screen"],
        _meta("auto: add for float files, screen for 8 and 16 bit; screen never clips", "composite", "compositing practice"),
    ] = "auto"
    mix: Annotated[
        Annotated[float, Meta(ge=0, le=1)] | None,
        _meta(
            "share of the layer that is put on the picture; unset: 1, in 8 and 16 bit less where the shafts would cover much of it",
            "composite",
            "Resolve",
        ),
    ] = None
    veil: Annotated[
        Annotated[float, Meta(ge=0, le=1)] | None,
        _meta(
            "luminance, as a share of the layer's peak, below which the layer is haze and is taken away; "
            f"unset: {VEIL} for 8 and 16 bit, 0 for float files",
            "composite",
            "Airlight",
        ),
    ] = None
    adapt: Annotated[
        float,
        _meta(
            "light adaptation: how much of a tone balance from its average, least and greatest luminance the picture is given; 0: none, it"
            " keeps its level. With it an unset blend is add, and an unset threshold follows the light in float pictures too",
            "composite",
            _GG3 + ", sec. 13.8; Reinhard 2003",
            ge=0,
            le=1,
        ),
    ] = 0.0


# What only the sum knows: where one of these is set, and no look, the look is classic.
OF_SUM = (frozenset(Parameters.__struct_fields__) | frozenset(Composite.__struct_fields__)) - {"quality"}
OF_LOOK = frozenset(Look.__struct_fields__)


def chosen_look(values: Iterable[str], look: str | None = None, sum_by: str = "") -> str:
    """`smart` or `classic`, by the names of what is set. look: the one that was asked for; sum_by: what else asks for the sum, if anything.

    Raises AirlightError where some of them belong to the one, some to the other.
    """
    of_sum = sum_by or next((name for name in values if name in OF_SUM), "")
    of_look = next((name for name in values if name in OF_LOOK and name != "look"), "")
    if of_sum and (of_look or look == "smart"):
        raise AirlightError(f"{of_sum} belongs to the classic look, {of_look or 'smart'} does not: leave one of the two out")
    if of_look and look == "classic":
        raise AirlightError(f"{of_look} belongs to the smart look, not to the classic one: leave one of the two out")
    return look or ("classic" if of_sum else "smart")


def refuse_look(values: Iterable[str], what: str) -> None:
    """Raise AirlightError where something of a look is set for what has none. what: as in `a scene`."""
    found = next((name for name in values if name in OF_LOOK), "")
    if found:
        raise AirlightError(f"{found} belongs to a look, which {what} has not: use a preset classic-..., or a method's own options")


class InScene(_Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the shafts of a rendered 3-D scene need beside Parameters. Validated on construction; raises AirlightError."""

    occluders: Annotated[
        Literal["stencil", "prepass", "contrast"],
        _meta(
            "how occluders are found: stencil: from the picture's own depth; prepass: drawn once more, black, also beyond the view; "
            "contrast: the picture itself, its occluders flattened and fogged as the light is faced",
            "scene",
            _GG3 + ", sec. 13.5",
            methods=IN_VIEW,
        ),
    ] = "stencil"
    resolution: Annotated[
        Annotated[float, Meta(ge=0.125, le=1)] | None,
        _meta(
            "size of source and shafts; unset: 0.5, of a medium in quality final 1",
            "scene",
            "Vesper",
            "of the view",
            slider=(0.125, 1),
            methods=(*IN_VIEW, "march"),
        ),
    ] = None
    region: Annotated[
        float,
        _meta(
            "with prepass: how much wider and higher than the view the occluders are drawn, on the side of the lights, so that none"
            " flickers at its border",
            "scene",
            _GG3 + ", sec. 13.6",
            "of the view",
            methods=IN_VIEW,
            ge=1,
            le=2,
        ),
    ] = 1.2
    depth_aware: Annotated[
        float,
        _meta(
            "distance from the eye over which shafts gather, so that they do not draw over what is nearer; 0: they draw over everything",
            "scene",
            _GG3 + ", sec. 13.6",
            "m",
            slider=(0, 20),
            methods=IN_VIEW,
            ge=0,
            le=1e6,
        ),
    ] = 0.0
    clear: Annotated[
        Annotated[str, Meta(pattern="^#[0-9a-fA-F]{6}$")] | None,
        _meta(
            "colour of the source where nothing is drawn, sRGB as #101010; unset: the scene's background",
            "scene",
            "Vesper",
            methods=IN_VIEW,
        ),
    ] = None
    adapt_seconds: Annotated[
        float, _meta("time in which light adaptation follows the picture", "scene", _GG3 + ", sec. 13.8", "s", slider=(0, 5), ge=0, le=60)
    ] = 0.5
    tone: Annotated[
        Literal["filmic", "none"], _meta("how linear light becomes a picture: a filmic curve, or cut off at 1", "scene", "Airlight")
    ] = "filmic"

    def share(self, p: Parameters) -> float:
        """The resolution, settled for a method and its quality."""
        if self.resolution is not None:
            return self.resolution
        return 1.0 if p.method in IN_WORLD and p.quality == "final" else RESOLUTION


RGB = tuple[Annotated[float, Meta(ge=0, le=1e6)], Annotated[float, Meta(ge=0, le=1e6)], Annotated[float, Meta(ge=0, le=1e6)]]
SHARES = tuple[Annotated[float, Meta(ge=0, le=1)], Annotated[float, Meta(ge=0, le=1)], Annotated[float, Meta(ge=0, le=1)]]
_PBR = "Pharr, Jakob and Humphreys, Physically Based Rendering"
_ARTICLE = "shadow-map article (unpublished, 2014)"


class Medium(_Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What fills the air of a scene, everywhere alike. Validated on construction; raises AirlightError."""

    sigma_t: Annotated[
        RGB | None,
        _meta(
            "extinction: the part of the light that is lost on a metre, to absorption and scattering; unset: an optical depth of 0.5 across"
            " the scene",
            "medium",
            _PBR + ", 11.1",
            "1/m",
            slider=(0, 1),
            log=True,
        ),
    ] = None
    albedo: Annotated[SHARES, _meta("the part of what is lost that is scattered, sigma_s / sigma_t", "medium", _PBR + ", 11.1")] = (
        0.9,
        0.9,
        0.9,
    )
    phase: Annotated[
        Literal["henyey-greenstein", "two-lobe", "isotropic", "rayleigh", "cornette-shanks"],
        _meta("how scattered light spreads over directions; each integrates to 1 over the sphere", "medium", _PBR + ", 11.3"),
    ] = "henyey-greenstein"
    anisotropy: Annotated[
        float,
        _meta(
            "mean cosine of the angle by which light is turned: above 0 forward", "medium", "Henyey and Greenstein 1941", ge=-0.99, le=0.99
        ),
    ] = 0.3
    back_anisotropy: Annotated[
        float, _meta("with phase two-lobe: anisotropy of the second lobe", "medium", "Henyey and Greenstein 1941", ge=-0.99, le=0.99)
    ] = -0.3
    back_share: Annotated[
        float, _meta("with phase two-lobe: share of the second lobe", "medium", "Henyey and Greenstein 1941", ge=0, le=1)
    ] = 0.3
    ambient: Annotated[
        RGB, _meta("radiance of light from all sides, which is scattered too", "medium", "Hx Volumetric Lighting", "linear", slider=(0, 1))
    ] = (0.0, 0.0, 0.0)
    max_distance: Annotated[
        Annotated[float, Meta(gt=0, le=1e9)] | None,
        _meta(
            "how far from the eye the medium reaches; unset: four times the scene's radius",
            "medium",
            "Hx Volumetric Lighting",
            "m",
            methods=_STEPPED,
            slider=(1, 1000),
            log=True,
        ),
    ] = None
    lamp_distance: Annotated[
        Annotated[float, Meta(gt=0, le=1e9)] | None,
        _meta(
            "lamps farther from the eye light no medium; unset: all do",
            "medium",
            "Hx Volumetric Lighting",
            "m",
            slider=(1, 1000),
            log=True,
        ),
    ] = None
    lamp_fade: Annotated[
        float, _meta("the last part of that distance, over which lamps fade", "medium", "Hx Volumetric Lighting", ge=0, le=1)
    ] = 0.2
    extinction: Annotated[bool, _meta("whether surfaces are seen dimmed through the medium", "medium", "Airlight")] = True


class March(_Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the light in a medium is summed along rays, and its shadow maps. Validated on construction; raises AirlightError."""

    steps: Annotated[
        Annotated[int, Meta(ge=1, le=4096)] | Literal["exact"] | None,
        _meta(
            "steps along a ray; exact: every texel of the shadow maps that it crosses, no step size; unset: 32, 64, exact, by quality",
            "march",
            "Airlight",
            methods=("march",),
            slider=(4, 256),
            log=True,
        ),
    ] = None
    snap: Annotated[
        bool,
        _meta(
            "look up shadows at the centres of texels, as nearest does: a filter then lies around one",
            "march",
            _ARTICLE,
            methods=("march",),
        ),
    ] = False
    shadow_size: Annotated[
        Annotated[int, Meta(ge=16, le=16384)] | None,
        _meta("side of a shadow map; unset: 1024, 2048, 4096, by quality", "march", "Airlight", "texels", slider=(512, 1024, 2048, 4096)),
    ] = None
    cascades: Annotated[
        int, _meta("shadow maps of a sun, one behind the other", "march", "Engel, ShaderX5", methods=_STEPPED, ge=1, le=4)
    ] = 1
    cascade_split: Annotated[
        float,
        _meta("how they share the distance: 0 evenly, 1 in equal ratios", "march", "Zhang et al. 2006, practical split scheme", ge=0, le=1),
    ] = 0.7
    cascade_blend: Annotated[
        float, _meta("the last part of a cascade, over which it passes into the next; not where exact", "march", "Airlight", ge=0, le=0.5)
    ] = 0.1
    shadow_filter: Annotated[
        Literal["nearest", "pcf", "soft"],
        _meta(
            "edges of shadows: as the texels are; filtered over 2 x 2; as wide as the sun's size makes them (lamps: pcf). steps exact takes"
            " nearest",
            "march",
            "Reeves et al. 1987; Fernando 2005",
            methods=("march",),
        ),
    ] = "nearest"
    sun_size: Annotated[
        float, _meta("half the angle under which a sun is seen", "march", "Airlight", "degrees", methods=_STEPPED, ge=0, le=20)
    ] = 0.27
    shadow_bias: Annotated[
        float,
        _meta(
            "how far behind what hides the light shadows begin",
            "march",
            "Airlight",
            "m",
            slider=(0, 0.1),
            methods=_STEPPED,
            ge=0,
            le=1e6,
        ),
    ] = 0.0
    article_share: Annotated[
        Literal["code", "prose"],
        _meta("what a step's share is divided by: 750, as in the article's code; the ray's length, as its prose says", "article", _ARTICLE),
    ] = "code"
    article_steps: Annotated[
        Annotated[int, Meta(ge=1, le=4096)] | None,
        _meta(
            "steps of half a metre: 500, or 2,000, as the article's prose says; unset: 600 of 0.8 m, as in its code",
            "article",
            _ARTICLE,
            slider=(100, 2000),
        ),
    ] = None
    article_absorption: Annotated[
        RGB, _meta("how fast a step's share falls with its distance", "article", _ARTICLE, "1/m", slider=(0, 0.1))
    ] = (0.0, 0.0, 0.0)
    article_cap: Annotated[
        float, _meta("most light before a surface in shadow; 1: as before any", "article", _ARTICLE, ge=0, le=1)
    ] = 1.0


OF_SCENES = (InScene, Medium, March)  # which a picture has no use for
# What a picture's own light and border need; a scene knows what emits, and is added to before its tone curve.
NOT_IN_SCENES = frozenset({"occlusion", "threshold", "smoothness", "border", "scale", "blend", "veil"}) | OF_LOOK
