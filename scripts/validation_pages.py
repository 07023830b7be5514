"""Measures the scenes of validation and rewrites what is generated of their pages in docs/validation/, with a picture each; then one scene
by methods of both kinds, into docs/world.md and docs/pictures/ways.jpg: python scripts/validation_pages.py [NAME ...]

What a page says of Mitsuba comes from the table in docs/world.md: run scripts/validation_table.py before.

NAME: slats, foliage-view, ..., or ways; without one: all, a quarter of an hour on two cores, which should have nothing else to do. --width
and --runs are for trials. What stands outside of the comments measured, ways and end is left as it is.
"""

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pictures
from marked import put

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import validating

from airlight.colour import decode_codes
from airlight.compare import scenes, words
from airlight.compare.result import SceneComparison, SceneRow
from airlight.compare.sheet import codes_of
from airlight.compare.variants import Variant, variant
from airlight.gpu.device import shared_device
from airlight.lights.projector import FALLOFFS, ProjectorLight
from airlight.lights.punctual import PunctualLight
from airlight.lights.spot import SpotLight
from airlight.medium.resolve import ResolvedMedium
from airlight.scenes import VALIDATION, open_scene
from airlight.scenes.offline import Shot

DOCS = Path(__file__).parent.parent / "docs"
PICTURES = DOCS / "pictures"
AMPLIFY, WIDTH, MOST = 10, 480, 150_000  # of the difference; pixels of a picture; bytes of a file
VARYING_SHARE = 0.5  # of that width, where the truth is of a medium that varies, which takes long
VARIANTS = {
    "exact walk": "method=march,quality=final,steps=exact",
    "2,000 steps": "method=march,quality=final,steps=2000,jitter=midpoint",
    "500 steps": "method=march,quality=final,steps=500,jitter=midpoint",
    "64 steps, half the size": "method=march,quality=final,steps=64,resolution=0.5",
    "`epipolar`": "method=epipolar,occluders=stencil",
    "`article`": "method=article",
    "`article-prose`": "method=article-prose",
}
FEW_STEPS = {  # of media that vary, of what is seen through, and of lights with a shape
    "exact walk": VARIANTS["exact walk"],
    "500 steps": VARIANTS["500 steps"],
    "64 steps": "method=march,quality=final,steps=64",
    "16 steps": "method=march,quality=final,steps=16",
    "64 steps, half the size": VARIANTS["64 steps, half the size"],
    "16 steps, half the size": "method=march,quality=final,steps=16,resolution=0.5",
}
OF_FEW_STEPS = validating.VARYING + validating.SEEN_THROUGH + validating.SHAPED
WAYS = {
    "`epipolar`": VARIANTS["`epipolar`"],
    "`march`, exact": VARIANTS["exact walk"],
    "`march`, 64 steps, half the size": VARIANTS["64 steps, half the size"],
}
DRAWN = 2  # of them, with their pictures
EYE, TIME, LARGE = (52.0, 10.0, 93.0), 20.2, (720, 405)  # of the flying scene, where ways are compared
TARGETS = {"in view": (52.0, 15.0, -7.0), "out of view": (-26.0, 15.0, 30.0)}
AIR = {"sigma_t": [0.008, 0.009, 0.0105], "albedo": 0.95, "anisotropy": 0.5, "max_distance": 130.0}


def numbers(values: Sequence[float]) -> str:
    """At most three significant digits; once where all are the same."""
    short = [f"{round(float(f'{v:.3g}'), 9) + 0.0:g}" for v in values]
    return short[0] if len(set(short)) == 1 else ", ".join(short)


def place(values: Sequence[float]) -> str:
    return "(" + ", ".join(f"{round(v, 2) + 0.0:g}" for v in values) + ") m"


def light(lamp: PunctualLight) -> str:
    if lamp.directional:
        x, y, z = lamp.direction
        azimuth, elevation = math.degrees(math.atan2(x, -z)) % 360, math.degrees(math.asin(y))
        return f"sun, {numbers(lamp.intensity)} lux, azimuth {azimuth:.0f}°, elevation {elevation:.0f}°{shape(lamp)}"
    cone = f", half angles {math.degrees(lamp.inner):.0f}° and {math.degrees(lamp.outer):.0f}°" if isinstance(lamp, SpotLight) else ""
    return f"{lamp.word}, {numbers(lamp.intensity)} cd, at {place(lamp.position)}{cone}{shape(lamp)}"


def shape(lamp: PunctualLight) -> str:
    """What a light has of a shape; nothing of plain ones."""
    found = []
    if isinstance(lamp, ProjectorLight):
        far = f" to {lamp.far:g}" if lamp.far else ""
        found.append(f"{' x '.join(f'{math.degrees(a):g}°' for a in lamp.fov)} from {lamp.near:g}{far} m")
        if (lamp.falloff, lamp.ambient) != (FALLOFFS[0], 0.0):
            found.append(f"falloff {lamp.falloff}" + (f" + {lamp.ambient:g}" if lamp.ambient else ""))
        if lamp.clip:
            found.append(f"{len(lamp.clip)} clip planes" if len(lamp.clip) > 1 else "one clip plane")
    if lamp.cookie is not None:
        rows, columns = lamp.cookie.pixels.shape[:2]
        found.append(f"a cookie of {columns} x {rows} pixels" + (f", {lamp.cookie.size:g} m wide" if lamp.directional else ""))
    if lamp.photometry is not None:
        file: Any = lamp.photometry
        found.append(f"photometry of type {file.kind}, {len(file.vertical)} x {len(file.horizontal)} angles")
    return "".join(f", {one}" for one in found)


