"""Puts light shafts on a renderer's picture: the effect pass."""

import math
import weakref
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import msgspec
import pygfx as gfx
import wgpu

from airlight.composite.scene import SceneComposite, SceneCompositeSettings, SceneLayer
from airlight.composite.view import check as check_view
from airlight.errors import AirlightError
from airlight.gpu.device import WANTED_FEATURES, Device
from airlight.gpu.timing import Timer, divide
from airlight.medium.resolve import ResolvedMedium
from airlight.options import Composite, March, Medium, Parameters, SceneOptions
from airlight.pygfx.air import AirOfScene
from airlight.pygfx.lights import SceneLight
from airlight.pygfx.medium_effect import MediumState
from airlight.pygfx.panes import Panes
from airlight.pygfx.private import use_hdr
from airlight.pygfx.screen_effect import ScreenSpaceState
from airlight.pygfx.surface_shadows import SurfaceShadows
from airlight.pygfx.uniforms import WHOLE, Region, Uniforms
from airlight.scatter.methods import AUTO, DEFAULT, FOR_MEDIUM, METHODS, check_ray


@lru_cache(maxsize=4)
def _device(device: Any) -> Device:
    """Keeps one cache of pipelines for each device."""
    return Device(device)


def enable_timing() -> bool:
    """Let pygfx's device measure times, for `profile`, and blend what is seen through in single precision; called before anything of pygfx
    is on the GPU. False: too late, or none can."""
    adapter = wgpu.gpu.request_adapter_sync(power_preference="high-performance")
    if "timestamp-query" not in adapter.features:
        return False
    try:
        gfx.renderers.wgpu.enable_wgpu_features(*(name for name in WANTED_FEATURES if name in adapter.features))
    except RuntimeError:  # the device is there already
        return False
    return True


