"""A picture with its shafts on the canvas, computed anew whenever a light or a parameter changes; the pixels stay on the GPU."""

from typing import Any

import numpy as np

from airlight.composite import adapt
from airlight.composite.blend import REC709, Rule, resolve
from airlight.composite.codes import CodesComposite
from airlight.composite.mix import LinearComposite
from airlight.debug import DIM, draw
from airlight.errors import AirlightError
from airlight.files import Picture, encode
from airlight.files.colour import srgb_encode
from airlight.gpu.device import Device
from airlight.lights import Light
from airlight.occlusion.automatic import settled
from airlight.parameters import Parameters
from airlight.scatter.epipolar.epipolar import EpipolarPlan
from airlight.scatter.render import ImagePlan
from airlight.viewer import state as st
from airlight.viewer.state import Lamp, ViewerState

SHOW = "viewer/show.wgsl"
UNIFORM = np.dtype(
    [
        *(("area", "f4", 4), ("ground", "f4", 4), ("split", "f4"), ("before_linear", "u4"), ("after_linear", "u4")),
        *(("target_linear", "u4"), ("apron", "i4"), ("gain", "f4"), ("scale", "f4"), ("white", "f4"), ("strength", "f4"), ("", "u4", 3)),
    ]
)
LONGEST = 1920  # px of the longer side; larger pictures are shown, and their shafts computed, at this size
COARSE = 300  # pixels of the longer side that are looked at for the threshold while something is dragged
GROUND = (0.055, 0.06, 0.07)
Area = tuple[float, float, float, float]  # x, y, width, height, px


