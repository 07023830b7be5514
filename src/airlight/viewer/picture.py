"""A picture with its shafts on the canvas, computed anew whenever a light or a parameter changes; the pixels stay on the GPU."""

from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np

from airlight.colour import srgb_decode, srgb_encode
from airlight.composite import adapt
from airlight.composite.blend import CompositeSettings, resolve
from airlight.composite.codes import CodesComposite
from airlight.composite.mix import LinearComposite
from airlight.debug import DIM, draw
from airlight.errors import AirlightError
from airlight.files import Picture, encode
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.look.measure import Small, small_copy, white_of
from airlight.luminance import REC709_F32
from airlight.occlusion.automatic import auto_threshold
from airlight.options import Look, Parameters
from airlight.planes import shrink_to, shrunk_size
from airlight.scatter.epipolar.epipolar import EpipolarPlan
from airlight.scatter.methods import METHODS
from airlight.scatter.render import ImagePlan
from airlight.viewer import halved
from airlight.viewer import state as st
from airlight.viewer.controls import Area, within
from airlight.viewer.smart import DRAFT_SIDE, LookView
from airlight.viewer.state import ViewerState

SHOW = "viewer/show.wgsl"
UNIFORM = struct_dtype(SHOW, "Show")
BEFORE, AFTER, BOTH = 1, 2, 3  # SIDES of the shader
LONGEST_DRAFT = 1280  # px of the longer side while something is dragged
COARSE = 300  # pixels of the longer side that are looked at for the threshold while something is dragged
GROUND = (0.055, 0.06, 0.07)


@dataclass
class Pair:
    """The textures that are shown: without shafts, and with them; whether each holds linear light."""

    before: Any
    after: Any
    before_linear: bool
    after_linear: bool


