"""Puts what a user wants to lie in the air of a scene, volumes and particles, into its stage."""

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError, warn
from airlight.files.volumes import FORMATS as OF_VOLUMES
from airlight.jobs.density_text import npz_kind
from airlight.jobs.particle_text import load_particles, read_particle_text
from airlight.jobs.volume_text import FileVolume, read_volume_text, tell_apart
from airlight.medium.field import as_field
from airlight.medium.resolve import OPTICAL_DEPTH, SEEN_DEPTH, hardly_seen
from airlight.messages import say
from airlight.options import Medium

FILES = (*OF_VOLUMES, ".csv")  # of densities, that are nothing else
LESSENING = ("multiply", "min")  # blends of what thickens nothing by itself

if TYPE_CHECKING:
    from airlight.scenes import Stage


def put_densities(
    stage: "Stage", volumes: Sequence[str], particles: Sequence[str], fps: float = 24.0, cells: int = 128
) -> tuple[str, ...]:
    """Load volumes and particles, as they are written, into a stage, beside its own; give the options that ask for them. fps: of the
    numbers of numbered files. cells: of particles' grids. Warns of what lies outside the scene. Raises AirlightError."""
    stage.fps = fps
    for text in volumes:
        _put(stage, FileVolume(read_volume_text(text)), cells)
    for text in particles:
        _put(stage, load_particles(read_particle_text(text), stage.scene, cells), cells)
    return (*(f"--volume={text}" for text in volumes), *(f"--particles={text}" for text in particles))


def add_density(stage: "Stage", path: str, cells: int) -> tuple[str, ...]:
    """Put the volume or the particles of a file into a stage's air, beside what lies there; give the option that asks for it. Raises
    AirlightError."""
    if path.lower().endswith(tuple(OF_VOLUMES)) and npz_kind(path) != "particles":
        _put(stage, FileVolume(read_volume_text(path)), cells)
        return (f"--volume={path}",)
    _put(stage, load_particles(read_particle_text(path), stage.scene, cells), cells)
    return (f"--particles={path}",)


def of_density(path: str) -> bool:
    """Tell whether a file, by its name, holds a volume or particles, and nothing that is shown by itself."""
    return path.lower().endswith(FILES)


def _put(stage: "Stage", density: Any, cells: int) -> None:
    field = as_field(density, cells)
    if field is not None and field.volume.density.any():
        tell_apart(field, stage.center, stage.radius)
    stage.fields.append(density)


def suit(stage: "Stage", values: dict[str, Any], cells: int) -> None:
    """Choose an extinction by which what lies in a stage's air is seen, where neither the stage nor the values have one, and there is no
    other air; tell what would not be seen."""
    fields = [field for field in (as_field(one, cells) for one in stage.fields) if field is not None]
    if not fields:
        return
    known = stage.settings | values
    if not known.get("air"):
        made = list(itertools.dropwhile(lambda field: field.blend in LESSENING, fields))
        if not made:
            warn("volumes that multiply, or take the least, have nothing to act on, as there is no air beside them: give --air 1")
            return
        fields = made
    longest = max(field.longest for field in fields)
    if longest == 0:
        warn("the volumes and particles hold no density" + ("" if known.get("air") else ", and beside them there is no air: give --air 1"))
        return
    if known.get("air") is None and (known.get("fog", "none") != "none" or known.get("noise_amount", 0) > 0):
        warn("fog and noise are of the air, of which there is none beside volumes and particles: give --air 1 for both")
    if known.get("sigma_t") is None and not known.get("air"):
        sigma = float(f"{SEEN_DEPTH / longest:.2g}")
        stage.settings["sigma_t"] = (sigma,) * 3
        say(f"sigma_t {sigma:g} 1/m, by which the densest way through the volumes and particles has an optical depth of {SEEN_DEPTH:g}")
        return
    sigma = max(known["sigma_t"]) if known.get("sigma_t") is not None else OPTICAL_DEPTH / (2 * stage.radius)
    if (line := hardly_seen(sigma * longest, "give ;factor={0} behind their names, or a larger --sigma-t")) is not None:
        warn(line)


def refuse_without_medium(volumes: Sequence[str], particles: Sequence[str], method: str) -> None:
    """Raise AirlightError for densities with a method that knows none."""
    given = "--volume" if volumes else "--particles" if particles else None
    if given is not None:
        raise AirlightError(f"{given} means nothing with method {method}: leave it out, or use --method march")


def tell_idle(explicit: frozenset[str], medium: Medium, numbered: bool = False, alone: bool = True) -> None:
    """Warn of options of a medium that the user wrote, and that do nothing as it is. numbered: volumes follow the frame. alone: there are
    none, and no particles."""
    lacks = {
        "--fog": medium.fog == "none" and {"fog_base", "fog_depth", "fog_above"},
        "--fog linear": medium.fog == "exponential" and {"fog_above"},
        "--noise-amount": medium.noise_amount == 0 and {"noise_size", "noise_octaves", "noise_seed"} | (set() if numbered else {"wind"}),
        "--basin-level": medium.basin_level is None and {"basin_density"},
        "--fog, --volume or --particles": alone and medium.fog == "none" and medium.basin_level is None and {"sun_extinction"},
        "--sun-glow": medium.sun_glow == 0 and {"sun_glow_size"},
    }
    for needed, idle in lacks.items():
        written = [f"--{name.replace('_', '-')}" for name in sorted(idle or ()) if name in explicit]
        if written:
            warn(f"{', '.join(written)} {'does' if len(written) == 1 else 'do'} nothing without {needed}")
