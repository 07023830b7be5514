"""Reads projectors as a user writes them: `x,y,z;target=x,y,z;up=x,y,z;fov=h,v;near=N;far=F;intensity=r,g,b;falloff=K;ambient=A;
cookie=FILE;clip=a,b,c,d`; or those that a scene has, by name, to be changed: `NAME;position=x,y,z;...`."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError
from airlight.jobs.density_text import Grammar
from airlight.lights.numbers import unit, unit_plane
from airlight.lights.projector import FALLOFFS, LIMITS, MOST, MOST_CLIPS, NEAR

if TYPE_CHECKING:
    from airlight.pygfx.projector import Projector

FORM = "x,y,z;target=x,y,z;fov=40,30;intensity=100,100,100"
AHEAD = (0.0, 0.0, -1.0)  # where one shines without a target
INTENSITY = (100.0, 100.0, 100.0)  # cd: unset
GRAMMAR = Grammar(
    what="projector",
    form=FORM,
    texts={"cookie": "file"},
    words={"falloff": FALLOFFS},
    numbers={**LIMITS, "position": (-MOST, MOST), "target": (-MOST, MOST)},
    vectors={"position": "x,y,z", "target": "x,y,z", "up": "x,y,z", "fov": "h,v", "intensity": "r,g,b", "clip": "a,b,c,d"},
    several=("clip",),
)


def read_projector(text: str) -> tuple[tuple[float, ...], dict[str, Any]]:
    """Read a projector: its position, none where a name stands for it, and what is given beside it. Raises AirlightError."""
    from airlight.jobs.light_text import PLACE, is_name, numbers

    place, known = GRAMMAR.read(text)
    if is_name(place):
        return (), known
    if "position" in known:
        raise AirlightError(f"the projector {text!r} has two positions: leave position out, or write a name of the scene's for the first")
    at = numbers(place, PLACE)
    _check(text, at, known)
    return at, known


def _check(text: str, at: Sequence[float], known: dict[str, Any]) -> None:
    """Raise AirlightError for what does not go together of a projector at a position."""
    ahead = [b - a for a, b in zip(at, known["target"], strict=True)] if "target" in known else AHEAD
    if not any(ahead):
        raise AirlightError(f"the target of the projector {text!r} is its own position; give another")
    up = known.get("up", (0.0, 1.0, 0.0))
    (a, b, c), (d, e, f) = unit(ahead), unit(up)
    if "up" in known and math.hypot(b * f - c * e, c * d - a * f, a * e - b * d) <= 1e-6:
        raise AirlightError(f"up of the projector {text!r} lies along its light, or is 0; give another direction, as in up=0,0,-1")
    near, far = known.get("near", NEAR if "far" in known else 0.0), known.get("far", math.inf)
    if not near < far:
        raise AirlightError(f"far={far:g} of the projector {text!r} is not beyond near={near:g}; give a greater one")
    if any(not any(plane[:3]) for plane in known.get("clip", ())):
        raise AirlightError(f"a clip plane of the projector {text!r} has no direction: a, b, c are 0; give its normal and d")
    if any(abs(unit_plane(plane)[3]) > MOST for plane in known.get("clip", ())):
        raise AirlightError(f"a clip plane of the projector {text!r} is more than {MOST:g} m away: give a greater normal or less d")
    if len(known.get("clip", ())) > MOST_CLIPS:
        raise AirlightError(f"the projector {text!r} has more than {MOST_CLIPS} clip planes; leave some out")


def name_of(text: str) -> str:
    """Give the name that stands for a projector's position, "" where none does."""
    return "" if read_projector(text)[0] else text.partition(";")[0].strip()


def make_projector(text: str) -> "Projector":
    """Make the projector of a scene, as it is written. Raises AirlightError."""
    import pygfx as gfx

    from airlight.jobs.cookies import open_cookie
    from airlight.pygfx.projector import Projector

    at, known = read_projector(text)
    power = known.get("intensity", INTENSITY)
    top = max(power) or 1.0
    kept = {name: known[name] for name in ("up", "fov", "near", "far", "falloff", "ambient", "clip") if name in known}
    cookie = open_cookie(known["cookie"], option="--projector") if "cookie" in known else None
    made = Projector(gfx.Color.from_physical(*(v / top for v in power)), max(power), cookie=cookie, **kept)
    made.local.position, made.written = at, text
    made.target.world.position = known.get("target", [a + b for a, b in zip(at, AHEAD, strict=True)])
    return made


def change_projector(projector: "Projector", text: str) -> None:
    """Change a projector that a scene has, as it is written; what is not given stays. Raises AirlightError, and changes nothing."""
    import pygfx as gfx

    from airlight.jobs.cookies import open_cookie

    _, known = read_projector(text)
    place = known.get("position", tuple(float(v) for v in projector.world.position))
    near, far = projector.near, projector.far
    whole = {"target": tuple(float(v) for v in projector.target.world.position), "near": near, "up": projector.upwards}
    _check(text, place, {**whole, **({} if far is None else {"far": far}), **known})
    if "cookie" in known:
        projector.cookie = open_cookie(known["cookie"], option="--projector")
    projector.world.position = place
    if "target" in known:
        projector.target.world.position = known["target"]
    for name in ("fov", "near", "far", "falloff", "ambient", "clip"):
        if name in known:
            setattr(projector, name, known[name])
    projector.upwards = known.get("up", projector.upwards)
    if "intensity" in known:
        top = max(known["intensity"]) or 1.0
        projector.color, projector.intensity = gfx.Color.from_physical(*(v / top for v in known["intensity"])), max(known["intensity"])
