"""`airlight view`: a picture or a scene, live."""

import functools
from collections.abc import Sequence
from typing import Any

import click

from airlight.cli.compare import SourceLightType
from airlight.cli.help import Command
from airlight.cli.light import LightText
from airlight.cli.options import gather, given, parameter_options
from airlight.cli.shared import (
    SCENE,
    SHAPES,
    check_source,
    density_options,
    file_scene_options,
    medium_options,
    option,
    preset_option,
    shape_options,
    to_stdout,
)
from airlight.errors import AirlightError
from airlight.options import refuse_medium
from airlight.scatter.methods import FOR_MEDIUM


@click.command(cls=Command)
@click.argument("source", metavar="SCENE|IMAGE", type=SCENE, default="table", is_eager=True)  # before --light, which depends on it
@option("--browser", is_flag=True, help="Show it in a web browser instead of a window; the address is printed.")
@option("--host", default="127.0.0.1", help="With --browser: the address to listen on; other machines see it only if you say so.")
@option("--port", type=click.IntRange(0, 65535), default=0, help="With --browser: the port; 0: any that is free.")
@option("--screenshot", metavar="FILE", type=click.Path(), help="Open nothing: write what the viewer would show, panel and all.")
@option("-y", "--overwrite", is_flag=True, help="Replace the screenshot if it exists.")
@option(
    "--light",
    "written",
    panel="Light",
    type=SourceLightType(),
    metavar="X,Y|x,y,z",
    multiple=True,
    help='Where the light of a picture is at first: 0.4,0.3 or 50%,20%, with colour and strength as in "0.4,0.2;color=1,0.8,0.6". '
    "Unset: it is found. Of a scene as in `airlight render`: x,y,z or a mesh by name.",
)
@file_scene_options
@preset_option
@medium_options
@density_options
@shape_options
@functools.partial(parameter_options, scenes=True)
@option("--device", metavar="NAME", help="Compute on the adapter whose name holds NAME; `airlight info` lists them.")
@click.pass_context
def view(
    ctx: click.Context,
    source: str,
    browser: bool,
    host: str,
    port: int,
    screenshot: str | None,
    overwrite: bool,
    written: Sequence[Any],
    preset: str | None,
    medium: str | None,
    device: str | None,
    animation: str | None,
    scene_of_file: str | None,
    up: str | None,
    volume: Sequence[str],
    particles: Sequence[str],
    **others: Any,
) -> None:
    """Show a picture or a 3-D scene (table, matinee ..., one of validation, a .glb, .gltf, .obj, .ply, .stl file) live, with a panel."""
    values = gather(ctx, preset, medium)
    shapes = {name: others[name] for name in SHAPES}
    if volume or particles or any(shapes.values()):
        values = {"method": FOR_MEDIUM} | values
    if browser and screenshot is not None:
        raise AirlightError("--browser and --screenshot exclude each other; give one")
    check_source(source)
    from airlight.jobs.densities import of_density

    if of_density(source):
        option_of = "--particles" if source.lower().endswith(".csv") else "--volume"
        raise AirlightError(f"{source}: lies in the air of a scene: show one with it, as by `airlight view table {option_of} {source}`")
    from airlight.files import check_output, write_image
    from airlight.scenes import is_scene

    if screenshot is not None:
        screenshot = to_stdout(screenshot, None)
        check_output(screenshot, [source], overwrite)
    try:
        from airlight.viewer import app
    except ImportError as error:
        raise AirlightError(f"the viewer needs more packages ({error}): pip install airlight[viewer]") from None
    of_scene = is_scene(source)
    if not of_scene and (animation, scene_of_file, up) != (None, None, None):
        raise AirlightError("--animation, --scene and --up are for the file of a scene: leave them out for a picture")
    if not of_scene and (volume or particles):
        raise AirlightError("--volume and --particles are for the air of a 3-D scene: leave them out for a picture")
    if not of_scene and (found := [name for name, texts in shapes.items() if texts]):
        instead = "write --light 'X,Y;cookie=FILE'" if found[0] == "cookie" else "leave it out"
        raise AirlightError(f"--{found[0]} is for the lights of a 3-D scene: {instead} for a picture")
    if not of_scene:
        refuse_medium(name for name in ctx.params if given(ctx, name))
    more: dict[str, Any] = {"lamps": written} if of_scene else {"lights": _light_controls(written, source)}
    if of_scene:
        from airlight.jobs.sun_of_scene import check_view, with_daylight

        values |= {"sun": others["sun"]} if others["sun"] is not None else {}
        check_view(values)
        values.update(with_daylight(values, bool(volume or particles)))
    more |= {"animation": animation, "scene": scene_of_file, "up": up, "densities": (volume, particles), "shapes": shapes}

    def make(canvas: Any) -> Any:
        try:
            return app.Viewer(canvas, source, values=values, device=device, **more)
        except ImportError as error:
            raise AirlightError(f"the viewer needs more packages ({error}): {app.MISSING}") from None

    if screenshot is not None:
        write_image(screenshot, None, encoded=app.offscreen(make)[..., :3], overwrite=overwrite)
    elif browser:
        from airlight.viewer.browser import serve

        serve(make, host, port)
    else:
        app.in_window(make)


def _light_controls(written: Sequence[LightText], source: str) -> list[Any]:
    """Place the lights of --light in the picture's own pixels."""
    from airlight.jobs.light_text import place
    from airlight.viewer.state import LightControl

    given = [light for light in written if light.searched is None or light.searched[0]]
    if not given:
        return []
    from airlight.files import read_image
    from airlight.jobs.finding import resolve_lights

    picture = read_image(source)
    coarse = picture.rec709(picture.linear(coarse=True)) if any(light.searched for light in given) else None
    found = resolve_lights(given, picture, "top", coarse)
    placed = [(place(light, picture), light.cookie) for light in found]  # which reads the cookies, and may refuse them
    return [LightControl(one.position, one.color, one.strength, kind=one.kind, cookie=cookie) for one, cookie in placed]
