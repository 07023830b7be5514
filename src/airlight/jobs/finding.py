"""Finds a picture's lights: which are meant, which to ask about; and shows them."""

import dataclasses
import functools
import json
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError
from airlight.jobs.light_text import LightText, found_at, resolved
from airlight.messages import say
from airlight.process import standard

if TYPE_CHECKING:
    import numpy as np

    from airlight.files import Picture
    from airlight.jobs.planes import Reading


def resolve_lights(
    written: Sequence[LightText],
    picture: "Picture",
    origin: str,
    coarse: "np.ndarray | None",
    many: bool = False,
    tell: Callable[[str], object] | None = None,
) -> list[LightText]:
    """Resolve lights to numbers in the display window, searching for those to be found; none where it is not clear which are meant.

    many: pictures are worked on: each line names its own. tell: takes the lines for the user.
    """
    prefix, tell = f"{picture.path}: " if many else "", tell or functools.partial(say, prefix="")
    lights: list[LightText] = []
    found: Any = None
    for one in written:
        if one.searched is None:
            lights.append(resolved(one, picture, origin))
            continue
        if found is None:
            from airlight.detect import find_lights

            found = find_lights(coarse, picture.codes.dtype.kind == "u")
        places = _chosen_places(found, *one.searched, picture, tell)
        if not places:
            return []
        for position, kind, is_guess in places:
            at = found_at(picture, position)
            tell(f"{prefix}light at {at[0]:.3f},{at[1]:.3f} ({at[2]:.0f}px,{at[3]:.0f}px)")
            if is_guess:
                tell(f"{prefix}beyond the picture, by a guess: --light X,Y puts it elsewhere")
            lights.append(dataclasses.replace(one, position=f"{at[0]!r},{at[1]!r}", kind=one.kind or kind))
    return lights


def _chosen_places(
    found: Any, rank: int, all_of_them: bool, picture: "Picture", tell: Callable[[str], object]
) -> list[tuple[tuple[float, float], str, bool]]:
    """Choose the candidates that are meant: (position, kind, whether it is a guess), see `LightText.searched`.

    None, and a line that says why, where none will do.
    """
    from airlight.detect import ACT, ASK

    if not found or (rank == 0 and found[0].confidence < ASK):
        tell(f"{picture.path}: no light found, left as it is: give --light X,Y")
        return []
    best = found[0]
    if rank == 0 and best.confidence < ACT:
        x, y, *_ = found_at(picture, best.position)
        words = f"unsure, left as it is: perhaps at {x:.2f},{y:.2f} ({best.kind}, {best.confidence:.2f}); --light auto:1 takes it"
        tell(f"{picture.path}: {words}")
        return []
    if all_of_them:
        lamps = [(position, best.kind, False) for position in best.lamps]
        return (lamps if len(lamps) > 1 else [(one.position, one.kind, one.guess) for one in found])[:rank]
    if rank > len(found):
        there = "only one place looks like a light" if len(found) == 1 else f"only {len(found)} places look like a light"
        raise AirlightError(f"{picture.path}: --light auto:{rank}: {there}; --candidates FILE shows them")
    one = found[max(rank, 1) - 1]
    return [(one.position, one.kind, one.guess)]


def show_candidates(sources: Sequence[str], path: str, reading: "Reading", overwrite: bool) -> None:
    """Write the sheet, or the list, of --candidates."""
    from airlight import files
    from airlight.detect import find_lights
    from airlight.detect.sheet import draw_candidates
    from airlight.files.sequence import numbered

    if len(sources) != 1 or numbered(sources[0]) is not None or standard.is_folder(sources[0]):
        raise AirlightError("--candidates shows one picture; name one")
    is_list = path.lower().endswith(".json") or path == standard.NAME
    files.check_output(path, list(sources), overwrite, image=not is_list)
    picture = reading.picture(sources[0])
    coarse = picture.rec709(picture.linear(coarse=True))
    found = find_lights(coarse, picture.codes.dtype.kind == "u")
    for number, one in enumerate(found, 1):
        x, y, *_ = found_at(picture, one.position)
        say(f"{number}: {x:.3f},{y:.3f}  {one.kind}, confidence {one.confidence:.2f}{', a guess' if one.guess else ''}", prefix="")
    if not found:
        say("no light found: give --light X,Y", prefix="")
    if is_list:
        places = [
            {"position": found_at(picture, one.position)[:2], "kind": one.kind, "confidence": round(one.confidence, 4), "guess": one.guess}
            | {"lamps": [found_at(picture, lamp)[:2] for lamp in one.lamps]}
            for one in found
        ]
        with files.replacing(path, overwrite) as file:
            file.write((json.dumps(places, indent=1) + "\n").encode())
        return
    codes = draw_candidates(coarse, found)
    files.write_image(path, files.to_linear(codes)[0], encoded=codes, overwrite=overwrite)