class LightShafts(gfx.renderers.wgpu.EffectPass):
    """Puts light shafts on what a gfx.WgpuRenderer renders: a pass for its `effect_passes`, one instance for each entry there.

    scene and camera: those that are rendered. lights: at most 8. parameters: how the shafts are summed (its occlusion, threshold,
    smoothness and scale mean nothing here); composite: its mix and adapt; in_scene: the rest. All may be set at any time.
    exclude, include: objects that hide nothing, or do although they are seen through; with occluders prepass.
    medium, march: with methods that light a medium, through shadow maps; without parameters they ask for march. Without them, and without
    fields, method auto is epipolar. Of
    `in_scene` these take the resolution and the tones, of `exclude` what casts no shadow.

    lights, parameters, composite, in_scene, exclude, include, medium, march; `fields`: densities on grids that join the medium's, each a
    medium.field.Field, a Volume, or what gives one by `field()`; `time`: seconds, of what the wind moves; `radius`: metres of a sphere
    around the scene, from which unset parts of the medium follow; None: around what casts shadows; `daylight`: a scenes.daylight.Daylight
    whose air lies before the picture, or None; `enabled`: False costs nothing; `dt`:
    seconds since the last frame, which light adaptation follows (0: it settles at once); `still`: anything that can be compared. While it
    stays the same a shadow map is kept as long as the same meshes cast, and their bounds and the map lie where they did: it has to change
    where bones, morph targets, instances, vertices or holes change within bounds. None: maps are drawn in each frame. `pre_exposure`:
    factor that the scene's own radiances hold already, of which the exposure is what is left; `automatic_ev`: stops, where `in_scene` says
    none; `debug`: None, or occlusion (of a medium: what is seen through it), source (the light of the medium) or lines to see instead;
    `timing`: whether `profile` is wanted; `doubts`: whether a medium that hides all, is dark or unseen is told, by one AirlightWarning.
    `source`, `layer`: textures of the last frame, linear, rgba16float; of a medium, `resolved_medium`, there is no source, and the layer is
    rgba32float: in- scattered radiance, and the length of the ray in the medium, metres; `transmittance`, RGB, belongs to it: None where it
    is 1 everywhere.
    Raises AirlightError.
    """

    USES_DEPTH = True

    def __init__(
        self,
        renderer: Any,
        scene: Any,
        camera: Any,
        lights: Sequence[SceneLight] | SceneLight,
        parameters: Parameters | None = None,
        composite: Composite | None = None,
        in_scene: SceneOptions | None = None,
        *,
        medium: Medium | None = None,
        march: March | None = None,
        fields: Sequence[Any] = (),
        exclude: Sequence[Any] = (),
        include: Sequence[Any] = (),
    ) -> None:
        super().__init__()
        self.renderer, self.scene, self.camera = renderer, scene, camera
        self.lights = [lights] if isinstance(lights, SceneLight) else list(lights)
        of_medium = medium is not None or march is not None or len(fields) > 0
        self._has_medium = of_medium
        self.parameters = parameters or (Parameters(method=FOR_MEDIUM) if of_medium else Parameters())
        self.composite, self.in_scene = composite or Composite(), in_scene or SceneOptions()
        self._medium, self.march = medium or Medium(), march or March()
        self.exclude, self.include = list(exclude), list(include)
        self.fields: list[Any] = list(fields)
        self.time = 0.0
        self.radius: float | None = None
        self.daylight: Any = None
        self.debug: str | None = None
        self.still: Any = None
        self.dt, self.timing, self.doubts = 0.0, False, True
        self.pre_exposure, self.automatic_ev = 1.0, 0.0
        self.device = _device(renderer.device)
        self._uniforms = Uniforms(self.device)
        self._merge = SceneComposite(self.device, self._uniforms.buffer)
        self._state: ScreenSpaceState | MediumState | None = None
        self._timer: Timer | None = None
        self._encoder: Any = None  # which was recorded on last
        self._surfaces = SurfaceShadows(self)
        self._air: AirOfScene | None = None  # of methods of the screen
        self.view_table: Any = None  # of daylight, for pictures of any size
        self.panes = Panes(self)

    @property
    def parameters(self) -> Parameters:
        return self._parameters

    @parameters.setter
    def parameters(self, parameters: Parameters) -> None:
        self._asked = parameters
        plain: dict[str, Any] = {"scale": 1.0} if parameters.scale != 1.0 else {}
        if parameters.method == AUTO and not self._has_medium:
            plain["method"] = DEFAULT
        check_ray(plain.get("method", parameters.method), parameters.density)
        self._parameters = msgspec.structs.replace(parameters, **plain) if plain else parameters

    @property
    def medium(self) -> Medium:
        return self._medium

    @medium.setter
    def medium(self, medium: Medium) -> None:
        self._medium, self._has_medium = medium, True
        self.parameters = self._asked

    @property
    def in_scene(self) -> SceneOptions:
        return self._in_scene

    @in_scene.setter
    def in_scene(self, in_scene: SceneOptions) -> None:
        check_view(in_scene.view_transform)  # later it would be an error in each frame
        self._in_scene = in_scene

    @property
    def _layer(self) -> SceneLayer:
        return self._state.layer if self._state else SceneLayer()

    @property
    def source(self) -> Any:
        """Returns what was summed, or None before the first frame, and where a medium is lit."""
        return self._layer.source

    @property
    def layer(self) -> Any:
        """Returns the shafts alone, at the resolution of the source, of a medium at that of the picture; None before the first frame."""
        return self._layer.shafts if self._layer.radiance is None else self._layer.radiance

    @property
    def transmittance(self) -> Any:
        """Returns the RGB transmittance, 0..1, of the medium of the last frame; None where that is 1 everywhere."""
        return self._layer.transmittance

    @property
    def region(self) -> Region:
        """Returns where the view lies in source and layer: left, top, width, height, of them."""
        return self._state.region if isinstance(self._state, ScreenSpaceState) else WHOLE

    @property
    def is_lit(self) -> bool:
        """Tells whether a light was seen in the last frame; otherwise `source` is an older one's."""
        return bool(self._uniforms.record["aims"] > 0)

    @property
    def resolved_medium(self) -> ResolvedMedium | None:
        """Returns the medium of the last frame, with nothing unset; None where none is lit."""
        return self._state.resolved if isinstance(self._state, MediumState) else None

    @property
    def lacks(self) -> str | None:
        """Words what of the scene the method left out of the last frame's medium; None where it has all of it, or lights none."""
        return self._state.lacks if isinstance(self._state, MediumState) else None

    @property
    def levels(self) -> Any:
        """Returns the buffer of light adaptation: scale and white of its ramp; average, least and greatest luminance in stops."""
        return self._merge.balance

    @property
    def statistics(self) -> Any:
        """Returns the buffer of what contrast measures: occluders' mean RGB, the fog's level, and its distance, float32."""
        return self._merge.looked

    @property
    def exposure(self) -> float:
        """Computes the factor of what is drawn, for a display: exactly 1 where no exposure is left to do."""
        ev = self.automatic_ev if self.in_scene.ev is None else self.in_scene.ev
        return float(2.0**ev / self.pre_exposure)

    def shared(self, color: Any, depth: Any, layer: SceneLayer) -> tuple[Any, ...]:
        """Lists what composite/scene.wgsl binds: SceneComposite.shared."""
        return self._merge.shared(color, depth, layer)

    def profile(self) -> list[tuple[str, float]]:
        """Reads (label, ms) of each pass of the last frame, if `timing` was set then; empty where the device has no timestamps, see
        `enable_timing`. Waits for the frame."""
        return self._timer.milliseconds() if self._timer else []

    def render(self, command_encoder: Any, color_tex: Any, depth_tex: Any, target_tex: Any) -> None:
        """Record the passes, as EffectPass.render: from color_tex and depth_tex to target_tex, texture views."""
        if self._encoder is not None and self._encoder() is command_encoder:
            raise AirlightError("one LightShafts stands twice in effect_passes: make an instance for each place")
        self._encoder = weakref.ref(command_encoder)
        timer = self._begin_timing()
        color, depth = color_tex.texture, depth_tex.texture
        size: tuple[int, int] = color.size[:2]
        seen = self._uniforms.update(self.camera, self.lights, self.in_scene.share(self.parameters), size)
        medium = self._medium_state(size) if METHODS[self.parameters.method].lights_medium else None
        screen = self._screen_state() if medium is None else None
        if screen is not None:
            screen.fit(self, size, bool(seen), timer)
        # before any pass that reads them is recorded, since work in slices submits passes one by one
        self._uniforms.write(
            self.region, self.composite, self.in_scene, self._follow(), self.exposure, self.medium.extinction_share
        )
        if medium is not None:
            medium.record(self, command_encoder, depth, timer)
        if screen is not None:
            if self.daylight is not None:
                self._air = self._air if self._air is not None and self._air.size == size else AirOfScene(self.device, size)
                color = self._air.behind(self, command_encoder, color, depth, timer)
            screen.record(self, command_encoder, color, depth, seen, timer)
        divide(command_encoder)
        settings = self._composite_settings(bool(seen))
        if medium is not None and (picture := medium.draw_panes(self, command_encoder, color, depth, timer)) is not None:
            color, settings = picture, replace(settings, done=True)
        self._merge.record(command_encoder, color, depth, self._layer, settings, target_tex, timer)
        if timer:
            timer.resolve(command_encoder)

    def _medium_state(self, size: tuple[int, int]) -> MediumState:
        """Returns the state for a method that lights a medium, anew where the method or the picture's size has changed."""
        method, state = self.parameters.method, self._state
        if not isinstance(state, MediumState) or state.key != (method, size):
            casters = state.casters if isinstance(state, MediumState) else None
            state = self._state = MediumState(self.device, self.scene, method, size, casters)
        return state

    def _screen_state(self) -> ScreenSpaceState:
        """Returns the state for a method that works on the picture."""
        if not isinstance(self._state, ScreenSpaceState):
            self._state = ScreenSpaceState(self.device, self._uniforms, self._merge.looked)
        return self._state

    def _follow(self) -> float:
        """Computes the share that light adaptation takes of what it measures now, 0..1."""
        at_once = not self._merge.has_balance or self.dt <= 0 or self.in_scene.adapt_seconds == 0
        return 1.0 if at_once else -math.expm1(-self.dt / self.in_scene.adapt_seconds)

    def _composite_settings(self, lit: bool) -> SceneCompositeSettings:
        """Says how the layer is put on the picture."""
        scene = self.in_scene
        return SceneCompositeSettings(
            is_lit=lit,
            contrast=scene.occluders == "contrast",
            gather=scene.depth_aware > 0,
            extinction=self.medium.extinction,
            adapt=self.composite.adapt > 0,
            expose=self.exposure != 1.0,
            view_transform=scene.view_transform,
            debug=self.debug,
        )

    def _begin_timing(self) -> Timer | None:
        if not self.timing:
            return None
        if self._timer is None:
            self._timer = Timer(self.device)
        self._timer.labels.clear()
        return self._timer


def add_light_shafts(renderer: Any, scene: Any, camera: Any, lights: Sequence[SceneLight] | SceneLight, **keywords: Any) -> LightShafts:
    """Adds a LightShafts behind the renderer's own effect passes, but before its anti-aliasing, on a picture in half floats (`use_hdr`).

    keywords: as LightShafts.
    """
    use_hdr(renderer)
    shafts = LightShafts(renderer, scene, camera, lights, **keywords)
    passes = list(renderer.effect_passes)
    smoothing = [step for step in passes if isinstance(step, gfx.renderers.wgpu.PPAAPass)]
    renderer.effect_passes = [step for step in passes if step not in smoothing] + [shafts, *smoothing]
    return shafts