def medium(air: ResolvedMedium) -> str:
    m = air.settings
    basic = f"sigma_t {numbers(air.sigma_t)} 1/m, albedo {numbers(m.albedo)}, g = {m.anisotropy:g}, up to {air.max_distance:g} m"
    return basic + (f"; density {density(air)}" if varies(air) else "")


def varies(air: ResolvedMedium) -> bool:
    return air.varies or air.settings.fog != "none"


def density(air: ResolvedMedium) -> str:
    """What the medium's density is made of."""
    m, found = air.settings, [] if air.air == 0 else [f"{air.air:g}"]
    if m.fog == "exponential":
        found.append(f"1 up to {m.fog_base:g} m, above it falling by e every {air.fog_depth:g} m")
    elif m.fog == "linear":
        found.append(f"1 up to {m.fog_base:g} m, falling to {m.fog_above:g} at {m.fog_base + air.fog_depth:g} m")
    if m.noise_amount > 0:
        found.append(f"noise of amount {m.noise_amount:g}, {m.noise_octaves} octaves, the largest {air.noise_size:g} m")
    for field in air.fields:
        sides = " x ".join(str(n) for n in field.volume.density.shape[::-1])
        voxel = max(np.linalg.norm(field.volume.matrix[:3, :3], axis=0))
        found.append(f"a volume of {sides} voxels of up to {voxel:.2g} m, {field.volume.density.max() * field.factor:.2g} at most")
    return ", and ".join(found[1:] if found[:1] == ["1"] and len(found) > 1 else found)


def cells(row: SceneRow, copy_ms: float) -> list[str]:
    """rmse, bias or factor, 99 %, copies of shadow maps, and of the rest."""
    shadows = sum(ms for name, ms in row.parts or [] if name == "shadow maps")
    bias = f"light {words.fitted(row)}" if row.bias is None else words.percent(row.bias)
    apart = [f"{shadows / copy_ms:.0f}", f"{(row.ms - shadows) / copy_ms:.{0 if row.copies >= 10 else 1}f}"]
    return [words.percent(row.rmse), bias, words.percent(row.p99), *apart]


def said(row: SceneRow) -> None:
    print(f"  {row.variant.name}: {words.errors(row)}, {words.cost(row)}", flush=True)


def how(result: SceneComparison, runs: int) -> str:
    width, height = result.size
    timed = f"medians of {runs} runs" if runs > 1 else "one run"
    return f"{width} x {height}; copies of {result.copy_ms:.2f} ms on {result.adapter}, {timed}."


