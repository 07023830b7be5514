"""What pictures.sh needs beside the `airlight` command: pictures put together, an animation, and caveats with and without their cure.

jpeg OUT COLUMNS IN...   pictures in a grid, as the best JPEG of at most 150 KB, for one picture 250 KB
small OUT TIMES IN       a picture so many times smaller, averaged; of depths one pixel of each square
webp OUT FPS IN...       frames as an animated WebP
border OUT               occluders that cross the border: region 1 and 1.2; needs the package's tests
behind OUT               a light behind the camera: mirrored, and not
streaks OUT              speckled occluders: summed with the sky, with less contrast, and black
points OUT PAGE          the particles that the program in a page of docs/ writes
guide OUT PAGE [INTO]    what the program in a page of docs/ draws; with INTO the lines that stand there in place of its `shafts = ...`
looks OUT IN...          photographs, a row each, in all looks
turned DEGREES           prints a place to look at
"""

import math
import re
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import OpenImageIO as oiio

GAP = 6  # pixels between pictures


def read(path: str) -> np.ndarray:
    return oiio.ImageBuf(path).get_pixels(oiio.UINT8)[..., :3]


def grid(columns: int, pictures: list[np.ndarray]) -> np.ndarray:
    """Pictures of one size side by side, on white."""
    height, width, _ = pictures[0].shape
    rows = -(-len(pictures) // columns)
    sheet = np.full((rows * (height + GAP) - GAP, columns * (width + GAP) - GAP, 3), 255, np.uint8)
    for k, picture in enumerate(pictures):
        y, x = k // columns * (height + GAP), k % columns * (width + GAP)
        sheet[y : y + height, x : x + width] = picture
    return sheet


def write(path: str, codes: np.ndarray, most: int) -> None:
    """(H, W, 3) uint8 as a JPEG of the best quality, 95 at most, that makes at most so many bytes."""
    with tempfile.TemporaryDirectory() as folder:
        trial = Path(folder) / "trial.jpg"
        for quality in range(95, 40, -2):
            spec = oiio.ImageSpec(codes.shape[1], codes.shape[0], 3, "uint8")
            spec["Compression"] = f"jpeg:{quality}"
            picture = oiio.ImageBuf(spec)
            picture.set_pixels(oiio.ROI(), np.ascontiguousarray(codes))
            if not picture.write(str(trial)):
                sys.exit(picture.geterror())
            if trial.stat().st_size <= most:
                break
        Path(path).write_bytes(trial.read_bytes())
    print(f"{path}: {Path(path).stat().st_size // 1000} KB, quality {quality}")


def jpeg(out: str, columns: str, *names: str) -> None:
    write(out, grid(int(columns), [read(name) for name in names]), 250_000 if len(names) == 1 else 150_000)


def small(out: str, times: str, name: str) -> None:
    whole, step = oiio.ImageBuf(name), int(times)
    pixels = whole.get_pixels(oiio.FLOAT)
    height, width, channels = pixels.shape[0] // step, pixels.shape[1] // step, pixels.shape[2]
    squares = pixels[: height * step, : width * step].reshape(height, step, width, step, channels)
    smaller = squares.mean(axis=(1, 3)) if channels >= 3 else squares[:, step // 2, :, step // 2]
    spec = oiio.ImageSpec(width, height, channels, whole.spec().format)
    spec.channelnames = whole.spec().channelnames
    made = oiio.ImageBuf(spec)
    made.set_pixels(oiio.ROI(), np.ascontiguousarray(smaller))
    if not made.write(out):
        sys.exit(made.geterror())


def webp(out: str, fps: str, *names: str) -> None:
    rate, first = Fraction(fps), read(names[0])  # libwebp: whole frames; libwebp_anim keeps blocks of the last one, which shows
    with av.open(out, "w", format="webp", options={"loop": "0"}) as file:
        stream = file.add_stream("libwebp", rate=rate, options={"quality": "80", "compression_level": "6", "preset": "picture"})
        stream.height, stream.width, stream.pix_fmt = *first.shape[:2], "yuv420p"
        for k, name in enumerate(names):
            frame = av.VideoFrame.from_ndarray(read(name), format="rgb24")
            frame = frame.reformat(format="yuv420p", dst_colorspace="ITU601", dst_color_range="MPEG")  # WebP's
            frame.pts, frame.time_base = k, 1 / rate
            file.mux(stream.encode(frame))
        file.mux(stream.encode(None))
    print(f"{out}: {Path(out).stat().st_size // 1000} KB, {len(names)} frames")


def border(out: str) -> None:
    """The test's pillars, the sun just within the view's right border: the layer, and 60 times what a step of 0.1 degrees changes in it
    more, or less, than with region 2; above with region 1, below with 1.2. The step is the worst for region 1."""
    sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
    import test_prepass as test

    from airlight.options import SceneOptions

    stage, scene = test.Stage(), test.pillars()
    for place in (1.3, 1.1, 0.95):
        seen: dict[float, list[np.ndarray]] = {}
        means = {}
        for region in (1.0, 1.2, 2.0):
            seen[region] = []
            options = SceneOptions(occluders="prepass", view_transform="none", region=region)
            means[region] = test.flicker(stage, scene, place, options, seen[region])
        ratios = {region: float((means[region] / means[2.0]).max()) for region in (1.0, 1.2)}
        print(f"sun at {place}: of region 2's difference " + ", ".join(f"{ratio:.2f} with region {r}" for r, ratio in ratios.items()))
    changes = {region: np.diff(layers, axis=0) for region, layers in seen.items()}
    worst = int(np.argmax(means[1.0] / means[2.0]))
    rows = []
    for region in (1.0, 1.2):
        rows += [seen[region][worst + 1], 60 * np.abs(changes[region] - changes[2.0])[worst]]
    write(out, grid(2, [large(row) for row in rows]), 150_000)


def encoded(values: np.ndarray) -> np.ndarray:
    """Linear light as 8-bit codes."""
    return np.round(255 * np.clip(values, 0, 1) ** (1 / 2.2)).astype(np.uint8)


def large(values: np.ndarray) -> np.ndarray:
    """(h, w) linear light as grey codes, in blocks of 3 x 3."""
    return encoded(values).repeat(3, 0).repeat(3, 1)[..., None].repeat(3, 2)


def behind(out: str) -> None:
    """The flying scene with a light behind the camera and below the horizon: divided by its negative w and not faded; and as it is."""
    from airlight.projection import Projected, project
    from airlight.pygfx import SceneLight, effect
    from airlight.scenes import open_scene
    from airlight.scenes.offline import Shot, Studio

    def mirrored(point: object, view: np.ndarray, projection: np.ndarray) -> Projected:
        true = project(point, view, projection)
        x, y, _, w = np.asarray(projection) @ np.asarray(view) @ np.asarray(point)
        ahead = -np.array(true.direction)
        return Projected((0.5 + 0.5 * float(x / w), 0.5 - 0.5 * float(y / w)), 1.0, (ahead[0], ahead[1], ahead[2]), true.distance)

    stage, pictures = open_scene("flying"), []
    stage.lights[:] = [SceneLight(direction=(-0.72, -0.24, 0.69), disc_half_angle=2.0, strength=1.5)]
    for how in (mirrored, project):
        effect.project = how
        studio = Studio(stage, Shot(640, 360, eye=(12, 9, 106), target=(89.4, 15, 42.7), fov=45))
        pictures.append(np.round(255 * np.clip(studio.frame(20.2).pixels(), 0, 1)).astype(np.uint8))
    effect.project = project
    write(out, grid(2, pictures), 150_000)


def streaks(out: str) -> None:
    """Speckled towers before a sun: all of the picture summed; contrast; pre-pass. Above with their shafts, below the shafts alone."""
    import pygfx as gfx

    import airlight
    from airlight.options import Composite, Parameters, SceneOptions
    from airlight.projection import project
    from airlight.pygfx import SceneLight
    from airlight.scenes import Stage
    from airlight.scenes.offline import Shot, Studio

    rng = np.random.default_rng(1)
    scene = gfx.Scene()
    disc = gfx.Mesh(gfx.sphere_geometry(1.6), gfx.MeshBasicMaterial(color=gfx.Color.from_physical(3.0, 2.5, 1.8)))
    disc.local.position = (0.2, 4.2, -40)
    scene.add(gfx.Background(None, gfx.BackgroundMaterial("#a3b1bd", "#5b7aa0")), disc)
    sun = SceneLight(target=disc)
    for place, width, height in ((-4.6, 2.4, 4.4), (-1.5, 2.2, 2.6), (1.9, 2.6, 3.0), (5.0, 2.0, 4.8)):
        stones = np.where(rng.random((int(height * 10), int(width * 8), 1)) < 0.2, (0.9, 0.82, 0.7), (0.1, 0.09, 0.08))
        codes = np.round(255 * np.append(stones, np.ones_like(stones[..., :1]), axis=2) ** (1 / 2.2)).astype(np.uint8)
        wall = gfx.MeshBasicMaterial(map=gfx.TextureMap(gfx.Texture(codes, dim=2, colorspace="srgb"), filter="nearest"))
        tower = gfx.Mesh(gfx.plane_geometry(width, height), wall)
        tower.local.position = (place, height / 2 - 2.6, -10)
        scene.add(tower)
    camera = gfx.PerspectiveCamera(40, 16 / 9, depth_range=(0.1, 100))
    stage = Stage("towers", scene, {"front": camera}, [sun], 0.0, lambda *_: None, np.zeros(3), 5.0)
    given = {"exposure": 1.5, "density": 0.97}
    layers = []
    for occluders in ("contrast", "prepass"):
        # so far that there is no fog
        scenery = SceneOptions(occluders=occluders, resolution=1, region=1, depth_aware=1e5, view_transform="none")
        studio = Studio(stage, Shot(480, 270, samples=1), Parameters(**given), Composite(mix=0.0), scenery)
        frame = studio.frame(layer=True)
        layers.append(frame.layer[..., :3].astype(np.float32))
    bare = frame.pixels()
    x, y = project(sun.homogeneous(), studio.camera.view_matrix, studio.camera.projection_matrix).position
    layers.insert(0, airlight.light_shafts(bare, (x, y), occlusion="none", **given))
    write(out, grid(3, [encoded(bare + layer) for layer in layers] + [encoded(layer) for layer in layers]), 150_000)


def program_of(page: str) -> str:
    """The first program in a page of docs/."""
    return re.findall(r"```python\n(.*?)```", Path("docs", page).read_text(encoding="utf-8"), re.DOTALL)[0]


def points(out: str, page: str) -> None:
    """The particles that the program in a page of docs/ writes to fire.npz."""
    exec(compile(program_of(page).replace("fire.npz", out), page, "exec"), {})


def guide(out: str, page: str, into: str | None = None) -> None:
    """What the program in a page of docs/ draws; with the lines of another page that stand there in place of its `shafts = ...`."""
    program = program_of(page)
    if into is not None:
        lines = re.findall(r"in place of `shafts = \.\.\.`[^\n]*:\n\n((?:    .*\n|\n)+)", Path("docs", into).read_text(encoding="utf-8"))[0]
        program = re.sub(r"^shafts = .*$", lambda _: re.sub("^    ", "", lines, flags=re.M), program, flags=re.M)
    names: dict = {}
    exec(compile(program, page, "exec"), names)
    write(out, names["picture"][..., :3], 150_000)


LOOKS = ("subtle", "natural", "dramatic", "long", "soft", "misty", "golden")
CELL, TEXT, INK = 232, 15, (0.2, 0.2, 0.2)  # px: width of a picture, height of the words


def looks(out: str, *names: str) -> None:
    """Photographs as they are and in each look, labelled; made of copies of 960 px, on which a look is the same."""
    import airlight
    from airlight import presets
    from airlight.compare.sheet import codes_of
    from airlight.files import to_linear

    def small(codes: np.ndarray, side: int) -> np.ndarray:
        return codes_of(to_linear(codes)[0], side)

    renderer, rows = airlight.Renderer(), []
    for name in names:
        photo = small(read(name), 960)
        lights = airlight.find_lights(photo)
        row = [photo] + [renderer.add_light_shafts(photo, lights[0], **presets.load(look)) for look in LOOKS]
        rows.append([small(np.asarray(codes), CELL) for codes in row])
        print(name, flush=True)
    tops = np.cumsum([TEXT + 2 * GAP, *(row[0].shape[0] + TEXT + 2 * GAP for row in rows)])
    codes = np.full((tops[-1], len(rows[0]) * (CELL + GAP) - GAP, 3), 255, np.uint8)
    texts = [(k * (CELL + GAP) + 4, TEXT + 2, words) for k, words in enumerate(("original", *LOOKS))]
    for top, row, name in zip(tops, rows, names, strict=False):
        for k, picture in enumerate(row):
            codes[top : top + picture.shape[0], k * (CELL + GAP) : k * (CELL + GAP) + picture.shape[1]] = picture
        texts.append((4, int(top) + row[0].shape[0] + TEXT + 2, Path(name).stem))
    sheet = oiio.ImageBuf(codes)
    for x, y, words in texts:
        if not oiio.ImageBufAlgo.render_text(sheet, x, y, words, TEXT, "", INK):
            sys.exit(sheet.geterror())
    write(out, sheet.get_pixels(oiio.UINT8), 400_000)


def turned(degrees: str) -> None:
    """Print a place to look at from 12,9,106 in the flying scene, so many degrees to the right of the sun, which stands at 5.7."""
    angle = math.radians(float(degrees) + 5.7)
    print(f"{12 + 100 * math.sin(angle):.2f},15,{106 - 100 * math.cos(angle):.2f}")


COMMANDS = (jpeg, small, webp, border, behind, streaks, points, guide, looks, turned)

if __name__ == "__main__":
    {command.__name__: command for command in COMMANDS}[sys.argv[1]](*sys.argv[2:])
