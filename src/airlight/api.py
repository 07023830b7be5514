"""The functions that a script calls: arrays in, arrays out."""

import dataclasses
import inspect
import os
from collections.abc import Callable, Sequence
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from airlight.alpha import is_transparent
from airlight.arrays import as_array, encode, to_linear
from airlight.colour import is_neutral
from airlight.composite.blend import blend as blend_layer
from airlight.composite.blend import resolve, sample_step
from airlight.errors import AirlightError, warn
from airlight.files.images import COARSE, every
from airlight.layers import Where, checked_plane, compute_codes, compute_layer, hiding_nearness, open_renderer, where_lit
from airlight.lights import ImageLight, as_lights
from airlight.look.apply import apply as apply_look
from airlight.look.near import NEAR_RANGE, check_range
from airlight.luminance import luminance
from airlight.medium.field import as_field
from airlight.medium.resolve import resolve as medium_of_scene
from airlight.messages import nearest
from airlight.notebook_image import shown
from airlight.occlusion.automatic import auto_threshold
from airlight.options import OF_PICTURES, Composite, Look, March, Medium, Parameters, chosen_look, presets, refuse_medium
from airlight.options.daylight import OF_DAYLIGHT
from airlight.options.words import in_python
from airlight.reference.field import density as density_at
from airlight.scatter.methods import METHODS
from airlight.scatter.render import PictureRenderer

FloatArray = npt.NDArray[np.float32]


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


def _parameters(image: Any, named: dict[str, Any]) -> tuple[Parameters, Any]:
    """Build parameters from keywords; `occlusion` may be an (H, W) mask."""
    mask = None
    if not isinstance(named.get("occlusion", "none"), str):
        mask = named.pop("occlusion")
        named["occlusion"] = "none"
    _refuse_unknown(named, (Parameters,), light_shafts)
    return Parameters(**named), mask


def _auto_threshold(p: Parameters, image: Any, lights: list[ImageLight], adapts: bool = False) -> Parameters:
    """Give the parameters for an array: `auto_threshold` on some 100,000 of its pixels where it holds integers, or is adapted."""
    array = as_array(image)
    is_float = array.dtype.kind == "f"
    if is_float and not adapts:
        return p
    step = sample_step(array.shape[1], array.shape[0])
    return auto_threshold(p, to_linear(array[every(array.shape[0], step), every(array.shape[1], step)])[0], lights, bounded=not is_float)


def light_shafts(
    image: Any,
    light: Any,
    *,
    alpha: Any = None,
    depth: Any = None,
    mask: Any = None,
    cookie: Any = None,
    device: Where = None,
    **parameters: Any,
) -> FloatArray:
    """Compute the light shafts alone: (H, W, 3) float32, linear, to be added to the image.

    image: (H, W), (H, W, 3) or (H, W, 4); float is scene-linear, premultiplied by its alpha; uint8 and uint16 are sRGB-encoded, not
    premultiplied.
    light: (x, y) normalised, (0, 0) the top-left corner; or an airlight.Light; or a list of them. It may lie outside.
    alpha, mask, depth: (H, W) in 0..1; the mask's white emits, the depth's larger is farther.
    cookie: what read_cookie gives, or an array as the image, of lights that have none of their own: held with its middle upon the light, it
    multiplies the shafts by what lies in their direction.
    parameters: the fields of Parameters (method, samples, density, decay, weight, exposure, ...); occlusion may be an
    (H, W) array, used as the mask. Raises AirlightError for bad input.
    Source: Mitchell, GPU Gems 3, chapter 13, Eq. 4 (method radial) and its limit for n to infinity (epipolar).
    """
    return shown(_shafts(image, as_lights(light, cookie), alpha, depth, mask, parameters, open_renderer(device)))


