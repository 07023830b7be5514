"""Puts what a user wants to lie in the air of a scene, volumes and particles, into its stage."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError
from airlight.files.volumes import FORMATS as OF_VOLUMES
from airlight.jobs.particle_text import load_particles, read_particle_text
from airlight.jobs.volume_text import FileVolume, read_volume_text, tell_apart
from airlight.medium.field import as_field

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
    if path.lower().endswith(tuple(OF_VOLUMES)):
        _put(stage, FileVolume(read_volume_text(path)), cells)
        return (f"--volume={path}",)
    _put(stage, load_particles(read_particle_text(path), stage.scene, cells), cells)
    return (f"--particles={path}",)


def of_density(path: str) -> bool:
    """Tell whether a file, by its name, holds a volume or particles, and nothing that is shown by itself."""
    return path.lower().endswith((*OF_VOLUMES, ".csv"))


def _put(stage: "Stage", density: Any, cells: int) -> None:
    field = as_field(density, cells)
    if field is not None and field.volume.density.any():
        tell_apart(field, stage.center, stage.radius)
    stage.fields.append(density)


def refuse_without_medium(volumes: Sequence[str], particles: Sequence[str], method: str) -> None:
    """Raise AirlightError for densities with a method that knows none."""
    given = "--volume" if volumes else "--particles" if particles else None
    if given is not None:
        raise AirlightError(f"{given} means nothing with method {method}: leave it out, or use --method march")