def by_mitsuba(name: str) -> str:
    """The scene's figures in the table of docs/world.md, where they are there."""
    lines = [line for line in (DOCS / "world.md").read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    for head in rows:
        at = next((i for i, cell in enumerate(head) if cell.startswith("Mitsuba")), None)
        for row in rows:
            if at is not None and len(row) == len(head) and row[0] == f"`{name}`" and row[at]:
                rmse, bias, noise = row[at : at + 3]
                return f"The exact walk against [Mitsuba](../world.md#error): rmse at most {rmse}, bias {bias}; Mitsuba's noise {noise}."
    return ""


def page(name: str, width: int, runs: int) -> None:
    stage = open_scene(name)
    width = round(width * VARYING_SHARE) if name in validating.VARYING else width
    texts = FEW_STEPS if name in OF_FEW_STEPS else VARIANTS
    view = scenes.ComparedView(stage, Shot(width, width * 9 // 16, samples=1))
    chosen = {label: variant(text, stage.settings, True) for label, text in texts.items()}
    chosen = {label: v for label, v in chosen.items() if view.lacks(v) is None}
    result = scenes.compare(view, list(chosen.values()), against="tracer", runs=runs, say=said)
    exact, truth = result.rows[0], result.truths[0]
    shown = [codes_of(part, width) for part in (exact.shown, truth.shown, AMPLIFY * exact.difference)]
    pictures.write(str(PICTURES / f"validation-{name}.jpg"), pictures.grid(3, shown), MOST)
    eye = view.camera.world.position
    lines = [
        f"    airlight render {name} --quality final --no-antialias --width {width} -o {name}.png",
        f"    airlight compare {name} --against tracer -o {name}.html",
        "",
        f"![the exact walk; the truth; {AMPLIFY} times their difference](../pictures/validation-{name}.jpg)",
        "",
        f"The exact walk, the truth, and {AMPLIFY} x their difference, of which white is {words.percent(1 / AMPLIFY)} of the light's mean.",
        "",
        "| | |",
        "|---|---|",
        *(f"| light | {light(lamp)} |" for lamp in view.punctual),
        f"| medium | {medium(view.resolved(exact.variant))} |",
        f"| eye | at {place(eye)}, {view.camera.fov:g}° |",
        f"| truth | {truth.about} |",
        "",
        "| | rmse | bias | 99 % | copies: shadow maps | light |",
        "|---|---|---|---|---|---|",
        *(f"| {label} | {' | '.join(cells(row, result.copy_ms))} |" for label, row in zip(chosen, result.rows, strict=True)),
        "",
        f"{how(result, runs)} {by_mitsuba(name)}".strip(),
    ]
    put(DOCS / "validation" / f"{name}.md", "measured", "\n".join(lines) + "\n")


def overview() -> None:
    """The exact walk of each scene whose picture is there, small."""
    shown = [pictures.read(str(path)) for name in VALIDATION if (path := PICTURES / f"validation-{name}.jpg").exists()]
    small = [codes_of(decode_codes(np.ascontiguousarray(one[:, : (one.shape[1] - 2 * pictures.GAP) // 3])), 240) for one in shown]
    whole = [one[np.arange(135) * len(one) // 135][:, np.arange(240) * one.shape[1] // 240] for one in small]  # trials are smaller
    pictures.write(str(PICTURES / "validation.jpg"), pictures.grid(5, whole), MOST)


def summary() -> None:
    """The figures of media that vary, of glass and of lights with a shape, from their pages, into docs/validation.md."""
    labels = "exact walk", "64 steps", "16 steps"
    rows = ["| | |" + "".join(f" {label}: rmse | bias |" for label in labels), "|" + "---|" * (2 + 2 * len(labels))]
    for name in (name for name in VALIDATION if name in OF_FEW_STEPS):
        title, *lines = (DOCS / "validation" / f"{name}.md").read_text(encoding="utf-8").splitlines()
        found = {line.split(" | ")[0][2:]: line.split(" | ")[1:3] for line in lines if line.startswith("| ")}
        figures = [figure for label in labels for figure in found.get(label, ["", ""])]
        rows.append(f"| [`{name}`](validation/{name}.md) | {title.partition(': ')[2]} | {' | '.join(figures)} |")
    put(DOCS / "validation.md", "varying", "\n".join(rows) + "\n")


def command(target: Sequence[float], v: Variant) -> str:
    def comma(values: float | Sequence[float]) -> str:
        return ",".join(f"{value:g}" for value in ([values] if isinstance(values, float) else values))

    way = f"--method {v.parameters.method}"
    if v.parameters.method == "march":
        way += " --quality final" + "".join(f" --{name.replace('_', '-')} {comma(value)}" for name, value in AIR.items())
    return f"    airlight render flying --time {TIME} --eye {comma(EYE)} --target={comma(target)} --width {LARGE[0]} {way} -o ways.png"


def ways(width: int, runs: int) -> None:
    stage = open_scene("flying")
    chosen = [variant(text, stage.settings | AIR, True) for text in WAYS.values()]
    seen: list[list[np.ndarray]] = []
    figures: list[str] = []
    commands = []
    for where, target in TARGETS.items():
        print(where)
        large = scenes.ComparedView(stage, Shot(*LARGE, eye=EYE, target=target), TIME)
        seen.append([codes_of(large.light(v)[1], LARGE[0]) for v in chosen[:DRAWN]])
        view = scenes.ComparedView(stage, Shot(width, width * 9 // 16, samples=1, eye=EYE, target=target), TIME)
        result = scenes.compare(view, chosen, against="walk", runs=runs, say=said)
        for label, row in zip(WAYS, result.rows, strict=True):
            figures.append(f"| {where} | {label} | {' | '.join(cells(row, result.copy_ms))} |")
        commands += [command(target, v) for v in chosen[:DRAWN]]
    pictures.write(str(PICTURES / "ways.jpg"), pictures.grid(DRAWN, [one for row in seen for one in row]), 250_000)
    rows = ["| light | | rmse | bias | 99 % | copies: shadow maps | light |", "|" + "---|" * 7, *figures]
    put(DOCS / "world.md", "ways", "\n".join([*commands, "", *rows, "", how(result, runs)]) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the scenes of validation and rewrite their pages.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="scenes, or ways; without one: all")
    parser.add_argument("--width", type=int, default=WIDTH, help="of the pictures measured")
    parser.add_argument("--runs", type=int, default=3, help="timed runs of each variant")
    asked = parser.parse_args()
    known = (*VALIDATION, "ways")
    for name in asked.names:
        if name not in known:
            parser.error(f"there is no {name}; there is {', '.join(known)}")
    shared_device()
    names = asked.names or known
    for i, name in enumerate(names):
        print(f"{name} ({i + 1} of {len(names)})", flush=True)
        if name == "ways":
            ways(asked.width, asked.runs)
        else:
            page(name, asked.width, asked.runs)
    if asked.width == WIDTH:  # pictures of a trial are smaller than the others
        overview()
        summary()


if __name__ == "__main__":
    main()
