"""From a picture in memory to the layer of its lights: upload, source, method, download."""

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.composite.blend import CompositeSettings
from airlight.composite.codes import CodesComposite
from airlight.errors import AirlightError, MachineError
from airlight.gpu.device import Device, open_device
from airlight.gpu.floats import FloatReader
from airlight.gpu.reusing import ReusingDevice
from airlight.gpu.slices import among
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import TimedSubmits, Timer, compute, timing
from airlight.lights import ImageLight, as_lights
from airlight.lights.around import around_table
from airlight.look.plan import LookPlan
from airlight.luminance import REC709_F32
from airlight.options import Parameters
from airlight.scatter.around import AroundPlan
from airlight.scatter.methods import METHODS, check_picture
from airlight.scatter.screen import Target

SOURCE, OCCLUDERS = "occlusion/source.wgsl", "occlusion/occluders.wgsl"
KNEE = struct_dtype(SOURCE, "Knee")
MODES = {"none": 0, "luminance": 1, "alpha": 2, "depth": 3, "contrast": 4}
Array = np.ndarray


def check_size(device: Device, width: int, height: int) -> None:
    """Raise AirlightError if the adapter cannot hold a texture of this size with its border."""
    if max(width, height) + 2 > device.max_side:
        limit = device.max_side - 2
        raise AirlightError(
            f"the image is {width} x {height} pixels; {device.name} takes at most {limit} on a side: scale it down or cut it"
        )


