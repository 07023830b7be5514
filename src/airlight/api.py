"""The functions that a script calls: arrays in, arrays out."""

import dataclasses
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from airlight.arrays import encode, to_linear
from airlight.colour import is_neutral
from airlight.composite.blend import CompositeSettings, auto_levels_of, resolve, sample_step
from airlight.composite.blend import blend as blend_layer
from airlight.errors import AirlightError, AirlightWarning, MachineError
from airlight.files import Picture
from airlight.files.images import COARSE, every
from airlight.gpu.device import Device, cure
from airlight.lights import Light, as_lights
from airlight.look.apply import HALF_MAX
from airlight.look.apply import apply as apply_look
from airlight.look.near import NEAR_RANGE as NEAR_RANGE
from airlight.look.near import check_range, nearness, subject_nearness
from airlight.look.resolve import ResolvedLook
from airlight.luminance import luminance
from airlight.notebook_image import shown
from airlight.occlusion.automatic import auto_threshold
from airlight.occlusion.automatic import check as _check
from airlight.options import Composite, Look, Parameters, chosen_look
from airlight.planes import by_rows
from airlight.reference import fallback
from airlight.scatter.methods import METHODS
from airlight.scatter.render import PictureRenderer, render_codes, render_layer

FloatArray = npt.NDArray[np.float32]
Where = PictureRenderer | Device | str | None  # None: the fastest adapter


class Renderer(PictureRenderer):
    """Renders many pictures on one device; plans of the last few kinds of picture are kept. Give it as `device` to the functions of
    airlight, or call its methods of the same names. Not to be shared between threads; several may share a device.

    device: the name of an adapter, a `Device`, or a wgpu.GPUDevice; None for the fastest adapter. keep: number of plans.
    Raises MachineError where there is no adapter.
    """

    def light_shafts(self, image: Any, light: Any, **keywords: Any) -> FloatArray:
        """Compute shafts as airlight.light_shafts."""
        return light_shafts(image, light, device=self, **keywords)

    def add_light_shafts(self, image: Any, light: Any = "auto", **keywords: Any) -> Any:
        """Add shafts as airlight.add_light_shafts."""
        return add_light_shafts(image, light, device=self, **keywords)


def _renderer(device: Any) -> PictureRenderer | None:
    """What to compute on; None, with a warning that says how to get one, where there is no adapter."""
    if isinstance(device, PictureRenderer):
        return device
    try:
        return PictureRenderer(device, keep=0)
    except MachineError as error:
        warnings.warn(f"{error}; going on without, by the NumPy reference, which is much slower", AirlightWarning, stacklevel=3)
        return None


def _plane(name: str, plane: Any, shape: tuple[int, int]) -> FloatArray | None:
    """A mask or depth map (H, W) as float32, its size checked against the image's."""
    if plane is None:
        return None
    array = np.asarray(plane)
    if array.ndim != 2:
        raise AirlightError(f"the {name} has the shape {array.shape}: give (H, W), as (height, width) of the image")
    if array.shape != shape:
        size = " x ".join(str(n) for n in array.shape[:2][::-1])
        raise AirlightError(f"the {name} is {size} pixels, the image {shape[1]} x {shape[0]}: they must be of one size")
    if array.dtype.kind != "f" and array.dtype not in (bool, np.uint8, np.uint16):
        raise AirlightError(f"the {name} is of type {array.dtype}: give bool, uint8, uint16 or float in 0..1")
    scale = float(np.iinfo(array.dtype).max) if array.dtype.kind == "u" else 1.0
    values = np.nan_to_num(array.astype(np.float32) / np.float32(scale), nan=0.0, posinf=3e38, neginf=-3e38)
    return values if name == "depth" else np.clip(values, 0, 1)


def _parameters(image: Any, named: dict[str, Any]) -> tuple[Parameters, Any]:
    """Parameters from keywords; `occlusion` may be an (H, W) mask."""
    mask = None
    if not isinstance(named.get("occlusion", "none"), str):
        mask = named.pop("occlusion")
        named["occlusion"] = "none"
    _refuse_unknown(named, (Parameters,))
    return Parameters(**named), mask