class PictureView:
    """Shows a picture that was read. Raises AirlightError where it is too large for the device."""

    def __init__(self, device: Device, picture: Picture) -> None:
        self.device = device
        self.coarse = picture.rec709(picture.linear(coarse=True))
        self.bounded = picture.codes.dtype.kind == "u"  # integers: white is white
        self.has_alpha = picture.alpha is not None
        self.grey = picture.colour_codes.shape[2] == 1
        large = max(picture.width, picture.height) > halved.LONGEST
        plain = picture.codes.dtype == np.uint8 and picture.encoding == "srgb" and picture.codes.shape[2] >= 3
        plain = plain and not large and not picture.is_transparent  # seen over black
        color = halved.shrunk(picture.rec709(picture.linear()))
        self.size = color.shape[1], color.shape[0]
        self.linear = np.ones((*color.shape[:2], 4), np.float32)
        self.linear[..., :3] = color
        if picture.alpha is not None:
            self.linear[..., 3] = halved.shrunk(picture.alpha[..., None])[..., 0]
        if not self.bounded:
            pixels = self.linear
        elif plain:
            pixels = np.full((*picture.codes.shape[:2], 4), 255, np.uint8)
            pixels[..., : picture.codes.shape[2]] = picture.codes
        else:
            pixels = np.rint(255 * np.clip(self.linear, 0, 1)).astype(np.uint8)
            pixels[..., :3] = encode(self.linear[..., :3], np.dtype(np.uint8))
        self.picture_scale = adapt.measure_ramp(self.coarse @ REC709_F32).scale
        self.texture = device.texture(*self.size, "rgba8unorm" if self.bounded else "rgba32float", target=False)
        self.pixels = pixels
        device.write(self.texture, np.ascontiguousarray(pixels), pixels.shape[1] * pixels[0, 0].nbytes)
        self.layer = device.texture(*self.size, "rgba16float")
        self.uniform = device.buffer(size=UNIFORM.itemsize, uniform=True)
        self.plans: dict[Any, ImagePlan] = {}
        self.composites: dict[Any, Any] = {}
        self.done: Any = None  # what the layer was computed for
        self.settings: CompositeSettings | None = None
        self.ramp = adapt.Ramp(1.0, 1.0)
        self.late = False  # the settings were measured on the frame before
        self.debugs: dict[str, Any] = {}
        self.binds: dict[Any, Any] = {}
        self.pair: Pair | None = None
        self.scaled: Pair | None = None  # of the size in which it is seen
        self.scaled_of: Any = None
        self.version = 0  # of what is computed
        self.whole: LookView | None = None  # the look on all that is shown
        self.draft: LookView | None = None  # and on the copy for drags
        self.seen: tuple[int, int] | None = None  # px of the canvas that the picture took in the last frame
        self.view: Any = None  # of the two, which is shown
        self.was_smart: bool | None = None
        self.half: Any = None  # a small copy with the sum, for drags

    # what is computed

    def forget(self) -> None:
        """Compute all anew, where it was left unfinished."""
        self.done, self.scaled_of = None, None
        for view in (self.whole, self.draft, self.half):
            if view is not None:
                view.forget()

    def _plan(self, p: Parameters, fraction: bool = False) -> ImagePlan:
        """Plan the passes for such parameters; their lights and the rest are set later."""
        key = p.occlusion, p.border, METHODS[p.method].stencilled, fraction
        if key not in self.plans:
            if len(self.plans) > 3:
                self.plans.clear()
                self.binds.clear()
            plan = ImagePlan(self.device, self.texture, [], p, layer=self.layer, fraction=fraction)
            plan.upload(self.pixels)
            self.plans[key] = plan
        return self.plans[key]

    def update(self, state: ViewerState, hurried: bool, seen: tuple[int, int] | None = None) -> bool:
        """Compute what changed. hurried: something is being dragged, and a draft will do; seen: px of the canvas that the picture takes.
        True if it has to be called again. Raises AirlightError for parameters that this picture cannot have."""
        if self.was_smart != state.is_smart:
            self.was_smart, self.done, state.automatic = state.is_smart, None, {}
            if self.whole is not None:
                self.whole.done = None
        if state.is_smart:
            return self._update_look(state, hurried, seen or self.size)
        small = hurried and not state.debug and not state.timing and max(self.size) > halved.SIDE
        return halved.follow(self, state) if small else self._update_sum(state, hurried)

    def _update_look(self, state: ViewerState, hurried: bool, seen: tuple[int, int]) -> bool:
        """Put the smart look on the picture; on the copy for drags while hurried."""
        if state.unplaced:
            state.doubt, state.automatic = state.ask, {}
            self.pair = Pair(self.texture, self.texture, not self.bounded, not self.bounded)
            return False
        lights = [control.image_light() for control in state.lights]
        wanted = lights, state.look
        whole = self._whole(state.parameters.quality)
        is_draft = hurried and whole.done != wanted
        view = self._draft(seen, whole.white) if is_draft else whole
        fresh = view.done != wanted
        passes: list[tuple[str, float]] | None = [] if state.timing else None
        if fresh or passes is not None:
            view.update(lights, _drawn_as(whole, state.look) if is_draft else state.look, passes)
            view.done, state.passes = wanted, passes or []
            self.version += 1
        if fresh and not is_draft:
            state.automatic = view.unset()
        stale = not hurried and (self.draft is None or self.draft.size != self._draft_size(seen))
        if stale and not fresh and self.seen == seen:  # there is time
            self._draft(seen, whole.white)
            stale = False
        state.doubt = "\n".join(line for line in (state.ask, view.message) if line)
        self.pair = Pair(view.before, view.result, not self.bounded, not self.bounded)
        self.view, self.seen = view, seen
        return stale

    def _whole(self, quality: str) -> LookView:
        """Plan the look on all that is shown."""
        if self.whole is None or self.whole.quality != quality:
            self._drop(self.whole)
            white = 1.0 if self.bounded else white_of(self.coarse)
            small = small_copy(self.coarse, white, None, self.size)
            self.whole = LookView(self.device, self.pixels, small, white, quality, self.grey, self.texture)
        return self.whole

    def _drop(self, view: LookView | None) -> None:
        """Let go of a view that another one follows."""
        if view is not None:
            view.drop()
            self.binds.clear()

    def _draft_size(self, seen: tuple[int, int]) -> tuple[int, int]:
        """Give (width, height) of the copy for drags: as it is seen, and no larger than the picture."""
        scale = min(1.0, LONGEST_DRAFT / max(seen), *(n / m for n, m in zip(self.size, seen, strict=True)))
        return max(1, round(seen[0] * scale)), max(1, round(seen[1] * scale))

    def _draft(self, seen: tuple[int, int], white: float) -> LookView:
        """Plan the look on the copy for drags, which looks as the picture does on the canvas."""
        size = self._draft_size(seen)
        if self.draft is None or self.draft.size != size:
            self._drop(self.draft)
            if size == self.size:
                pixels = self.pixels
            elif self.bounded:
                onto = self.device.texture(*size, "rgba8unorm")
                self._draw(Pair(self.texture, self.texture, False, False), onto.create_view(), "rgba8unorm", (0, 0, *size), BEFORE)
                pixels = np.frombuffer(self.device.read(onto, 4), np.uint8).reshape(size[1], size[0], 4)
            else:
                pixels = halved.shrunk(self.linear, max(size))
            small = Small(shrink_to(self.coarse, *shrunk_size(*size, DRAFT_SIDE)) / white)
            self.draft = LookView(self.device, pixels, small, white, "draft", self.grey)
        return self.draft

    def _update_sum(self, state: ViewerState, hurried: bool) -> bool:
        """Put the sum's layer on the picture; while hurried the automatic mix follows a frame late."""
        state.doubt = ""
        state.allowed = {"occlusion": ("luminance", "contrast", "none", *(("alpha",) if self.has_alpha else ()))}
        lights = [replace(control, kind=None).image_light() for control in state.lights]
        wanted = (lights, state.parameters, state.composite, hurried)
        fresh = wanted != self.done
        if not fresh and not self.late and not state.timing:
            return False
        if state.parameters.occlusion not in state.allowed["occlusion"]:
            what = "has no transparency" if state.parameters.occlusion == "alpha" else "comes without depths"
            raise AirlightError(f"occlusion {state.parameters.occlusion}: this picture {what}; choose another")
        settings = resolve(state.composite, not self.bounded)
        p = state.parameters
        if hurried and "quality" in METHODS[p.method].options:
            p = msgspec.structs.replace(p, quality="draft")
        if self.bounded or settings.adapt:
            step = max(1, max(self.coarse.shape) // COARSE) if hurried else 1
            p = auto_threshold(p, self.coarse[::step, ::step], lights, bounded=self.bounded)
        plan = self._plan(p)
        steps: list[Any] = []
        if fresh:
            plan.source.knee["low"], plan.source.knee["high"] = p.knee
            plan.source.write(None, None, plan.scale)
            plan.lights.update(lights, p)
            self.debugs.clear()
        if fresh or state.timing:
            steps.append(plan.record)
        composite = self._composite(settings)
        first = self.settings is None or not hurried
        passes: list[tuple[str, float]] | None = [] if state.timing else None
        if first and steps:
            plan.submit(*steps, profile=passes)
            steps = []
        before = self.settings, self.ramp
        self.settings = self._measure(composite, settings, plan.scale)
        plan.submit(*steps, composite.record, profile=passes)
        if settings.adapt and isinstance(composite, LinearComposite):
            self.ramp = composite.ramp()
        self.late = hurried and (fresh or before != (self.settings, self.ramp))
        self.done, self.plan, self.composite, self.p = wanted, plan, composite, p
        self.version += 1
        self.pair = Pair(self.texture, composite.result, not self.bounded, not self.bounded or isinstance(composite, LinearComposite))
        if passes is not None:
            state.passes = passes
        state.automatic = {"threshold": sum(p.knee) / 2, "smoothness": (p.knee[1] - p.knee[0]) / 2, "mix": self.settings.mix or 0.0}
        state.automatic["veil"], state.automatic["jitter"] = self.settings.haze_floor, p.offset
        return self.late

    def _composite(self, settings: CompositeSettings) -> Any:
        codes = self.bounded and not settings.adapt
        key = codes, settings.blend, settings.haze_floor > 0
        if key not in self.composites:
            if codes:
                self.composites[key] = CodesComposite(self.device, self.texture, self.layer, settings)
            else:
                self.composites[key] = LinearComposite(self.device, self.texture, self.layer, settings, self.picture_scale)
        return self.composites[key]

    def _measure(self, composite: Any, settings: CompositeSettings, scale: float) -> CompositeSettings:
        scales = (scale,) if isinstance(composite, LinearComposite) else ()
        measured: CompositeSettings = composite.measure(settings, *scales)
        return measured

    def _debug(self, name: str) -> tuple[Any, bool, int]:
        """Make a debug view: (texture, whether it is linear light, its apron). Raises AirlightError where there is none."""
        if self.was_smart:
            if name not in st.DEBUG_LOOK or self.view is None or not self.view.plan.lights:
                raise AirlightError(f"there is no view {name} of the smart look: choose the classic one")
            return self.view.matte(0), False, 0
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
        """Draw the picture at `area`, px, onto a texture view of this format. After `update`."""
        debug = None
        if state.debug:
            try:
                debug = self._debug(state.debug)
            except AirlightError as error:
                st.tell(state, str(error), error=True)
                state.debug = None
        pair = self.pair
        assert pair is not None
        if debug:
            gain = 1 / self.plan.scale if state.debug == "source" and not state.is_smart else 1.0
            seen = Pair(pair.before, debug[0], pair.before_linear, debug[1])
            self._draw(seen, target, format, area, AFTER, apron=debug[2], gain=gain, grey=state.is_smart)
            return
        split = 1.0 if not state.is_lit else (state.split or 0.0)
        sides = BEFORE if split >= 1 else AFTER if split <= 0 else BOTH
        size = int(area[2]), int(area[3])
        ramp = {} if state.is_smart or self.settings is None else self._ramp(self.settings)
        if size != (pair.before.width, pair.before.height):
            pair, ramp = self._scaled(pair, size, ramp), {}
        self._draw(pair, target, format, area, sides, split=area[0] + split * area[2], **ramp)

    def _ramp(self, settings: CompositeSettings) -> dict[str, float]:
        """Find what adapts the picture with its shafts."""
        return {"scale": self.ramp.scale, "white": self.ramp.white, "strength": settings.adapt} if settings.adapt else {}

    def _scaled(self, pair: Pair, size: tuple[int, int], ramp: dict[str, float]) -> Pair:
        """Encode the two as codes in the size in which they are seen, made anew where they changed, so that other frames are cheap."""
        if self.scaled is None or (self.scaled.before.width, self.scaled.before.height) != size:
            before, after = (self.device.texture(*size, "rgba8unorm") for _ in range(2))
            self.scaled = Pair(before, after, False, False)
            self.scaled_of = None
        key = self.version, id(pair.before), id(pair.after)
        if self.scaled_of != key:
            self.scaled_of = key
            for sides, onto in ((BEFORE, self.scaled.before), (AFTER, self.scaled.after)):
                self._draw(pair, onto.create_view(), "rgba8unorm", (0, 0, *size), sides, **ramp)
        return self.scaled

    def _draw(self, pair: Pair, target: Any, format: str, area: Area, sides: int, **options: float) -> None:
        """Draw two textures, or one, onto a texture view. options: of the uniform, and grey."""
        after = pair.after
        values = np.zeros((), UNIFORM)
        values["area"], values["gain"] = area, 1.0
        grey = options.pop("grey", False)
        for name, value in options.items():
            values[name] = value
        self.device.queue.write_buffer(self.uniform, 0, values.tobytes())
        is_encoded = format.endswith("srgb")
        constants: dict[str, float] = {
            "SIDES": sides,
            "EXACT": (int(area[2]), int(area[3])) == (pair.before.width, pair.before.height) and not grey,
            "BEFORE_LINEAR": pair.before_linear,
            "AFTER_LINEAR": pair.after_linear,
            "TARGET_LINEAR": is_encoded,
            "ADAPTS": "strength" in options,
            "GREY": grey,
        }
        pipeline = self.device.raster(SHOW, "cover", "show_picture", format, **constants)
        key = id(pair.before), id(after)
        if key not in self.binds:
            if len(self.binds) > 8:
                self.binds.clear()
            self.binds[key] = pair, self.device.bind(SHOW, self.uniform, pair.before, after)
        ground = srgb_decode(np.array(GROUND)) if is_encoded else GROUND
        onto = {"view": target, "load_op": "clear", "store_op": "store", "clear_value": (*(float(v) for v in ground), 1)}
        encoder = self.device.encoder()
        run = encoder.begin_render_pass(color_attachments=[onto])
        run.set_pipeline(pipeline)
        run.set_bind_group(0, self.binds[key][1])
        run.set_scissor_rect(*within(area, target.texture.size))
        run.draw(3)
        run.end()
        self.device.submit(encoder)

    def pixels_shown(self, state: ViewerState) -> np.ndarray:
        """Read back what is shown, pixel for pixel of the picture, without the panel: (H, W, 3) uint8 sRGB."""
        if state.is_smart and self.pair is not None:
            self.update(state, False, self.seen)
        onto = self.device.texture(*self.size, "rgba8unorm")
        self.show(state, onto.create_view(), "rgba8unorm", (0, 0, *self.size))
        width, height = self.size
        return np.frombuffer(self.device.read(onto, 4), np.uint8).reshape(height, width, 4)[..., :3].copy()


def _drawn_as(whole: LookView, look: Look) -> Look:
    """Give the look as many drawn rays as the picture was given last, lest they come and go in a drag."""
    known = whole.resolved
    if look.rays is not None or known is None or not any(one.kind == "beyond" for one in known.lights):
        return look
    return msgspec.structs.replace(look, rays=max(one.rays for one in known.lights))
