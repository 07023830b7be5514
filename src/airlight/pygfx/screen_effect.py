"""Keeps the state of a pass whose method works on the picture: the source of the sum, and the plans of its lights."""

from typing import TYPE_CHECKING, Any

import msgspec

from airlight.composite.scene import SceneLayer, measured_step
from airlight.gpu.device import Device
from airlight.gpu.timing import Timer, compute
from airlight.lights import ImageLight
from airlight.options import Parameters
from airlight.pygfx.prepass import Prepass
from airlight.pygfx.uniforms import WHOLE, Region, Seen, Uniforms
from airlight.scatter.render import LightPasses

if TYPE_CHECKING:
    from airlight.pygfx.effect import LightShafts

MASK, LOOK = "pygfx/mask.wgsl", "pygfx/look.wgsl"


class PictureSums:
    """Keeps the source and the layer of one size, rgba16float, and the lights' plans over them."""

    def __init__(self, device: Device, source: Any, p: Parameters, apron: int) -> None:
        width, height = source.size[0] - 2 * apron, source.size[1] - 2 * apron
        self.source = source
        self.shafts = device.texture(width, height, "rgba16float")
        self.plans = LightPasses(device, (width, height), p, source, self.shafts)
        self.lights: list[ImageLight] = []
        self._aimed: Any = None  # (lights, parameters, revisions of cookies)

    def record(self, encoder: Any, lights: list[ImageLight], p: Parameters, timer: Timer | None) -> None:
        """Records the sum of these lights, after which `shafts` holds it."""
        self.lights = lights
        aim = lights, p, [0 if light.cookie is None else light.cookie.revision for light in lights]
        if self._aimed != aim:
            self.plans.update(lights, p)
            self._aimed = aim
        self.plans.record(encoder, timer)


class ScreenSpaceState:
    """Sums the source of a picture along rays to its lights. looked: buffer that pygfx/look.wgsl writes.

    region: where the view lies in the source and the layer: left, top, width, height, of them.
    """

    def __init__(self, device: Device, uniforms: Uniforms, looked: Any) -> None:
        self.device, self.uniforms, self.looked = device, uniforms, looked
        self.region: Region = WHOLE
        self._sums: PictureSums | None = None
        self._prepass: Prepass | None = None
        self._laid_out: Any = None  # (texels, apron) of a source that is our own
        self._binds: dict[Any, Any] = {}

    @property
    def layer(self) -> SceneLayer:
        return SceneLayer(source=self._sums.source, shafts=self._sums.shafts) if self._sums else SceneLayer()

    def record(self, shafts: "LightShafts", encoder: Any, color: Any, depth: Any, seen: Seen, timer: Timer | None) -> None:
        """Records the source, and the sum of the lights that are seen. After `fit`, and after the uniforms are written."""
        assert self._sums is not None
        p, sums = _summed(shafts), self._sums
        passes = self._pipelines(shafts, color.size[:2])
        if seen:
            binds = self._bound(color, depth, sums.source)
            if shafts.in_scene.occluders == "contrast":
                compute(encoder, passes["look"], binds["look"], (1, 1), "look", timer)
            if shafts.in_scene.occluders != "prepass":
                width, height, _ = sums.source.size
                compute(encoder, passes["mask"], binds["mask"], (-(-width // 64), -(-height // 8)), "mask", timer)
            sums.record(encoder, self._in_source(seen), p, timer)
        elif sums.lights:  # or the layer would go on holding shafts
            sums.record(encoder, [], p, timer)

    def fit(self, shafts: "LightShafts", size: tuple[int, int], lit: bool, timer: Timer | None) -> None:
        """Allocates textures for a picture of this size, where it or settings have changed, and finds the view's region in them; draws and
        submits the pre-pass. lit: whether a light is seen."""
        p, scene = _summed(shafts), shafts.in_scene
        share = scene.share(p)
        texels = max(1, round(share * size[0])), max(1, round(share * size[1]))
        apron, source = (1 if p.border == "black" else 0), None
        if scene.occluders == "prepass":
            if lit:
                source, self.region = self._drawn(shafts, size, timer)
        else:
            self.region = WHOLE
        sums = self._sums
        kept = sums is not None and (source is sums.source if source is not None else not lit or self._laid_out == (texels, apron))
        if not kept:
            if source is None:
                source = self.device.texture(texels[0] + 2 * apron, texels[1] + 2 * apron, "rgba16float")
            self._binds.clear()
            self._sums = PictureSums(self.device, source, p, apron)
            self._laid_out = None if scene.occluders == "prepass" else (texels, apron)  # whose texture is another's
        self.uniforms.lay_out(size, texels, apron)

    def _drawn(self, shafts: "LightShafts", size: tuple[int, int], timer: Timer | None) -> tuple[Any, Region]:
        """Draws the source by the pre-pass, for a picture of this size; returns it, and where the view lies in it."""
        if self._prepass is None:
            self._prepass = Prepass(shafts.renderer, shafts.scene, shafts.lights, size)
        drawn = self._prepass
        drawn.scene, drawn.lights, drawn.size, drawn.in_scene = shafts.scene, shafts.lights, size, shafts.in_scene
        drawn.exclude, drawn.include = shafts.exclude, shafts.include
        drawn.draw(shafts.camera, timer)
        x, y, width, height = drawn.view
        across, down, _ = drawn.texture.size
        return drawn.texture, (x / across, y / down, width / across, height / down)

    def _in_source(self, seen: Seen) -> list[ImageLight]:
        """Places the lights in the source."""
        left, top, width, height = self.region
        positions = [(left + width * at.position[0], top + height * at.position[1]) for _, at in seen]
        return [light.seen(position, at.fade) for position, (light, at) in zip(positions, seen, strict=True)]

    def _pipelines(self, shafts: "LightShafts", size: tuple[int, int]) -> dict[str, Any]:
        """Makes the pipelines for the settings as they are; each is compiled once."""
        scene, record = shafts.in_scene, self.uniforms.record
        ratio = size[0] / record["texels"][0]
        taps = 1 if ratio < 4 / 3 else 2 if ratio < 3 else 4
        flags = {"CONES": int(record["cones"]), "CLEAR": scene.clear is not None and scene.occluders == "stencil"}
        return {
            "mask": self.device.pipeline(MASK, "mask", TAPS=taps, CONTRAST=scene.occluders == "contrast", **flags),
            "look": self.device.pipeline(LOOK, "look", STEP=measured_step(size), **flags),
        }

    def _bound(self, color: Any, depth: Any, source: Any) -> dict[str, Any]:
        """Makes the bind groups for the renderer's textures once for each of the two that it draws on in turn."""
        key = id(color), id(depth)
        if key not in self._binds:
            if len(self._binds) > 3:
                self._binds.clear()
            device, shared = self.device, (self.uniforms.buffer, color, depth)
            self._binds[key] = {
                "": shared,  # held, so that no id is used again
                "mask": device.bind(MASK, *shared, source, self.looked, device.sampler("nearest"), device.sampler()),
                "look": device.bind(LOOK, *shared, self.looked),
            }
        found: dict[str, Any] = self._binds[key]
        return found


def _summed(shafts: "LightShafts") -> Parameters:
    """Returns the parameters of the sum: a pre-pass has no apron, since it sees beyond the view."""
    p = shafts.parameters
    drawn = shafts.in_scene.occluders == "prepass" and p.border != "clamp"
    return msgspec.structs.replace(p, border="clamp") if drawn else p