def _auto_threshold(p: Parameters, image: Any, lights: list[Light], adapts: bool = False) -> Parameters:
    """The parameters for an array: `auto_threshold` on some 100,000 of its pixels where it holds integers, or is adapted."""
    array = np.asarray(image)
    is_float = array.dtype.kind == "f"
    if is_float and not adapts:
        return p
    step = sample_step(array.shape[1], array.shape[0])
    return auto_threshold(p, to_linear(array[every(array.shape[0], step), every(array.shape[1], step)])[0], lights, bounded=not is_float)


def _layer(
    rgb: FloatArray, alpha: Any, lights: list[Light], p: Parameters, mask: Any, depth: Any, device: PictureRenderer | None, **options: Any
) -> FloatArray:
    """The layer by the GPU, or by the reference where there is none. options: fraction, profile, luminance as `render_layer`."""
    _check(p, alpha is not None, depth is not None)
    if device is None:
        return fallback.layer(rgb, lights, p, alpha=alpha, depth=depth, mask=mask, **options)
    return render_layer(device, _pixels(rgb, alpha), lights, p, mask=mask, depth=depth, **options)


def _pixels(rgb: FloatArray, alpha: Any) -> FloatArray:
    """(H, W, 4) as the GPU takes them; rgb is finite, as all that is read or handed in is mended."""
    pixels = np.empty((*rgb.shape[:2], 4), np.float32)

    def rows(first: int, last: int) -> None:
        for i in range(3):  # one by one: NumPy is twice as fast at it
            pixels[first:last, :, i] = rgb[first:last, :, i]
        pixels[first:last, :, 3] = 1.0 if alpha is None else alpha[first:last]

    by_rows(rows, len(rgb))
    return pixels


def _lit(added: FloatArray) -> npt.NDArray[np.bool_]:
    """(H, W): where something was added."""
    lit = added != 0
    return lit[..., 0] | lit[..., 1] | lit[..., 2]


def gpu_inputs(
    picture: Picture, parameters: Sequence[Parameters], mask: Any = None, depth: Any = None
) -> tuple[FloatArray, dict[str, FloatArray | None]]:
    """A picture from a file and its planes as scatter.render takes them: (H, W, 4) and {mask, depth}, checked for the parameters."""
    for p in parameters:
        _check(p, picture.alpha is not None, depth is not None)
    shape = (picture.height, picture.width)
    planes = {"mask": _plane("mask", mask, shape), "depth": _plane("depth", depth, shape), "luminance": picture.luminance}
    return _pixels(picture.linear(), picture.alpha), planes


def _codes(
    image: Any,
    alpha: Any,
    lights: list[Light],
    p: Parameters,
    settings: CompositeSettings,
    mask: Any,
    depth: Any,
    device: PictureRenderer,
    **options: Any,
) -> tuple[Any, CompositeSettings]:
    """(H, W, 3) uint8: the picture of sRGB codes (H, W, 3 or 4) uint8 with its shafts, decoded, composited, encoded by the GPU; and the
    settings as measured."""
    has_alpha = image.shape[2] == 4
    _check(p, has_alpha or alpha is not None, depth is not None)
    codes = image
    if not has_alpha or alpha is not None:
        codes = np.empty((*image.shape[:2], 4), np.uint8)
        codes[..., :3] = image[..., :3]
        codes[..., 3] = 255 if alpha is None else np.rint(255 * np.clip(alpha, 0, 1))
    out, settings = render_codes(device, codes, lights, p, settings, mask=mask, depth=depth, **options)
    return np.ascontiguousarray(out[..., :3]), settings