def _shafts(
    image: Any,
    lights: list[ImageLight],
    alpha: Any,
    depth: Any,
    mask: Any,
    named: dict[str, Any],
    device: PictureRenderer | None,
    adapts: bool = False,
) -> FloatArray:
    p, given = _parameters(image, dict(named))
    rgb, own = to_linear(image)
    shape = rgb.shape[:2]
    return compute_layer(
        rgb,
        checked_plane("alpha", own if alpha is None else alpha, shape),
        lights,
        _auto_threshold(p, image, lights, adapts),
        checked_plane("mask", given if given is not None else mask, shape),
        checked_plane("depth", depth, shape),
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
    cookie: Any = None,
    near_range: Any = NEAR_RANGE,
    preset: str | os.PathLike[str] | None = None,
    device: Where = None,
    **parameters: Any,
) -> Any:
    """Add light shafts to the image, in the image's shape and dtype.

    image, light, alpha, mask, cookie: as light_shafts; light may also be what find_light or find_lights gives, or "auto": the likeliest
    place; where none is likely enough the image comes back as it was, with a warning that says what to do.
    parameters: the fields of Look (strength, warmth, length, ...) and quality; or those of Parameters and Composite, which ask for
    look="classic", the sum that light_shafts gives, put on the picture. preset: the name of one, or a .toml file, whose values hold where
    no parameter is given.
    depth: (H, W), any unit, larger is farther: shafts pass behind what is nearer than near_range of it (0 its nearest, 1 its farthest);
    with occlusion="depth" it says what emits instead. subject: (H, W) in 0..1, what shafts pass behind.
    A grey image stays grey: where the light has a colour it gets the luminance. Warns (AirlightWarning) where nothing is changed.
    """
    array = as_array(image)
    named = ({} if preset is None else _preset(preset)) | parameters
    given = named.pop("occlusion") if not isinstance(named.get("occlusion", ""), str) else None  # an array, the mask
    emits = mask if given is None else given
    _refuse_unknown(named, (Parameters, Composite, Look), add_light_shafts)
    searched = isinstance(light, str) and light == "auto"
    if isinstance(light, str) and not searched:
        raise AirlightError(f"light must be 'auto', (x, y), an airlight.Light, or a list of them, not {light!r}{nearest(light, ('auto',))}")
    lights = [] if searched else as_lights(light, cookie)
    parallel = any(one.angle is not None for one in lights)
    of_sum = "occlusion" if given is not None else "a parallel light" if parallel else ""
    chosen = chosen_look(named, Look(look=named.get("look")).look, of_sum)
    if chosen == "classic":
        if subject is not None:
            raise AirlightError("a subject is for the smart look: leave out what asks for the classic one")
        of_rule = {name: named.pop(name) for name in Composite.__struct_fields__ if name in named}
        named.pop("look", None)
        if given is not None:
            named["occlusion"] = "none"
        composite = Composite(**of_rule)
        if searched:
            linear = to_linear(array)[0]
            place = likeliest(linear, array.dtype.kind != "f")
            if isinstance(place, str):
                warn(place)
                return shown(_encoded(array, linear, np.zeros(array.shape[:2], bool)))
            lights = as_lights(place, cookie)
        return _add_sum(array, lights, composite, alpha, depth, emits, device, named)
    quality = Parameters(**{name: named.pop(name) for name in ("quality",) if name in named}).quality
    look = Look(**named)
    rgb = None if _holds_codes(array) else to_linear(array)[0]  # codes are decoded by the GPU
    shape = array.shape[:2]
    is_float = array.dtype.kind == "f"
    near = hiding_nearness(depth, subject, shape, check_range(near_range), look.wrap)
    step = max(1, max(shape) // COARSE)
    some = every(shape[0], step), every(shape[1], step)
    coarse = to_linear(array[some])[0] if rgb is None else rgb[some]
    pixels = array[..., :3] if rgb is None else rgb
    mask_plane = checked_plane("mask", emits, shape)
    grey = array.ndim == 2 or array.shape[2] == 1
    options: dict[str, Any] = {"float_output": is_float, "near": near, "masked": mask_plane, "quality": quality, "grey": grey}
    if searched:
        place = likeliest(coarse, not is_float)
        if isinstance(place, str):
            warn(place)
            return shown(_encoded(array, to_linear(array)[0] if rgb is None else rgb, np.zeros(shape, bool)))
        lights = as_lights(place, cookie)
    done = apply_look(open_renderer(device), pixels, coarse, lights, look, **options)
    if done.resolved.message:
        warn(in_python(done.resolved.message))
    if done.codes is not None:
        return shown(_with_own_alpha(done.codes, array))
    if rgb is None:
        rgb = to_linear(array)[0]
    if done.added is None or done.taken is None:
        return shown(_encoded(array, rgb, np.zeros(shape, bool)))
    changed = where_lit(done.added) | (done.taken != 0)
    return shown(_encoded(array, rgb * (1 - done.taken)[..., None] + done.added, changed))


def _preset(preset: str | os.PathLike[str]) -> dict[str, Any]:
    """Read what a preset says of pictures; one of scenes may say more."""
    known = {name for struct in OF_PICTURES for name in struct.__struct_fields__}
    return {name: value for name, value in presets.load(preset).items() if name in known}


def likeliest(image: Any, bounded: bool = False) -> Any:
    """Find the light of an image, a Candidate; or say in a line why none is taken, and what to do. bounded: as `find_lights`."""
    from airlight.detect import ACT, ASK, find_lights

    found = find_lights(image, bounded)
    if not found or found[0].confidence < ASK:
        return "no light found, left as it is: give its place, (x, y)"
    if found[0].confidence < ACT:
        x, y = found[0].position
        return f"unsure, left as it is: perhaps at {x:.2f}, {y:.2f} ({found[0].kind}, {found[0].confidence:.2f}); give a place, (x, y)"
    return found[0]


def _refuse_unknown(named: dict[str, Any], structs: tuple[Any, ...], of: Callable[..., Any]) -> None:
    """Refuse keywords that neither the structs have as fields nor the function that takes them."""
    known = [name for name, one in inspect.signature(of).parameters.items() if one.kind is not one.VAR_KEYWORD]
    known += [field for struct in structs for field in struct.__struct_fields__]
    unknown = sorted(set(named) - set(known))
    if unknown:
        if unknown[0] in OF_DAYLIGHT:
            there = "airlight.daylight.Atmosphere computes it, and `airlight image` puts it on pictures"
            raise AirlightError(f"{unknown[0]} is for daylight: {there}")
        refuse_medium(unknown, lambda one: one.name)
        raise AirlightError(f"unknown parameter {unknown[0]!r}{nearest(unknown[0], known, ': there is ' + ', '.join(known))}")


def _add_sum(
    array: Any, lights: list[ImageLight], composite: Composite, alpha: Any, depth: Any, mask: Any, device: Where, named: dict[str, Any]
) -> Any:
    """Put the sum's layer on the image."""
    is_float = array.dtype.kind == "f"
    settings = resolve(composite, is_float)
    chosen = open_renderer(device)
    if chosen is not None and _holds_codes(array) and not settings.adapt:
        p, _ = _parameters(array, dict(named))
        shape = array.shape[:2]
        emits = checked_plane("mask", mask, shape)
        opaque, far = checked_plane("alpha", alpha, shape), checked_plane("depth", depth, shape)
        codes, _ = compute_codes(array, opaque, lights, _auto_threshold(p, array, lights), settings, emits, far, chosen)
        return shown(_with_own_alpha(codes, array))
    layer = _shafts(array, lights, alpha, depth, mask, named, chosen, settings.adapt > 0)
    linear, _ = to_linear(array)
    out, added = blend_layer(linear, layer, settings)
    return shown(_encoded(array, out, where_lit(added) | (settings.adapt > 0)))


def _holds_codes(array: Any) -> bool:
    """Tell whether an array holds sRGB codes of 8 bits with colour, light over black, which the GPU decodes."""
    plain = bool(array.dtype == np.uint8 and array.ndim == 3 and array.shape[2] in (3, 4) and array.size > 0)
    return plain and not (array.shape[2] == 4 and is_transparent(array[..., 3]))


def _with_own_alpha(codes: Any, array: Any) -> Any:
    """Join codes (H, W, 3) with the alpha of the array that they were made of, if it has one."""
    return codes if array.shape[2] == 3 else np.concatenate([codes, array[..., 3:]], axis=2)


def _encoded(array: Any, out: FloatArray, changed: Any) -> Any:
    """Encode linear pixels (H, W, 3) in the image's shape and dtype; where nothing changed (H, W) keep its own values."""
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
    """Compute D(phi) of Eq. 2, (H, W) float32 in 0..1: the share of a pixel's samples that meet occluders. Arguments as light_shafts."""
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
    lit = compute_layer(
        rgb,
        checked_plane("alpha", own if alpha is None else alpha, shape),
        [dataclasses.replace(lights[0], color=(1.0, 1.0, 1.0), strength=1.0, cookie=None)],
        plain,
        checked_plane("mask", given if given is not None else mask, shape),
        checked_plane("depth", depth, shape),
        open_renderer(device),
        fraction=True,
    )
    return shown(np.clip(1 - lit[..., 0], 0, 1))


def density(
    points: Any,
    time: float = 0.0,
    medium: Medium | None = None,
    fields: Sequence[Any] = (),
    radius: float | None = None,
    height: float | None = None,
) -> npt.NDArray[np.float64]:
    """Evaluate the density of a medium, (...) float64: the factor of its coefficients, which shaders agree with to 1e-5.

    points: (..., 3) world, m, y up. time: s, of wind. medium: None for one of the defaults. fields: densities on grids, in order: Volumes,
    or Fields that say how they join what lies there.
    radius, height: of the scene, m, from which what is unset follows, as of `LightShafts`; an unset fog_depth is a tenth of the height,
    which without it is twice the radius, and an unset noise_size an eighth of the radius. Raises AirlightError.
    """
    if not isinstance(medium, Medium | None):
        raise AirlightError(f"medium {medium!r}: give an airlight.options.Medium")
    m = Medium() if medium is None else medium
    fields = [found for found in map(as_field, fields) if found is not None]
    places = np.asarray(points, float)
    if places.shape[-1:] != (3,):
        raise AirlightError(f"points of shape {places.shape}: give (..., 3), x, y and z in metres")
    if not (np.isfinite(places).all() and np.isfinite(time)):
        raise AirlightError("points and time have to be finite: leave out what is not")
    for name, size in (("radius", radius), ("height", height)):
        if size is not None and not 0 < size < np.inf:
            raise AirlightError(f"{name} = {size:g}: give the scene's in metres, more than 0")
    if m.fog != "none" and m.fog_depth is None and radius is None and height is None:
        raise AirlightError("fog_depth is unset: give it, or the scene's height, of which it is a tenth")
    if m.noise_amount > 0 and m.noise_size is None and radius is None:
        raise AirlightError("noise_size is unset: give it, or the scene's radius, of which it is an eighth")
    resolved = medium_of_scene(m, March(), "final", radius or 1.0, height, fields, time)
    air = m.air if m.air is not None else resolved.air
    return density_at(places, dataclasses.replace(resolved, air=air))