class _Occluders:
    """The pass that writes the mean colour of what does not emit into a buffer of one vec4f."""

    def __init__(self, device: Device, knee: Any, picture: Any, aside: Any, codes: bool) -> None:
        width, height, _ = picture.size
        self.columns, self.blocks = -(-width // 64), -(-height // 64)
        self.mean = device.buffer(size=16)
        constants = {"MODE": MODES["contrast"], "CODES": codes}
        self.pipelines = [device.pipeline(OCCLUDERS, entry, **constants) for entry in ("blocks", "whole")]
        self.bind = device.bind(OCCLUDERS, knee, picture, aside, device.buffer(size=16 * width * self.blocks), self.mean)

    def record(self, encoder: Any, timer: Any = None) -> None:
        run = encoder.begin_compute_pass(**timing(timer, "occluders", encoder))
        run.set_bind_group(0, self.bind)
        for pipeline, count in zip(self.pipelines, ((self.columns, self.blocks), (1, 1)), strict=True):
            run.set_pipeline(pipeline)
            run.dispatch_workgroups(*count)
        run.end()


class _Source:
    """The pass that writes S = I m (or m itself) into a half-float texture, with an apron of one texel for border black."""

    def __init__(self, device: Device, picture: Any, p: Parameters, *, masked: bool, deep: bool, fraction: bool) -> None:
        width, height, _ = picture.size
        apron = 1 if p.border == "black" else 0
        self.device = device
        self.knee = np.zeros((), KNEE)
        self.knee["low"], self.knee["high"] = p.knee
        self.knee["apron"], self.knee["masked"] = apron, masked
        self.aside = device.texture(width, height, "rgba32float", target=False) if masked or deep else picture
        self.texture = device.texture(width + 2 * apron, height + 2 * apron, "rgba16float")
        codes = picture.format == "rgba8unorm"
        constants = {"MODE": MODES[p.occlusion], "FRACTION": fraction, "CODES": codes, "STENCIL": METHODS[p.method].stencilled}
        self.pipeline = device.pipeline(SOURCE, "emit", **constants)
        self.uniform = device.buffer(size=KNEE.itemsize, uniform=True)
        self.occluders = _Occluders(device, self.uniform, picture, self.aside, codes) if p.occlusion == "contrast" else None
        mean = self.occluders.mean if self.occluders else device.buffer(size=16)
        self.bind = device.bind(SOURCE, self.uniform, picture, self.aside, self.texture, mean)

    def write(self, mask: Array | None, depth: Array | None, scale: float, luminance: Array = REC709_F32) -> None:
        """Upload what varies from picture to picture. scale: what keeps the source in half floats; luminance: weights of the RGB."""
        self.knee["scale"], self.knee["luminance"] = scale, luminance
        self.device.queue.write_buffer(self.uniform, 0, self.knee.tobytes())
        if mask is not None or depth is not None:
            width, height, _ = self.aside.size
            both = np.zeros((height, width, 4), np.float32)
            if mask is not None:
                both[..., 0] = mask
            if depth is not None:
                both[..., 1] = depth
            self.device.write(self.aside, both, width * 16)

    def record(self, encoder: Any, timer: Any = None) -> None:
        width, height, _ = self.texture.size
        if self.occluders:
            self.occluders.record(encoder, timer)
        compute(encoder, self.pipeline, self.bind, (-(-width // 64), -(-height // 8)), "source", timer)


def plan(
    device: Device, size: tuple[int, int], lights: list[ImageLight], p: Parameters, source: Any, layer: Any = None
) -> tuple[list[Any], Any]:
    """Make a plan for each light; give them, and the layer's texture that the last of them writes."""
    apron = 1 if p.border == "black" else 0
    plans: list[Any] = []
    before = None
    layer = device.texture(*size, "rgba16float") if layer is None else layer
    targets = [layer, device.texture(*size, "rgba16float") if len(lights) > 1 else None]  # taking turns; the last light writes the layer
    for number, light in enumerate(lights, 1):
        target = targets[(len(lights) - number) % 2]
        onto, table = Target(source, target, apron, before), around_table(light.cookie)
        planned = METHODS[p.method].plan(device, size, light, p, onto) if table is None else AroundPlan(device, size, light, p, onto, table)
        plans.append(planned)
        before = target
    return plans, before


class LightPasses:
    """Holds the passes of lights that move over one source, into one layer. Lights of the same number and parameters are aimed anew without
    allocation or compilation, but for the few frames in which a grid needs more room than any before.

    source, layer: rgba16float, the source with its apron where the border is black.
    """

    def __init__(self, device: Device, size: tuple[int, int], p: Parameters, source: Any, layer: Any) -> None:
        self.size, self.p, self.source, self.layer = size, p, source, layer
        self.device = ReusingDevice(device)
        self.plans: list[Any] = []

    def update(self, lights: Sequence[ImageLight], p: Parameters | None = None) -> None:
        """Plan for where the lights are now; and for parameters, if they are others. Before `record`, at most once a submit."""
        self.p = p or self.p
        self.device.again()
        self.plans, _ = plan(self.device, self.size, list(lights), self.p, self.source, self.layer)

    def record(self, encoder: Any, timer: Timer | None = None) -> None:
        """Record the passes from source to layer; without lights, the layer becomes black."""
        for i, step in enumerate(self.plans):
            among(i, len(self.plans))
            step.record(encoder, timer)
        if not self.plans:
            black = {"view": self.layer.create_view(), "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 1)}
            encoder.begin_render_pass(color_attachments=[black]).end()


class ImagePlan(TimedSubmits):
    """Holds all passes for pictures of one size and kind, with their textures: a further picture allocates and compiles nothing.

    picture: the texture that is read, rgba8unorm (sRGB codes) or rgba32float (linear); layer: the one that is written, rgba16float.
    Either may be the caller's own. mask and depth are (H, W) if masked and deep say that they are given.
    """

    def __init__(
        self,
        device: Device,
        picture: Any,
        lights: Sequence[ImageLight],
        p: Parameters,
        *,
        layer: Any = None,
        masked: bool = False,
        deep: bool = False,
        fraction: bool = False,
    ) -> None:
        width, height, _ = picture.size
        check_size(device, width, height)
        self.device, self.picture = device, picture
        self.scales = not fraction and not METHODS[p.method].stencilled  # whose buffer holds 0 to 1
        self.scale = 1.0
        self.source = _Source(device, picture, p, masked=masked, deep=deep, fraction=fraction)
        self.source.write(None, None, 1.0)
        self.layer = layer if layer is not None else device.texture(width, height, "rgba16float")
        self.lights = LightPasses(device, (width, height), p, self.source.texture, self.layer)
        self.lights.update(lights)
        self.composites: dict[Any, CodesComposite] = {}
        self._reader: FloatReader | None = None

    def record(self, encoder: Any, timer: Timer | None = None) -> None:
        """Record the passes from picture to layer."""
        self.source.record(encoder, timer)
        self.lights.record(encoder, timer)

    def upload(self, picture: Array, mask: Array | None = None, depth: Array | None = None, luminance: Array = REC709_F32) -> None:
        """Upload a picture: (H, W, 4) uint8 sRGB codes or float32 linear, as the texture holds; luminance: (3,) weights of its RGB."""
        self.scale = 1.0
        if picture.dtype != np.uint8 and self.scales:
            columns = picture.reshape(picture.shape[0], -1).max(axis=0)  # first down the columns, which is fast
            peak = min(float(columns.reshape(-1, 4)[:, :3].max()), 65504.0)  # more does not emit
            if peak > 1e-30 and not 1e-2 <= peak <= 1e3:
                self.scale = 2.0 ** -math.floor(math.log2(peak)) if peak < 1e-2 else 2.0 ** -max(0, math.ceil(math.log2(peak / 32768)))
        self.source.write(mask, depth, self.scale, luminance)
        self.device.write(self.picture, np.ascontiguousarray(picture), picture.shape[1] * picture[0, 0].nbytes)

    def read(self) -> Array:
        """Read the layer, (H, W, 3) float32."""
        if self._reader is None:
            self._reader = FloatReader(self.device, self.layer)
        return self._reader.read(1 / self.scale)

    def codes(self, settings: CompositeSettings, profile: list[tuple[str, float]] | None = None) -> tuple[Array, CompositeSettings]:
        """Put the layer on the picture's codes, (H, W, 4) uint8; give them and the settings as measured."""
        key = settings.blend, settings.haze_floor > 0
        if key not in self.composites:
            self.composites[key] = CodesComposite(self.device, self.picture, self.layer, settings)
        composite = self.composites[key]
        settings = composite.measure(settings)
        self.submit(composite.record, profile=profile)
        width, height, _ = self.picture.size
        return np.frombuffer(self.device.read(composite.result, 4), np.uint8).reshape(height, width, 4), settings


class PictureRenderer:
    """Renders many pictures on one device; plans of the last few kinds of picture are kept. Not to be shared between threads; several
    may share a device.

    device: the name of an adapter, a `Device`, or a wgpu.GPUDevice; None for the fastest adapter. keep: number of plans.
    Raises MachineError where there is no adapter.
    """

    def __init__(self, device: Any = None, *, keep: int = 2) -> None:
        if not isinstance(keep, int) or keep < 0:
            raise AirlightError(f"keep must be a number of plans, 0 or more, not {keep!r}")
        self.device = open_device(device) if device is None or isinstance(device, str) else Device.of(device)
        self.keep = keep
        self._plans: dict[Any, ImagePlan] = {}
        self._looks: dict[Any, LookPlan] = {}

    def plan(self, size: tuple[int, int], eight: bool, lights: Sequence[ImageLight], p: Parameters, **kind: bool) -> ImagePlan:
        """Give the kept plan for such pictures, or a new one. size: (width, height)."""
        shown = tuple(0 if light.cookie is None else light.cookie.revision for light in lights)
        key = size, eight, tuple(lights), shown, p, tuple(sorted(kind.items()))
        found = self._plans.pop(key, None)
        if found is None:
            check_size(self.device, *size)
            picture = self.device.texture(*size, "rgba8unorm" if eight else "rgba32float", target=False)
            found = ImagePlan(self.device, picture, lights, p, **kind)
        while len(self._plans) >= max(self.keep, 1):
            del self._plans[next(iter(self._plans))]
        if self.keep:
            self._plans[key] = found
        return found

    def look_plan(self, size: tuple[int, int], is_codes: bool, near: bool, quality: str) -> LookPlan:
        """Give the kept plan of a look for such pictures, or a new one."""
        key = size, is_codes, near, quality
        found = self._looks.pop(key, None)
        if found is None:
            check_size(self.device, *size)
            found = LookPlan(self.device, size, is_codes, near, quality)
        while len(self._looks) >= max(self.keep, 1):
            del self._looks[next(iter(self._looks))]
        if self.keep:
            self._looks[key] = found
        return found

    def texture_plan(self, picture: Any, layer: Any, light: Any, **parameters: Any) -> ImagePlan:
        """Plan for textures that the caller holds, of this renderer's device: nothing is copied.

        picture: rgba32float (linear) or rgba8unorm (sRGB codes), TEXTURE_BINDING; layer: rgba16float of the same size,
        STORAGE_BINDING, TEXTURE_BINDING and RENDER_ATTACHMENT. Call `record(encoder)` of the result whenever the picture has changed.
        Raises AirlightError for bad parameters, and for methods that need a scene.
        """
        p = Parameters(**parameters)
        check_picture(p.method)
        return ImagePlan(self.device, picture, as_lights(light), p, layer=layer)


@contextlib.contextmanager
def _within_memory(device: Device, picture: Array) -> Iterator[None]:
    try:
        yield
    except Exception as error:
        if "memory" not in str(error).lower():
            raise
        size = f"{picture.shape[1]} x {picture.shape[0]}"
        raise MachineError(f"{device.name} has not enough memory for an image of {size} pixels: scale it down") from None


@dataclass(frozen=True)
class _Inputs:
    """Holds what goes with a picture, as `render_layer` takes it."""

    mask: Array | None
    depth: Array | None
    luminance: Any
    fraction: bool
    profile: Any


def _planned(renderer: PictureRenderer, picture: Array, lights: Sequence[ImageLight], p: Parameters, inputs: _Inputs) -> ImagePlan:
    """Upload a picture and submit its layer, by a plan that is kept or made."""
    height, width = picture.shape[:2]
    kind = {"masked": inputs.mask is not None, "deep": inputs.depth is not None, "fraction": inputs.fraction}
    found = renderer.plan((width, height), picture.dtype == np.uint8, lights, p, **kind)
    found.upload(picture, inputs.mask, inputs.depth, inputs.luminance)
    found.submit(found.record, profile=inputs.profile)
    return found


def render_layer(
    renderer: PictureRenderer,
    picture: Array,
    lights: Sequence[ImageLight],
    p: Parameters,
    *,
    mask: Array | None = None,
    depth: Array | None = None,
    luminance: Any = REC709_F32,
    fraction: bool = False,
    profile: Any = None,
) -> Array:
    """Compute the layer (H, W, 3) float32 of a picture: (H, W, 4) uint8 sRGB codes or float32 linear, finite.

    mask, depth: (H, W); fraction: of what emits, not its light; profile: a list to which (label, ms) of each pass is added;
    luminance: (3,) weights of the luminance of the picture's RGB. Raises MachineError where the device has not enough memory.
    """
    with _within_memory(renderer.device, picture):
        done = _planned(renderer, picture, lights, p, _Inputs(mask, depth, luminance, fraction, profile))
        return done.read()


def emitted(
    renderer: PictureRenderer,
    picture: Array,
    p: Parameters,
    *,
    mask: Array | None = None,
    depth: Array | None = None,
    luminance: Any = REC709_F32,
    fraction: bool = False,
) -> tuple[Any, float]:
    """Write the source of the sum on the device, with its apron; give it, and the factor in it. Arguments as render_layer."""
    with _within_memory(renderer.device, picture):
        done = _planned(renderer, picture, [], p, _Inputs(mask, depth, luminance, fraction, None))
    return done.source.texture, done.scale


def source_pixels(renderer: PictureRenderer, source: Any, scale: float, width: int) -> Array:
    """Read what `emitted` gives, (H, W, 3) float32, without its apron. width: of the picture, pixels."""
    whole, height, _ = source.size
    apron = (whole - width) // 2
    return FloatReader(renderer.device, source).read(1 / scale)[apron : height - apron, apron : whole - apron]


def render_codes(
    renderer: PictureRenderer,
    picture: Array,
    lights: Sequence[ImageLight],
    p: Parameters,
    settings: CompositeSettings,
    *,
    mask: Array | None = None,
    depth: Array | None = None,
    profile: Any = None,
) -> tuple[Array, CompositeSettings]:
    """Put the layer on the picture, (H, W, 4) uint8 sRGB codes as the picture; give the settings as measured. Arguments as render_layer."""
    with _within_memory(renderer.device, picture):
        return _planned(renderer, picture, lights, p, _Inputs(mask, depth, REC709_F32, False, profile)).codes(settings, profile)