def light_shafts(
    image: Any, light: Any, *, alpha: Any = None, depth: Any = None, mask: Any = None, device: Where = None, **parameters: Any
) -> FloatArray:
    """The light shafts alone: (H, W, 3) float32, linear, what is to be added to the image.

    image: (H, W), (H, W, 3) or (H, W, 4); float is scene-linear, uint8 and uint16 are sRGB-encoded.
    light: (x, y) normalised, (0, 0) the top-left corner; or a Light; or a list of them. It may lie outside.
    alpha, mask, depth: (H, W) in 0..1; the mask's white emits, the depth's larger is farther.
    parameters: the fields of Parameters (method, samples, density, decay, weight, exposure, ...); occlusion may be an
    (H, W) array, used as the mask. Raises AirlightError for bad input.
    Source: Mitchell, GPU Gems 3, chapter 13, Eq. 4 (method radial) and its limit for n to infinity (epipolar).
    """
    return shown(_shafts(image, light, alpha, depth, mask, parameters, _renderer(device)))


def _shafts(
    image: Any, light: Any, alpha: Any, depth: Any, mask: Any, named: dict[str, Any], device: PictureRenderer | None, adapts: bool = False
) -> FloatArray:
    p, given = _parameters(image, dict(named))
    rgb, own = to_linear(image)
    shape = rgb.shape[:2]
    lights = as_lights(light)
    return _layer(
        rgb,
        _plane("alpha", own if alpha is None else alpha, shape),
        lights,
        _auto_threshold(p, image, lights, adapts),
        _plane("mask", given if given is not None else mask, shape),
        _plane("depth", depth, shape),
        device,
    )