def fitted(size: tuple[int, int], room: Area) -> Area:
    """Where a picture of width x height lies, whole and in the middle of the room, px; never enlarged beyond twice its size."""
    scale = min(room[2] / size[0], room[3] / size[1], 2.0)
    width, height = (max(1, round(scale * side)) for side in size)
    return (room[0] + (room[2] - width) // 2, room[1] + (room[3] - height) // 2, width, height)


def _smaller(pixels: np.ndarray) -> np.ndarray:
    """(H, W, C) float32 as large as is shown."""
    height, width, channels = pixels.shape
    if max(height, width) <= LONGEST:
        return pixels
    import OpenImageIO as oiio

    factor = LONGEST / max(height, width)
    shape = max(1, round(factor * width)), max(1, round(factor * height))
    given = oiio.ImageBuf(np.ascontiguousarray(pixels, np.float32))
    resized = oiio.ImageBufAlgo.resize(given, "box", 0.0, oiio.ROI(0, shape[0], 0, shape[1], 0, 1, 0, channels))
    return np.ascontiguousarray(resized.get_pixels(oiio.FLOAT)).reshape(shape[1], shape[0], channels)


class PictureView:
    """Shows a picture that was read. Raises AirlightError where it is too large for the device."""

    def __init__(self, device: Device, picture: Picture) -> None:
        self.device = device
        self.coarse = picture.rec709(picture.linear(coarse=True))
        self.bounded = picture.codes.dtype.kind == "u"  # integers: white is white
        self.has_alpha = picture.alpha is not None
        large = max(picture.width, picture.height) > LONGEST
        plain = picture.codes.dtype == np.uint8 and picture.encoding == "srgb" and picture.codes.shape[2] >= 3 and not large
        rgba = np.ones((picture.height, picture.width, 4), np.float32)
        rgba[..., :3] = picture.rec709(picture.linear())
        if picture.alpha is not None:
            rgba[..., 3] = picture.alpha
        self.linear = _smaller(rgba)
        self.size = self.linear.shape[1], self.linear.shape[0]
        if not self.bounded:
            pixels = self.linear
        elif plain:
            pixels = np.full((*picture.codes.shape[:2], 4), 255, np.uint8)
            pixels[..., : picture.codes.shape[2]] = picture.codes
        else:
            pixels = np.rint(255 * np.clip(self.linear, 0, 1)).astype(np.uint8)
            pixels[..., :3] = encode(self.linear[..., :3], np.dtype(np.uint8))
        self.picture_scale = adapt.measured(self.coarse @ REC709).scale
        self.texture = device.texture(*self.size, "rgba8unorm" if self.bounded else "rgba32float", target=False)
        self.pixels = pixels
        self.layer = device.texture(*self.size, "rgba16float")
        self.uniform = device.buffer(size=UNIFORM.itemsize, uniform=True)
        self.plans: dict[Any, ImagePlan] = {}
        self.composites: dict[Any, Any] = {}
        self.done: Any = None  # what the layer was computed for
        self.rule: Rule | None = None
        self.ramp = adapt.Ramp(1.0, 1.0)
        self.late = False  # the rule was measured on the frame before
        self.debugs: dict[str, Any] = {}
        self.binds: dict[Any, Any] = {}

    # what is computed

    def _plan(self, p: Parameters, fraction: bool = False) -> ImagePlan:
        """The passes for such parameters; their lights and the rest are set later."""
        key = p.occlusion, p.border, p.method == "additive", fraction
        if key not in self.plans:
            if len(self.plans) > 3:
                self.plans.clear()
                self.binds.clear()
            plan = ImagePlan(self.device, self.texture, [], p, layer=self.layer, fraction=fraction)
            plan.upload(self.pixels)
            self.plans[key] = plan
        return self.plans[key]

    def update(self, state: ViewerState, hurried: bool) -> bool:
        """Compute what changed. hurried: something is being dragged; the automatic mix then follows a frame late. True if it has to be
        called again. Raises AirlightError for parameters that this picture cannot have."""
        state.allowed = {"occlusion": ("luminance", "contrast", "none", *(("alpha",) if self.has_alpha else ()))}
        lights = [Light((lamp.place[0], lamp.place[1]), lamp.color, lamp.strength) for lamp in state.lamps]
        wanted = (lights, state.parameters, state.composite, hurried)
        fresh = wanted != self.done
        if not fresh and not self.late and not state.timing:
            return False
        if state.parameters.occlusion not in state.allowed["occlusion"]:
            what = "has no transparency" if state.parameters.occlusion == "alpha" else "comes without depths"
            raise AirlightError(f"occlusion {state.parameters.occlusion}: this picture {what}; choose another")
        rule = resolve(state.composite, not self.bounded)
        p = state.parameters
        if self.bounded or rule.adapt:
            step = max(1, max(self.coarse.shape) // COARSE) if hurried else 1
            p = settled(p, self.coarse[::step, ::step], lights, bounded=self.bounded)
        plan = self._plan(p)
        steps: list[Any] = []
        if fresh:
            plan.source.knee["low"], plan.source.knee["high"] = p.knee
            plan.source.write(None, None, plan.scale)
            plan.lights.aim(lights, p)
            self.debugs.clear()
        if fresh or state.timing:
            steps.append(plan.record)
        composite = self._composite(rule)
        first = self.rule is None or not hurried
        passes: list[tuple[str, float]] | None = [] if state.timing else None
        if first and steps:
            plan.submit(*steps, profile=passes)
            steps = []
        before = self.rule, self.ramp
        self.rule = self._measure(composite, rule, plan.scale)
        plan.submit(*steps, composite.record, profile=passes)
        if rule.adapt and isinstance(composite, LinearComposite):
            self.ramp = composite.ramp()
        self.late = hurried and (fresh or before != (self.rule, self.ramp))
        self.done, self.plan, self.composite, self.p = wanted, plan, composite, p
        if passes is not None:
            state.passes = passes
        state.settled = {"threshold": sum(p.knee) / 2, "smoothness": (p.knee[1] - p.knee[0]) / 2, "mix": self.rule.mix or 0.0}
        state.settled["veil"], state.settled["jitter"] = self.rule.veil, p.offset
        return self.late

    def _composite(self, rule: Rule) -> Any:
        codes = self.bounded and not rule.adapt
        key = codes, rule.blend, rule.veil > 0
        if key not in self.composites:
            if codes:
                self.composites[key] = CodesComposite(self.device, self.texture, self.layer, rule)
            else:
                self.composites[key] = LinearComposite(self.device, self.texture, self.layer, rule, self.picture_scale)
        return self.composites[key]

    def _measure(self, composite: Any, rule: Rule, scale: float) -> Rule:
        measured: Rule = composite.measure(rule, scale) if isinstance(composite, LinearComposite) else composite.measure(rule)
        return measured

    def _debug(self, name: str) -> tuple[Any, bool, int]:
        """(texture, whether it is linear light, its apron) of a debug view. Raises AirlightError where there is none."""
        if name == "source":
            return self.plan.source.texture, True, int(self.plan.source.knee["apron"])
        if name not in self.debugs:
            if name == "occlusion":
                plan = self._plan(self.p, fraction=True)
                plan.source.knee["low"], plan.source.knee["high"] = self.p.knee
                plan.source.write(None, None, 1.0)
                plan.submit(plan.source.record)
                self.debugs[name] = plan.source.texture, False, int(plan.source.knee["apron"])
            else:
                self.debugs[name] = self._lines(), False, 0
        found: tuple[Any, bool, int] = self.debugs[name]
        return found

    def _lines(self) -> Any:
        grids = [plan.grid for plan in self.plan.lights.plans if isinstance(plan, EpipolarPlan)]
        if not grids:
            raise AirlightError("there are no lines: only method epipolar has some, in pictures that are not too small")
        canvas = self.linear[..., :3] * np.float32(DIM)
        for grid in grids:
            draw(canvas, grid)
        codes = np.full((*canvas.shape[:2], 4), 255, np.uint8)
        codes[..., :3] = np.rint(255 * srgb_encode(np.clip(canvas, 0, 1)))
        if "lines" not in self.composites:
            self.composites["lines"] = self.device.texture(*self.size, "rgba8unorm", target=False)
        self.device.write(self.composites["lines"], codes, 4 * self.size[0])
        return self.composites["lines"]

    # what is shown

    def show(self, state: ViewerState, target: Any, format: str, area: Area) -> None:
        """Draw onto a texture view of this format: the picture at `area`, px. After `update`."""
        debug = None
        if state.debug:
            try:
                debug = self._debug(state.debug)
            except AirlightError as error:
                st.tell(state, str(error), error=True)
                state.debug = None
        linear = not self.bounded or isinstance(self.composite, LinearComposite)
        after, after_linear, apron = debug or (self.composite.result, linear, 0)
        values = np.zeros((), UNIFORM)
        values["area"], values["ground"] = area, (*GROUND, 1)
        split = 1.0 if not state.shafts and not debug else (state.split or 0.0)
        values["split"] = area[0] + split * area[2]
        values["before_linear"], values["after_linear"], values["apron"] = not self.bounded, after_linear, apron
        values["target_linear"] = format.endswith("srgb")
        values["gain"] = 1 / self.plan.scale if state.debug == "source" else 1.0
        values["scale"], values["white"] = self.ramp.scale, self.ramp.white
        values["strength"] = 0.0 if debug or self.rule is None else self.rule.adapt
        self.device.queue.write_buffer(self.uniform, 0, values.tobytes())
        pipeline = self.device.raster(SHOW, "cover", "show_picture", format)
        if id(after) not in self.binds:
            if len(self.binds) > 8:
                self.binds.clear()
            self.binds[id(after)] = after, self.device.bind(SHOW, self.uniform, self.texture, after)
        encoder = self.device.encoder()
        onto = {"view": target, "load_op": "clear", "store_op": "store", "clear_value": (*GROUND, 1)}
        run = encoder.begin_render_pass(color_attachments=[onto])
        run.set_pipeline(pipeline)
        run.set_bind_group(0, self.binds[id(after)][1])
        run.draw(3)
        run.end()
        self.device.submit(encoder)

    def pixels_shown(self, state: ViewerState) -> np.ndarray:
        """(H, W, 3) uint8 sRGB: what is shown, pixel for pixel of the picture, without the panel."""
        onto = self.device.texture(*self.size, "rgba8unorm")
        self.show(state, onto.create_view(), "rgba8unorm", (0, 0, *self.size))
        width, height = self.size
        return np.frombuffer(self.device.read(onto, 4), np.uint8).reshape(height, width, 4)[..., :3].copy()


def found_light(picture: Picture) -> Lamp:
    """The light of a picture, or a place for one where none is found: its middle, near the top."""
    from airlight.detect import find_light

    found = find_light(picture.rec709(picture.linear(coarse=True)))
    x, y = found.position if found else (0.5, 0.25)
    return Lamp((round(x, 5), round(y, 5)))
