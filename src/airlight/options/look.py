"""Declares what shafts on a picture look like, and which of the two looks a user has asked for."""

from collections.abc import Iterable

from airlight.errors import AirlightError
from airlight.options.composite import Composite
from airlight.options.declare import Options, choice, real, whole
from airlight.options.shafts import Parameters

LOOK_DOC = "Airlight, docs/look.md"


class Look(Options, group="look"):
    """Say what shafts on a picture look like. Validated on construction; raises AirlightError."""

    look: str | None = choice(
        None, ("smart", "classic"),
        "smart: shafts that stand out by as much as the strength says, in the light's own colour, on what lies behind them; "
        "classic: the sum of the method, put on the picture; unset: smart, or classic where an option of the sum is given",
        LOOK_DOC,
    )
    strength: float = real(
        1.0,
        "how much one sees of the shafts: 95 % of the pixels change by at most 8 times this, in hundredths of OKLab",
        LOOK_DOC, ge=0, le=4,
    )
    warmth: float | None = real(
        None,
        "how far the light's colour is drawn to a warm white, or below 0 to a cool one; unset: as far as it is pale",
        LOOK_DOC, ge=-1, le=1,
    )
    length: float | None = real(
        None,
        "distance from the light at which shafts have faded to a third; unset: by where the picture can show them",
        LOOK_DOC, "picture diagonals", ge=0.02, le=10, slider=(0.05, 1.5), log=True,
    )
    fineness: float | None = real(
        None,
        "angle over which rays are smoothed; unset: 0.55",
        LOOK_DOC, "degrees", ge=0.1, le=6, slider=(0.2, 3), log=True,
    )
    shade: float | None = real(
        None,
        "how dark it gets where light is missing between shafts; unset: 0.8, in float files 0, so that the layer only adds",
        LOOK_DOC, ge=0, le=1,
    )
    mist: float = real(0.0, "how much of the glow that is even all round the light is shown beside its shafts", LOOK_DOC, ge=0, le=1)
    rays: int | None = whole(
        None,
        "rays that are drawn where the picture has no gaps for light to come through; unset: 24 where mist hides all gaps, else "
        "none",
        LOOK_DOC, ge=0, le=200, slider=(0, 60),
    )
    rays_seed: int = whole(0, "other drawn rays", LOOK_DOC, ge=0, le=2**31 - 1, slider=(0, 20))
    rays_shimmer: float = real(0.0, "moves drawn rays on, each on its own, as time does", LOOK_DOC, "turns", ge=-1e6, le=1e6, slider=(0, 5))
    wrap: float = real(0.0, "how much of the light wraps round the edge of a subject's mask", LOOK_DOC, ge=0, le=1)


# What only the sum knows: where one of these is set, and no look, the look is classic.
OF_SUM = (frozenset(Parameters.__struct_fields__) | frozenset(Composite.__struct_fields__)) - {"quality"}
OF_LOOK = frozenset(Look.__struct_fields__)


def chosen_look(values: Iterable[str], look: str | None = None, sum_by: str = "") -> str:
    """Choose `smart` or `classic` by the names of what is set.

    look: the one that was asked for; sum_by: what else asks for the sum, if anything. Raises AirlightError where
    some of them belong to the one, some to the other.
    """
    of_sum = sum_by or next((name for name in values if name in OF_SUM), "")
    of_look = next((name for name in values if name in OF_LOOK and name != "look"), "")
    if of_sum and (of_look or look == "smart"):
        raise AirlightError(f"{of_sum} belongs to the classic look, {of_look or 'smart'} does not: leave one of the two out")
    if of_look and look == "classic":
        raise AirlightError(f"{of_look} belongs to the smart look, not to the classic one: leave one of the two out")
    return look or ("classic" if of_sum else "smart")


def refuse_look(values: Iterable[str], what: str) -> None:
    """Raise AirlightError where something of a look is set for what has none. what: as in `a scene`."""
    found = next((name for name in values if name in OF_LOOK), "")
    if found:
        raise AirlightError(f"{found} belongs to a look, which {what} has not: use a preset classic-..., or a method's own options")