def add_light_shafts(
    image: Any,
    light: Any = "auto",
    *,
    alpha: Any = None,
    depth: Any = None,
    mask: Any = None,
    subject: Any = None,
    near_range: Any = NEAR_RANGE,
    device: Where = None,
    **parameters: Any,
) -> Any:
    """The image with its light shafts, in the image's shape and dtype.

    image, light, alpha, mask: as light_shafts; light may also be what find_light or find_lights gives, or "auto": the likeliest place;
    where none is likely enough the image comes back as it was, with a warning that says what to do.
    parameters: the fields of Look (strength, warmth, length, ...) and quality; or those of Parameters and Composite, which ask for
    look="classic", the sum that light_shafts gives, put on the picture.
    depth: (H, W), any unit, larger is farther: shafts pass behind what is nearer than near_range of it (0 its nearest, 1 its farthest);
    with occlusion="depth" it says what emits instead. subject: (H, W) in 0..1, what shafts pass behind.
    A grey image stays grey: where the light has a colour it gets the luminance. Warns (AirlightWarning) where nothing is changed.
    """
    array = np.asarray(image)
    named = dict(parameters)
    given = named.pop("occlusion") if not isinstance(named.get("occlusion", ""), str) else None  # an array, the mask
    emits = mask if given is None else given
    _refuse_unknown(named, (Parameters, Composite, Look))
    searched = isinstance(light, str) and light == "auto"
    lights = [] if searched else as_lights(light)
    parallel = any(one.angle is not None for one in lights)
    chosen = chosen_look(named, named.get("look"), "occlusion" if given is not None else "a parallel light" if parallel else "")
    if chosen == "classic":
        if subject is not None:
            raise AirlightError("a subject is for the smart look: leave out what asks for the classic one")
        of_rule = {name: named.pop(name) for name in Composite.__struct_fields__ if name in named}
        named.pop("look", None)
        if given is not None:
            named["occlusion"] = "none"
        composite = Composite(**of_rule)
        if searched:
            place = likeliest(to_linear(array)[0])
            if isinstance(place, str):
                warnings.warn(place, AirlightWarning, stacklevel=2)
                named |= {"exposure": 0.0}
            lights = [Light((0.5, 0.5))] if isinstance(place, str) else as_lights(place)
        return _add_sum(array, lights, composite, alpha, depth, emits, device, named)
    quality = Parameters(**{name: named.pop(name) for name in ("quality",) if name in named}).quality
    look = Look(**named)
    codes = array.dtype == np.uint8 and array.ndim == 3 and array.shape[2] in (3, 4) and array.size > 0
    rgb = None if codes else to_linear(array)[0]  # codes are decoded by the GPU
    shape = array.shape[:2]
    is_float = array.dtype.kind == "f"
    near = _nearness(_plane("depth", depth, shape), _plane("subject", subject, shape), check_range(near_range), look.wrap)
    step = max(1, max(shape) // COARSE)
    some = every(shape[0], step), every(shape[1], step)
    coarse = to_linear(array[some])[0] if rgb is None else rgb[some]
    pixels = array[..., :3] if rgb is None else rgb
    mask_plane = _plane("mask", emits, shape)
    grey = array.ndim == 2 or array.shape[2] == 1
    options: dict[str, Any] = {"float_output": is_float, "near": near, "masked": mask_plane, "quality": quality, "grey": grey}
    if searched:
        place = likeliest(coarse)
        if isinstance(place, str):
            warnings.warn(place, AirlightWarning, stacklevel=2)
            return shown(_encoded(array, to_linear(array)[0] if rgb is None else rgb, np.zeros(shape, bool)))
        lights = as_lights(place)
    done = apply_look(_renderer(device), pixels, coarse, lights, look, **options)
    if done.resolved.message:
        warnings.warn(done.resolved.message, AirlightWarning, stacklevel=2)
    if done.codes is not None:
        return shown(done.codes if array.shape[2] == 3 else np.concatenate([done.codes, array[..., 3:]], axis=2))
    if rgb is None:
        rgb = to_linear(array)[0]
    if done.added is None or done.taken is None:
        return shown(_encoded(array, rgb, np.zeros(shape, bool)))
    changed = _lit(done.added) | (done.taken != 0)
    return shown(_encoded(array, rgb * (1 - done.taken)[..., None] + done.added, changed))


def likeliest(image: Any) -> Any:
    """Find the light of an image, a Candidate; or say in a line why none is taken, and what to do."""
    from airlight.detect import ACT, ASK, find_lights

    found = find_lights(image)
    if not found or found[0].confidence < ASK:
        return "no light found, left as it is: give its place, (x, y)"
    if found[0].confidence < ACT:
        x, y = found[0].position
        return f"unsure, left as it is: perhaps at {x:.2f}, {y:.2f} ({found[0].kind}, {found[0].confidence:.2f}); give a place, (x, y)"
    return found[0]


def _nearness(depth: FloatArray | None, subject: FloatArray | None, near_range: tuple[float, float], wrap: float) -> FloatArray | None:
    """(H, W): what shafts pass behind, by a depth map and a subject's mask; None where neither is given."""
    planes = [] if depth is None else [nearness(depth, near_range)]
    if subject is not None:
        planes.append(subject_nearness(subject, wrap))
    return np.asarray(np.maximum.reduce(planes), np.float32) if planes else None


def _refuse_unknown(named: dict[str, Any], structs: tuple[Any, ...]) -> None:
    known = [field for struct in structs for field in struct.__struct_fields__]
    unknown = sorted(set(named) - set(known))
    if unknown:
        raise AirlightError(f"unknown parameter {unknown[0]!r}: there is " + ", ".join(known))


def _add_sum(
    array: Any, light: Any, composite: Composite, alpha: Any, depth: Any, mask: Any, device: Where, named: dict[str, Any]
) -> Any:
    """The image with the sum's layer on it."""
    is_float = array.dtype.kind == "f"
    settings = resolve(composite, is_float)
    chosen = _renderer(device)
    plain = array.dtype == np.uint8 and array.ndim == 3 and array.shape[2] in (3, 4) and array.size > 0
    if chosen is not None and plain and not settings.adapt:
        p, _ = _parameters(array, dict(named))
        shape = array.shape[:2]
        emits = _plane("mask", mask, shape)
        opaque, far = _plane("alpha", alpha, shape), _plane("depth", depth, shape)
        lights = as_lights(light)
        codes, _ = _codes(array, opaque, lights, _auto_threshold(p, array, lights), settings, emits, far, chosen)
        return shown(codes if array.shape[2] == 3 else np.concatenate([codes, array[..., 3:]], axis=2))
    layer = _shafts(array, light, alpha, depth, mask, named, chosen, settings.adapt > 0)
    linear, _ = to_linear(array)
    out, added = blend_layer(linear, layer, settings)
    return shown(_encoded(array, out, _lit(added) | (settings.adapt > 0)))


def _encoded(array: Any, out: FloatArray, changed: Any) -> Any:
    """Linear pixels (H, W, 3) in the image's shape and dtype; where nothing changed (H, W) its own values."""
    if array.dtype.kind != "f":
        if (array.ndim == 2 or array.shape[2] == 1) and not is_neutral(out):
            out = np.repeat(luminance(out)[..., None], 3, axis=2)
        return encode(out, array.dtype, changed, array)
    most = float(min(np.finfo(array.dtype).max, np.finfo(np.float32).max))
    result = np.where(np.isfinite(array), array, 0).astype(array.dtype)
    if array.ndim == 2 or array.shape[2] == 1:
        values = luminance(out)
        kept = ~changed & np.isfinite(array.reshape(changed.shape))
        result[...] = np.where(kept, array.reshape(changed.shape), np.clip(values, -most, most)).reshape(array.shape)
    else:
        kept = ~changed[..., None] & np.isfinite(array[..., :3])
        result[..., :3] = np.where(kept, array[..., :3], np.clip(out, -most, most))
    return result


def occlusion_fraction(
    image: Any, light: Any, *, alpha: Any = None, depth: Any = None, mask: Any = None, device: Where = None, **parameters: Any
) -> FloatArray:
    """D(phi) of Eq. 2, (H, W) float32 in 0..1: the fraction of a pixel's samples that meet occluders. Arguments as light_shafts."""
    p, given = _parameters(image, dict(parameters))
    lights = as_lights(light)
    if len(lights) != 1:
        raise AirlightError("the occlusion fraction belongs to one light: give one")
    rgb, own = to_linear(image)
    shape = rgb.shape[:2]
    plain = Parameters(
        **{**{f: getattr(p, f) for f in p.__struct_fields__}, "decay": 1.0, "weight": 1.0, "exposure": 1.0, "normalization": "mean"}
    )
    if METHODS[p.method].stencilled:  # eight bits are too few for a fraction
        plain = msgspec.structs.replace(plain, method="radial")
    plain = _auto_threshold(plain, image, lights)
    lit = _layer(
        rgb,
        _plane("alpha", own if alpha is None else alpha, shape),
        [dataclasses.replace(lights[0], color=(1.0, 1.0, 1.0), strength=1.0)],
        plain,
        _plane("mask", given if given is not None else mask, shape),
        _plane("depth", depth, shape),
        _renderer(device),
        fraction=True,
    )
    return shown(np.clip(1 - lit[..., 0], 0, 1))


@dataclass
class Rendered:
    """Of a picture from a file: either encoded, (H, W, 3) uint8, or the rest: pixels, and layer as it was added, (H, W, 3) float32
    linear in the picture's RGB, the layer premultiplied; changed, (H, W) bool, where the picture may have changed."""

    pixels: FloatArray | None = None
    layer: FloatArray | None = None
    changed: npt.NDArray[np.bool_] | None = None
    encoded: npt.NDArray[np.uint8] | None = None
    held: CompositeSettings | ResolvedLook | None = None  # what was measured: for the next frame
    message: str = ""  # one line for the user


def render_picture(
    picture: Picture,
    lights: list[Light],
    parameters: Parameters,
    composite: Composite | CompositeSettings | None = None,
    *,
    mask: Any = None,
    depth: Any = None,
    device: Where = None,
    profile: Any = None,
    float_output: bool = False,
    codes_only: bool = False,
) -> Rendered:
    """The classic look of a picture from a file, its parameters `auto_threshold`.

    profile: a list to which (label, ms) of each pass is appended. codes_only: 8-bit sRGB codes will do, and are cheaper.
    """
    settings = composite if isinstance(composite, CompositeSettings) else resolve(composite or Composite(), float_output)
    shape = (picture.height, picture.width)
    planes = _plane("mask", mask, shape), _plane("depth", depth, shape)
    chosen = _renderer(device)
    options = {} if chosen is None else {"profile": profile}
    if chosen is not None and codes_only and _is_plain(picture) and not settings.adapt:
        encoded, settings = _codes(picture.codes, None, lights, parameters, settings, *planes, chosen, **options)
        return Rendered(encoded=encoded, held=settings)
    rgb = picture.linear()
    layer = _layer(rgb, picture.alpha, lights, parameters, *planes, chosen, luminance=picture.luminance, **options)
    settings = auto_levels_of(rgb, layer, settings, picture.luminance)
    pixels, added = blend_layer(rgb, layer, settings, picture.luminance)
    changed = _lit(added) | (settings.adapt > 0)
    if picture.alpha is not None and not picture.associated:
        added *= picture.alpha[..., None]
    return Rendered(pixels, added, changed, held=settings)


def _is_plain(picture: Picture) -> bool:
    """Tell whether the picture holds sRGB codes of 8 bits, with colour."""
    return picture.encoding == "srgb" and picture.to_709 is None and picture.codes.dtype == np.uint8 and picture.codes.shape[2] >= 3


def render_look(
    picture: Picture,
    lights: Sequence[Light],
    look: Look,
    *,
    quality: str = "normal",
    mask: Any = None,
    depth: Any = None,
    subject: Any = None,
    near_range: tuple[float, float] = NEAR_RANGE,
    held: ResolvedLook | None = None,
    device: Where = None,
    profile: Any = None,
    float_output: bool = False,
    codes_only: bool = False,
) -> Rendered:
    """The smart look of a picture from a file. mask, depth, subject: (H, W), as `add_light_shafts`; held: of a frame before, to keep;
    lights: none, where the picture is to stay as it is; the rest as `render_picture`."""
    shape = (picture.height, picture.width)
    near = _nearness(_plane("depth", depth, shape), _plane("subject", subject, shape), near_range, look.wrap)
    chosen = _renderer(device) if lights else None
    codes = chosen is not None and codes_only and _is_plain(picture)
    if not lights:
        return _untouched(picture, codes_only)
    coarse = picture.rec709(picture.linear(coarse=True))
    pixels = picture.codes[..., :3] if codes else picture.rec709(picture.linear())
    options: dict[str, Any] = {"near": near, "masked": _plane("mask", mask, shape), "held": held, "quality": quality, "profile": profile}
    options["grey"] = picture.colour_codes.shape[2] == 1
    done = apply_look(chosen, pixels, coarse, lights, look, float_output=float_output, **options)
    message = done.resolved.message
    if done.codes is not None:
        return Rendered(encoded=done.codes, held=done.resolved, message=message)
    if done.added is None or done.taken is None:
        return dataclasses.replace(_untouched(picture, codes_only), held=done.resolved, message=message)
    added = picture.from_rec709(done.added)
    out = picture.linear()

    def rows(first: int, last: int) -> None:
        if float_output:  # as an EXR holds it: its picture is to be the sum of what is stored
            added[first:last] = np.clip(added[first:last], -HALF_MAX, HALF_MAX).astype(np.float16)
        out[first:last] *= 1 - done.taken[first:last, :, None]  # type: ignore[index]
        out[first:last] += added[first:last]

    by_rows(rows, len(out))
    changed = _lit(added) | (done.taken != 0)
    if picture.alpha is not None and not picture.associated:
        added = added * picture.alpha[..., None]
    return Rendered(out, added, changed, held=done.resolved, message=message)


def _untouched(picture: Picture, codes_only: bool) -> Rendered:
    """The picture as it is, with a layer of nothing."""
    if codes_only and _is_plain(picture):
        return Rendered(encoded=np.ascontiguousarray(picture.codes[..., :3]))
    rgb = picture.linear()
    return Rendered(rgb, np.zeros_like(rgb), np.zeros(rgb.shape[:2], bool))


def adapter_cure() -> str:
    """How to get a graphics adapter on this system."""
    return cure()
