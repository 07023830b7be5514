"""Refuses options of a scene that mean nothing with its method, and tells those that do nothing in its daylight."""

from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError, warn
from airlight.options import March, Medium, Parameters, SceneOptions, declared, of_medium_alone, presets
from airlight.scatter.methods import METHODS

if TYPE_CHECKING:
    from airlight.jobs.frames import FramesRequest
    from airlight.scenes import Stage

OF_MEDIUM_LIGHT = ("soften", "soften_kernel", "refine", "planes", "plane_cell", "plane_cookie", "plane_shadow")  # that no air alone has


def refuse_meaningless(explicit: frozenset[str], method: str, by: str = "") -> None:
    """Raise AirlightError for an option that the user wrote and that means nothing with the method. by: what asks for that, if not
    --method."""
    for one in declared(scenes=True):
        if one.methods and method not in one.methods and one.name in explicit:
            wrong = f"{one.flag} means nothing with method {method}"
            if by.startswith("--medium"):
                raise AirlightError(f"{wrong}, which {by} asks for: leave one of the two out")
            asks = f", which {by} asks for" if by else ""
            raise AirlightError(f"{wrong}{asks}: leave it out, or use --method {' or '.join(one.methods)}")


def refuse_idle_options(r: "FramesRequest", built: dict[type, Any], chooser: str) -> None:
    """Raise AirlightError for what was written and means nothing with the method. chooser: of that, as `chooser_of` names it."""
    from airlight.jobs.densities import refuse_without_medium
    from airlight.jobs.shape_text import refuse_idle

    name = built[Parameters].method
    refuse_meaningless(r.explicit, name, chooser)
    if r.exclude and built[SceneOptions].occluders != "prepass" and not METHODS[name].lights_medium:
        raise AirlightError("--exclude goes with --occluders prepass, which draws the occluders by themselves, or with --method march")
    if r.occlusion_buffer is not None and METHODS[name].lights_medium:
        raise AirlightError(f"--occlusion-buffer goes with methods that work on the picture: with {name} give --layer")
    if not METHODS[name].follows_fields:
        refuse_without_medium(r.volume, r.particles, name)
    refuse_idle(r.shapes, name)


def chooser_of(r: "FramesRequest", values: dict[str, Any], stage: "Stage | None" = None) -> str:
    """Name what chose the method; nothing where the user did, or nobody."""
    if "method" in r.explicit:
        return ""
    if r.medium is not None:
        return f"--medium {r.medium}"
    if "method" in values:
        if r.preset is not None and "method" in presets.load(r.preset):
            return f"--preset {r.preset}"
        implying = of_medium_alone(r.explicit)
        if implying is None and "method" not in r.values:
            return "--daylight air"  # see `with_daylight`
        return "--settings-from" if implying is None else implying.flag
    return f"the scene {stage.name}" if stage is not None and "method" in stage.settings else ""


def tell_idle_in_daylight(explicit: frozenset[str], built: dict[type, Any], stage: "Stage") -> None:
    """Warn of options that the user wrote, and that do nothing where daylight lights a scene. built: its options."""
    if stage.daylight is None:
        return
    if "environment" in explicit:
        warn("--environment does nothing with --daylight air, whose sky lights the scene")
    is_alone = METHODS[built[Parameters].method].lights_medium and built[Medium].sigma_t == (0.0, 0.0, 0.0)
    idle = [f"--{name.replace('_', '-')}" for name in March.__struct_fields__ if name in OF_MEDIUM_LIGHT and name in explicit]
    if is_alone and idle:
        does, it = ("does", "it is") if len(idle) == 1 else ("do", "they are")
        warn(f"{', '.join(idle)} {does} nothing in air alone: {it} of the light in a medium, such as --sigma-t adds")
