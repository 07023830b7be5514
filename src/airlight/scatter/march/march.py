"""Plans and records the march through depth and shadow maps: the exact walk, steps, and the upsampling of a smaller march."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.slices import among, parts, strips, tell
from airlight.gpu.timing import Timer, compute
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import FOGS, ResolvedMedium
from airlight.scatter.march.cookies import SHAPES, Cookies, shape_of
from airlight.scatter.march.hierarchies import GROUP, Hierarchies
from airlight.scatter.march.profile import SPAN, SPANS, Profile
from airlight.scatter.march.records import FRAME, LIGHT, dark_record, frame_record, light_record
from airlight.scatter.march.refine import PUT, UPSAMPLE_MARKED, Refinement, no_list
from airlight.scatter.march.shade import Shade
from airlight.scatter.march.variance import Moments
from airlight.scatter.march.varying import Dimming, Varying
from airlight.scatter.radial.radial import JITTERS, noise_texture
from airlight.scatter.visibility.table import VisibilityTables
from airlight.shadows import Shadow

SHADERS = ("walk", "steps", "upsample", "transmit", "fill_shade", "soften")
WALK, STEPS, UPSAMPLE, TRANSMIT, SHADE, SOFTEN = (f"scatter/march/{name}.wgsl" for name in SHADERS)
FILTERS = ("nearest", "pcf", "soft", "variance")  # numbered as in steps.wgsl
BEGIN = dict(LIGHT.fields or {})["begin"][1]  # bytes from the start of a light's record


def no_shadow(device: Device) -> Any:
    """Returns the texture that stands where a light has no shadow map."""
    if "no shadow" not in device.kept:
        usage = device.wgpu.TextureUsage
        flags = usage.TEXTURE_BINDING | usage.RENDER_ATTACHMENT
        device.kept["no shadow"] = device.device.create_texture(size=(1, 1, 1), format="depth32float", usage=flags)
    return device.kept["no shadow"]


class March:
    """Integrates the light that a medium scatters, for pictures of a size (width, height).

    layer, transmittance: textures of that size, rgba32float, of the last `record`. layer: in-scattered radiance, and in alpha the length
    of the ray in the medium, metres. transmittance: RGB, 0..1, of that length. profile: of the last `update`, where surfaces are seen
    through; to be drawn on before `record`. refinement: of the last `update`, where pixels are marched by themselves. frame: the uniform
    buffer of a FRAME. visibility_tables: of those lights that go by tables.
    """

    def __init__(self, device: Device, pixels: tuple[int, int]) -> None:
        self.device, self.pixels = device, pixels
        self.layer = device.texture(*pixels, "rgba32float")
        self.transmittance = device.texture(*pixels, "rgba32float")
        self.size = pixels
        self.frame = device.buffer(size=FRAME.itemsize, uniform=True)
        self.profile: Profile | None = None
        self._lights: list[Any] = []
        self._shadows: list[Any] = []
        self._glass: list[Any] = []  # of each light, a buffer or None
        self._pipelines: list[Any] = []
        self._hierarchies = Hierarchies(device)
        self._path = WALK
        self._names: list[str] = []
        self.marched_layers = [self.layer, self.layer]  # of `size`, written in turn by light after light
        self._begins: dict[int, tuple[int, int]] = {}  # pixels at which the next pass of a light begins, where not at the first
        self._binds: dict[Any, tuple[tuple[Any, ...], Any]] = {}
        self._fog: dict[str, int] = {}  # constants of pipelines
        self._varying = Varying(device)
        self._varies = False
        self._tables: list[tuple[Any, Any]] = []  # a buffer and a texture each light, of what dims it
        self._shades: dict[int, tuple[PunctualLight, Shade | None]] = {}  # each light, and where the table of what dims it lies
        self._cookies = Cookies(device)
        self._shapes: list[tuple[Any, Any]] = []  # a texture and a sampler each light
        self._fills: list[tuple[int, Any, Any, Shade]] = []  # tables to be filled: light, for what, pipeline, where they lie
        self._own_frames: dict[int, Any] = {}  # of lights that have the medium otherwise
        self._moments = Moments(device)
        self._radius: int | None = None  # of the moments, where they are needed
        self._drawn: list[Any] = []  # of each shadow map, see Shadow
        self._softening: tuple[int, bool] = (0, True)  # passes, whether Gaussian
        self.refinement: Refinement | None = None
        self._refined: list[Any] = []  # its pipelines
        self.visibility_tables = VisibilityTables(device, pixels, self.layer, self.transmittance)
        self._goal = self.layer  # what is written by the lights that go by steps

    @staticmethod
    def resolve(medium: ResolvedMedium) -> ResolvedMedium:
        """Keeps every setting: the march follows all of them."""
        return medium

    def update(
        self,
        view: Any,
        projection: Any,
        lights: Sequence[tuple[PunctualLight, Shadow | None]],
        medium: ResolvedMedium,
        *,
        jitter: str = "blue",
        share: float = 1.0,
        region: Any = None,
        panes: bool = False,
    ) -> None:
        """Sets what the next `record` sees: matrices (4, 4), world to view space and view to clip space; lights with their shadow maps.

        jitter: of steps, as Parameters.jitter. share: of the picture's width and height, that the march is computed at. region: (2, 3) m,
        a box outside of which the air's noise dims no light. panes: surfaces are seen through, for which it has to keep a `profile`.
        """
        width, height = self.pixels
        lights = self.visibility_tables.update(view, projection, lights, medium, panes)
        if self.visibility_tables.alone:
            self.profile = None
            return
        if medium.varies != self._varies:
            self._varies, self.size = medium.varies, (0, 0)
        passes = passes_of(lights, medium, np.linalg.inv(np.asarray(view, np.float64))[:3, 3])
        self._softening = medium.march.soften, medium.march.soften_kernel == "gaussian"
        self._resize((max(1, round(width * share)), max(1, round(height * share))), max(len(passes), 2 * bool(medium.march.soften)))
        frame = frame_record(view, projection, medium, self.size, self.pixels)
        self.device.queue.write_buffer(self.frame, 0, frame.tobytes())
        self._fit_refinement(passes, medium)
        while len(self._lights) < len(passes):
            self._lights.append(self.device.buffer(size=LIGHT.itemsize, uniform=True))
        if not panes:
            self.profile = None
        elif self.profile is None or self.profile.size != self.size:
            self.profile = Profile(self.device, self.size)
        nothing, self._fog = no_shadow(self.device), {"FOG": FOGS.index(medium.settings.fog), "VARIES": self._varies}
        if self._varies:
            self._fog |= {"NOISE": medium.settings.noise_amount > 0 and medium.air > 0, "GRIDS": len(medium.fields)}
            self._fog["ADDS"] = all(field.blend == "add" for field in medium.fields)
        self._fills = []
        if self._varies:
            self._varying.update(view, projection, self.size[0], medium)
            self._fog["ATLAS"] = bool(self._varying.atlas.corners)
        path = WALK if medium.exact else STEPS
        if path != self._path or len(passes) < len(self._shadows):  # none holds on to the maps of lights that are gone
            self._path = path
            self._binds.clear()
        self._shadows = [nothing if shadow is None else shadow.texture for _, shadow in passes]
        self._glass = [None if shadow is None else shadow.glass for _, shadow in passes]
        if medium.exact:
            self._hierarchies.fit(self._shadows)
        averaged = medium.march.shadow_filter == "variance" and not medium.exact
        self._radius = medium.march.variance_radius if averaged else None
        self._drawn = [None if shadow is None else shadow.drawn for _, shadow in passes]
        self._moments.fit(self._shadows if averaged else [nothing] * len(passes))
        self._shapes = [(self._cookies.none, self.device.sampler()) if light is None else self._cookies.of(light) for light, _ in passes]
        self._names = ["ambient" if light is None else light.word for light, _ in passes]
        self._shades = {}
        self._pipelines, self._refined, self._tables = [], [], [(self._varying.voxels, self._varying.no_table)] * len(passes)
        self._own_frames = {i: buffer for i, buffer in self._own_frames.items() if i < len(passes)}
        for i, (light, shadow) in enumerate(passes):
            self._begins.pop(i, None)
            if light is None:
                self._own_frames.pop(i, None)
                exact = {"EXACT": medium.exact} if self._varies else {}
                self._add_pass(i, dark_record(medium), frame, path, {"LIT": False, "PANES": panes, **self._fog, **exact})
                continue
            own = light.own_medium(medium)
            record = frame
            if own is medium:
                self._own_frames.pop(i, None)
            else:
                record = frame_record(view, projection, own, self.size, self.pixels)
                if i not in self._own_frames:
                    self._own_frames[i] = self.device.buffer(size=FRAME.itemsize, uniform=True)
                self.device.queue.write_buffer(self._own_frames[i], 0, record.tobytes())
            shade = self._shade(i, light, medium, region) if self._varies else None
            self._shades[i] = light, shade
            biased = bool(medium.march.shadow_bias)
            chosen = {**light.flags, "PHASE": medium.lobes(light.anisotropy)[0], "FIRST": i == 0, "BIASED": biased}
            chosen["PLANES"] = len(light.planes())
            chosen |= {**self._fog, "FADES": light.directional and medium.fades_suns}
            chosen |= {"PANES": panes, "GLASS": self._glass[i] is not None, "SHAPE": SHAPES.index(shape_of(light))}
            chosen |= {"FALLS": light.falloff_terms() != (1.0, 0.0, 0.0), "COLOURED": shadow is not None and shadow.coloured}
            if self._varies:
                chosen |= {"TABLE": shade is not None, "EXACT": medium.exact, "TEXTURE": self._tables[i][1] is not self._varying.no_table}
                chosen["RETURNS"] = medium.exact or panes or (shadow is not None and len(shadow.views) > 1)
            if not medium.exact:
                chosen |= {"JITTER": JITTERS[jitter], "FILTER": FILTERS.index(medium.march.shadow_filter)}
                chosen["SNAP"] = medium.march.snap
                chosen["CASCADES"] = light.directional and shadow is not None and len(shadow.views) > 1
            self._add_pass(i, light_record(light, shadow, view, medium, shade), record, path, chosen)

    def _add_pass(self, i: int, light: np.ndarray, frame: np.ndarray, path: str, constants: dict[str, Any]) -> None:
        """Writes the record of the i-th light, and compiles its pass."""
        self.device.queue.write_buffer(self._lights[i], 0, light.tobytes())
        self._pipelines.append(self.device.pipeline(path, "march", **constants))
        if self.refinement is not None:
            self.refinement.write(i, light, frame)
            self._refined.append(self.device.pipeline(path, "march", **constants | {"PANES": False}))

    def _fit_refinement(self, passes: Sequence[tuple[PunctualLight | None, Shadow | None]], medium: ResolvedMedium) -> None:
        """Decides whether pixels are marched by themselves: not where none is a lamp's, and not where light is to be soft."""
        has_lamps = any(light is not None and not light.directional for light, _ in passes)
        if self.size == self.pixels or not medium.march.refine or medium.march.soften or not has_lamps:
            self.refinement = None
        elif self.refinement is None:
            self.refinement = Refinement(self.device, self.pixels)

    def _shade(self, i: int, light: PunctualLight, medium: ResolvedMedium, region: Any) -> Shade | None:
        """Fits the table of what dims the i-th light, and notes if it is to be filled."""
        shade, buffer, texture, key = self._varying.table(i, light, medium, region)
        self._tables[i] = buffer, texture
        if shade is not None and key is not None:
            pipeline = self.device.pipeline(SHADE, "fill", ALONE=shade.alone, DIRECTIONAL=light.directional, **self._fog)
            self._fills.append((i, key, pipeline, shade))
        return shade

    def dimming(self, light: PunctualLight) -> Dimming:
        """Say what dims a light of the last `update`, whose table is filled by the next `record`."""
        i = next((i for i, (one, shade) in self._shades.items() if one is light and shade is not None), None)
        return self._varying.dimming(*((None, None) if i is None else (i, self._shades[i][1])))

    def _resize(self, size: tuple[int, int], lights: int) -> None:
        """Allocates layers of the size that is computed: what is last written is the first of them."""
        is_short = lights > 1 and self.marched_layers[0] is self.marched_layers[1]
        if size != self.size or self._goal is not self.visibility_tables.below or is_short:
            self.size, self._goal = size, self.visibility_tables.below
            first = self._goal if size == self.pixels and not self._varies else self.device.texture(*size, "rgba32float")
            self.marched_layers = [first, self.device.texture(*size, "rgba32float") if lights > 1 else first]
            self._binds.clear()

    def _bound(self, key: Any, path: str, *parts: Any) -> Any:
        """Makes a bind group, or keeps it while `parts` are the same; of a shadow map it holds all layers."""
        had = self._binds.get(key)
        if had is None or any(a is not b for a, b in zip(had[0], parts, strict=True)):
            seen = [part.create_view(dimension="2d-array") if any(part is one for one in self._shadows) else part for part in parts]
            had = self._binds[key] = parts, self.device.bind(path, *seen)
        return had[1]

    def _of_light(self, i: int, depth: Any, refinement: Refinement | None = None) -> Any:
        """Makes the bind group of the i-th light. refinement: for its list of pixels."""
        last = len(self._shadows) - 1
        layers = self.marched_layers if refinement is None else refinement.layers
        target, before = layers[(last - i) % 2], layers[(last - i + 1) % 2]
        if before is target:  # one light alone reads nothing
            before = _spare(self.device)
        if refinement is None:
            light, frame, chosen = self._lights[i], self._own_frames.get(i, self.frame), no_list(self.device)
        else:
            light, frame, chosen = refinement.lights[i], refinement.frames[i], refinement.chosen
        buffer, texture = self._tables[i]
        varying = self._varying.record, self._varying.voxels, buffer
        exact = self._path == WALK
        spare, profile = _no_profile(self.device), None if refinement is not None else self.profile
        panes = (*(spare if profile is None else (profile.spans, profile.values)), self._glass[i] or spare[0])
        first, last_one = (self._hierarchies.buffers[i], ()) if exact else (noise_texture(self.device), (self._moments.views[i],))
        atlas = self._varying.atlas.texture, self.device.sampler(), texture
        more = first, light, *varying, *panes, *last_one, *atlas, *self._shapes[i], chosen
        return self._bound((i, refinement is not None), self._path, frame, light, depth, self._shadows[i], before, target, *more)

    def record(self, encoder: Any, depth: Any, timer: Timer | None = None) -> None:
        """Records the march, from the picture's depth, depth32float, a texture or its view, to `layer`."""
        if self.visibility_tables.alone:
            self.visibility_tables.record(encoder, depth, _spare(self.device), timer)
            return
        if self._path == WALK:
            self._hierarchies.record(encoder, self._shadows, no_shadow(self.device), timer)
        for i, key, pipeline, shade in self._fills:
            varying, (buffer, texture), light = self._varying, self._tables[i], self._lights[i]
            atlas = varying.atlas.texture, self.device.sampler(), varying.no_table
            held = varying.record, varying.voxels, light, buffer, *atlas, *self._shapes[i]
            where = self.frame, light, depth, self._shadows[i], _spare(self.device), self.transmittance
            bind = self._bound(("shade", i), SHADE, *where, *held)
            compute(encoder, pipeline, bind, (-(-shade.count[0] // GROUP), -(-shade.count[1] // GROUP), shade.faces), "light table", timer)
            if texture is not varying.no_table:
                layout = {"bytes_per_row": 4 * shade.stride, "rows_per_image": shade.count[0]}
                encoder.copy_buffer_to_texture({"buffer": buffer, **layout}, {"texture": texture}, shade.texture_size)
            varying.filled(i, key)
        self._fills = []
        if self._radius is not None:
            self._moments.record(encoder, self._radius, self._drawn, timer)
        counts = (-(-self.size[0] // GROUP), -(-self.size[1] // GROUP))
        if self.profile is not None:
            own = {"ALONE": self.size == self.pixels, "SUMS": self.profile.sums.format == "rgba32float"}
            pipeline = self.device.pipeline(SPANS, "gather", MOST=self.profile.knots, **own, FOG=self._fog["FOG"])
            known = self.frame, self._lights[0], depth, self._shadows[0], _spare(self.device), self.transmittance
            bind = self._bound("spans", SPANS, *known, self.profile.extremes, self.profile.sums, self.profile.spans)
            compute(encoder, pipeline, bind, counts, "march spans", timer)
        for i, (pipeline, name) in enumerate(zip(self._pipelines, self._names, strict=True)):
            among(i, len(self._pipelines))
            done = 0
            kind = "march", name, counts
            for column, across in strips(counts[0], kind):
                for row, down in parts(counts[1], spread=True, kind=kind):
                    self._begin_at(i, (column * GROUP, row * GROUP))
                    compute(encoder, pipeline, self._of_light(i, depth), (across, down), f"march {name}", timer)
                    done += across * down
                    tell(done / (counts[0] * counts[1]))
        bound: tuple[Any, ...] = (self.frame, self._lights[0], depth, self._shadows[0])
        for k in range(2 * self._softening[0]):  # along rows, then columns
            pipeline = self.device.pipeline(SOFTEN, "soften", GAUSSIAN=self._softening[1], DOWN=k % 2 == 1, VARIES=self._varies)
            source, target = self.marched_layers[k % 2], self.marched_layers[1 - k % 2]
            compute(encoder, pipeline, self._bound(("soften", k % 2), SOFTEN, *bound, source, target), counts, "march soften", timer)
        if self.size == self.pixels and not self._varies:
            pipeline = self.device.pipeline(TRANSMIT, "transmit", **self._fog)
            bind = self._bound("transmit", TRANSMIT, *bound, _spare(self.device), self.transmittance)
            compute(encoder, pipeline, bind, counts, "march transmittance", timer)
        else:
            entry = "settle" if self.size == self.pixels else "upsample"
            if entry == "upsample":
                counts = (-(-(self.size[0] + 1) // GROUP), -(-(self.size[1] + 1) // GROUP))
            own = {name: value for name, value in self._fog.items() if name in ("FOG", "VARIES")}
            marched, refinement = self.marched_layers[0], self.refinement
            path = UPSAMPLE if refinement is None else UPSAMPLE_MARKED
            marks = () if refinement is None else (refinement.marks,)
            pipeline = self.device.pipeline(path, entry, **own)
            if refinement is not None:
                refinement.measure(encoder, marched, timer)
            bind = self._bound(path, path, *bound, marched, self._goal, self.transmittance, *marks)
            compute(encoder, pipeline, bind, counts, "upsample", timer)
            if refinement is not None:
                self._refine(encoder, refinement, depth, timer)
        self.visibility_tables.record(encoder, depth, _spare(self.device), timer)

    def _refine(self, encoder: Any, refinement: Refinement, depth: Any, timer: Timer | None) -> None:
        """Records the march of the pixels that were marked."""
        refinement.gather(encoder, self.marched_layers[0], timer)
        for i, (pipeline, name) in enumerate(zip(self._refined, self._names, strict=True)):
            refinement.compute(encoder, pipeline, self._of_light(i, depth, refinement), f"march refined {name}", timer)
        pipeline = self.device.pipeline(PUT, "put")
        bound = self.frame, self._lights[0], depth, self._shadows[0], refinement.layers[0], self._goal, refinement.chosen
        refinement.compute(encoder, pipeline, self._bound("put", PUT, *bound), "march refined", timer)

    def _begin_at(self, i: int, pixel: tuple[int, int]) -> None:
        """Let the next pass of the i-th light begin at a pixel."""
        if pixel != self._begins.get(i, (0, 0)):
            self._begins[i] = pixel
            self.device.queue.write_buffer(self._lights[i], BEGIN, np.array(pixel, np.uint32).tobytes())


def passes_of(
    lights: Sequence[tuple[PunctualLight, Shadow | None]], medium: ResolvedMedium, eye: np.ndarray
) -> list[tuple[PunctualLight | None, Shadow | None]]:
    """Orders lights so that the first, whose pass adds the ambient light, has the medium as it is; None where one without light has to.
    Lamps too far from the eye (3,), world, are left out."""
    near = [one for one in lights if one[0].fade(eye, medium) > 0]
    ordered = sorted(near, key=lambda one: one[0].own_medium(medium) is not medium)
    has_own = not ordered or (ordered[0][0].own_medium(medium) is not medium and bool(medium.ambient.any()))
    return [*([(None, None)] if has_own else []), *ordered]


def _spare(device: Device) -> Any:
    """Returns the texture that is bound where nothing is read."""
    if "spare" not in device.kept:
        device.kept["spare"] = device.texture(1, 1, "rgba32float", target=False)
        device.write(device.kept["spare"], np.zeros(4, np.float32).tobytes(), 16)
    return device.kept["spare"]


def _no_profile(device: Device) -> tuple[Any, Any]:
    """Returns what is bound where no profiles are kept: their spans and values."""
    if "no profile" not in device.kept:
        device.kept["no profile"] = device.buffer(size=SPAN.itemsize), device.buffer(size=16)
    found: tuple[Any, Any] = device.kept["no profile"]
    return found
