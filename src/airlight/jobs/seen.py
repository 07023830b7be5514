"""Judges what a frame of a scene shows of its medium and its lamps: a medium that hides all or is not seen, a lamp out of the view."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from airlight.messages import say
from airlight.scatter.methods import FOR_MEDIUM, METHODS

if TYPE_CHECKING:
    import numpy as np

    from airlight.medium.resolve import ResolvedMedium
    from airlight.pygfx import LightShafts
    from airlight.scenes.offline import Frame, Studio

NEARLY_ALL = 0.95  # of the surfaces
HARDLY_ANY = 1e-3  # of the pixels
BLACK_LINEAR = 6e-4  # code 2 of 255, on a display: less light is not seen
LOOKED_AT = 50_000  # pixels, about
NAMED = 3  # lamps in a line


def some(shape: tuple[int, ...]) -> Any:
    """Choose evenly spaced pixels, some LOOKED_AT of them, of arrays of a shape (h, w, ...): an index."""
    step = max(1, int((shape[0] * shape[1] / LOOKED_AT) ** 0.5))
    return slice(step // 2, None, step), slice(step // 2, None, step)


def doubt_of_medium(
    medium: "ResolvedMedium",
    length: "np.ndarray",
    drawn: "np.ndarray",
    light: "np.ndarray | None",
    picture: "np.ndarray | None",
    own: "np.ndarray | None" = None,
) -> str | None:
    """Word one line where a medium hides nearly all surfaces, or neither dims nor lights anything by a visible contrast; else None.

    It hides them where it is dense before them, see `is_dense`, and nearly none shows by its own light.
    length: (n,) metres of each ray in the medium, where its density is 1; drawn: (n,) whether it ends at a surface. light, picture, own:
    (n, 3) what the medium scatters, the picture, and what the medium leaves of the surfaces' light, all linear, for a display; None: not
    known; the first two are then taken to be seen, the last not to be.
    """
    import numpy as np

    from airlight.medium.resolve import VISIBLE_CONTRAST, hides, is_too_thin

    depths = length[:, None] * medium.sigma_t
    if not depths.size or not depths.any():  # an empty one is meant so
        return None
    if is_dense(medium, depths[drawn]):
        shown = 0.0
        if own is not None:
            there = own if light is None else own + light
            shown = float(np.mean(((own > VISIBLE_CONTRAST * there) & (own > BLACK_LINEAR))[drawn].any(axis=1)))
        if shown < 1 - NEARLY_ALL:
            return hides(medium, float(np.median(length[drawn])))
    if depths.max() > -np.log(1 - VISIBLE_CONTRAST) or light is None or picture is None:
        return None
    visible = np.maximum(VISIBLE_CONTRAST * picture.max(axis=1), BLACK_LINEAR)
    shows = (light.max(axis=1) > visible).mean() > HARDLY_ANY
    return None if shows else is_too_thin(medium, float(np.median(length[drawn] if drawn.any() else length)))


def is_dense(medium: "ResolvedMedium", depths: "np.ndarray") -> bool:
    """Tell whether before more than half of the surfaces a contrast of 1, in luminance, is not seen. depths: (n, 3), optical."""
    import numpy as np

    from airlight.luminance import REC709_F32
    from airlight.medium.resolve import VISIBLE_CONTRAST

    hiding = medium.least_seen < VISIBLE_CONTRAST
    return bool(len(depths) and hiding and (np.exp(-depths) @ REC709_F32 < VISIBLE_CONTRAST).mean() > 0.5)


def doubt_of_frame(studio: "Studio", frame: "Frame", depth: "np.ndarray") -> str | None:
    """Judge the medium of a frame that was just drawn, see `doubt_of_medium`, and what lights it. depth: (H, W) of 0..1."""
    import numpy as np

    from airlight.jobs.thin_air import doubt_of_lamps
    from airlight.medium.resolve import VISIBLE_CONTRAST

    shafts = studio.shafts
    medium = shafts.resolved_medium
    if medium is None or not METHODS[shafts.parameters.method].has_units:
        return None
    at = some(depth.shape)
    y, x = (np.arange(n)[one] for n, one in zip(depth.shape, at, strict=True))
    sides = frame.rays[0] * (x + 0.5) / depth.shape[1] + frame.rays[2], frame.rays[1] * (y + 0.5) / depth.shape[0] + frame.rays[3]
    slope = np.sqrt(1 + sides[0][None, :] ** 2 + sides[1][:, None] ** 2)
    drawn = depth[at] < 1
    length = np.minimum(np.where(drawn, frame.axial(depth[at]) * slope, np.inf), medium.max_distance)
    if (medium.settings.fog != "none" or medium.varies) and shafts.transmittance.size[:2] == depth.shape[::-1]:
        length = medium.optical_length(studio.read(shafts.transmittance, np.float32)[at][..., :3])
    light = picture = own = None
    thin = float((length.max() * medium.sigma_t).max()) < -np.log(1 - VISIBLE_CONTRAST)
    dense = is_dense(medium, length[drawn][:, None] * medium.sigma_t)
    lamps = lamp_heights(shafts.lights) if METHODS[shafts.parameters.method].lights_medium else {}
    if (thin or dense or lamps) and shafts.layer.size[:2] == depth.shape[::-1]:  # its light decides, which is read in these cases alone
        factor = np.float32(2.0**studio.ev / studio.pre)
        mix = np.float32(1 if shafts.composite.mix is None else shafts.composite.mix)
        light = (studio.read(shafts.layer, np.float32)[at][..., :3] * (factor * mix)).reshape(-1, 3)
        picture = (frame.picture[at][..., :3].astype(np.float32) * (factor if studio.linear else np.float32(1))).reshape(-1, 3)
        if dense:
            through = np.exp(-length[..., None] * medium.sigma_t).astype(np.float32)
            own = (studio.surfaces()[at] * through * factor).reshape(-1, 3)
    line = doubt_of_medium(medium, length.ravel(), drawn.ravel(), light, picture, own)
    if line is None and light is not None and picture is not None:
        line = doubt_of_lamps(medium.seen_from([-v for v in medium.origin]), studio.stage.radius, lamps, light, picture)
    return line or doubt_of_pass(shafts, medium, depth.shape[0], thin_told=True)


def doubt_of_pass(shafts: "LightShafts", medium: "ResolvedMedium", height: int, thin_told: bool = False) -> str | None:
    """Word one line where fog leaves a pass that was just drawn without the light of its suns, or where a volume is a speck in its picture
    of so many pixels' height, see `doubt_of_suns` and `too_small`; else None. thin_told: volumes too thin to be seen were told of when they
    were opened, `densities.suit`, and it is not said again of them that they are specks, by which they are thin."""
    from airlight.medium.resolve import hardly_seen
    from airlight.pygfx.dimmed_suns import doubt_of_suns
    from airlight.pygfx.faint_fields import too_small
    from airlight.pygfx.punctual import punctual_lights

    medium = medium.seen_from([-v for v in medium.origin])  # in the world's coordinates
    seen = shafts.camera.view_matrix, shafts.camera.projection_matrix
    thin = thin_told and hardly_seen(float(medium.sigma_t.max()) * max((field.longest for field in medium.fields), default=0.0), "")
    return doubt_of_suns(medium, punctual_lights(shafts.lights), *seen) or (None if thin else too_small(medium.fields, *seen, height))


@dataclass
class Lamps:
    """Notes over the frames of a run which lamps methods that work on the picture never had in the view."""

    frames: int = 0
    unseen: dict[int, tuple[str, bool]] = field(default_factory=dict)  # name, and whether ever before the camera
    method: str = ""

    def look(self, studio: "Studio") -> None:
        """Look at a frame that was just drawn."""
        from airlight.projection import project

        self.method = studio.shafts.parameters.method
        if METHODS[self.method].lights_medium or not METHODS[self.method].plan_by:
            return
        camera, found = studio.camera, {}
        for i, light in enumerate(studio.shafts.lights):
            at = project(light.homogeneous(), camera.view_matrix, camera.projection_matrix)
            shines = light.strength * max(light.color) > 0
            inside = at.fade > 0 and all(0 <= v <= 1 for v in at.position)
            if shines and not inside and (self.frames == 0 or i in self.unseen):
                found[i] = name_of(light), at.fade > 0 or (self.frames > 0 and self.unseen[i][1])
        self.unseen = found
        self.frames += 1

    def tell(self) -> None:
        """Say in one line which lamps were out of the view all the time, and what lights the air all the same."""
        if not self.unseen:
            return
        names = [name for name, _ in self.unseen.values()]
        more = [f"{len(names) - NAMED} more"] if len(names) > NAMED else []
        several = len(names) > 1
        where = "beside the view" if any(before for _, before in self.unseen.values()) else "behind the camera"
        what = ", ".join(names[:NAMED]) + (f" and {more[0]}" if more else "")
        lie, shafts = ("lie", "their shafts are") if several else ("lies", "its shafts are")
        method = f"method {self.method} sees the picture alone, so that {shafts} {'faint' if 'beside' in where else 'missing'}"
        say(f"{what} {lie} {where}: {method}; --method {FOR_MEDIUM} lights the air whichever way the camera looks", prefix="")


def name_of(light: Any) -> str:
    """Name a light of a scene, pygfx.SceneLight, for a line to the user."""
    if light.homogeneous()[3] == 0:
        return "the sun"
    if light.position is not None:
        return f"the light at {','.join(f'{v:g}' for v in light.position)}"
    return f"the light {light.target.name}" if light.target.name else "the scene's light"

def lamp_heights(lights: Any) -> dict[str, float]:
    """List the world's heights, m, of the lamps among lights of a scene, pygfx.SceneLight, that shine, by name."""
    from airlight.pygfx.punctual import punctual_lights

    lamps = [(light, [one for one in punctual_lights([light]) if hasattr(one, "position")]) for light in lights]
    return {name_of(light): float(one.position[1]) for light, found in lamps for one in found}
