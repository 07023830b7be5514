"""Files of plain meshes: .obj with its materials, .ply with colours, polygons and points, .stl; what is hostile is refused in one line."""

import itertools
import os
import random
import struct
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pygfx as gfx
import pytest
from fuzzing import mutate
from gltf_rooms import box
from gltf_stage import Eye, frontal
from gltfs import png

from airlight.cli import main
from airlight.errors import AirlightError, AirlightWarning
from airlight.scenes import Stage, is_scene, open_scene
from airlight.scenes.gltf.meshes import vertices
from airlight.scenes.meshfiles.load import UP

BOX = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"


def drawn(stage: Stage) -> list[gfx.WorldObject]:
    return [thing for thing in stage.scene.iter() if isinstance(thing, (gfx.Mesh, gfx.Points))]


def obj(relative: bool = False, materials: str = "room.mtl") -> str:
    """A red cube at x = -2 with texture coordinates, and a grey one at x = 2, of a quad a face."""
    out = [f"mtllib {materials}"]
    for k, (name, x) in enumerate((("Left", -2), ("Right", 2))):
        points, normals, _ = box(1, 1, 1)
        out += [f"o {name}", *(f"v {a + x} {b} {c}" for a, b, c in points)]
        out += [f"vt {u} {v}" for _ in range(6) for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))]
        out += [f"vn {a} {b} {c}" for a, b, c in normals]
        out += [f"usemtl {name.lower()}"]
        for i in range(0, 24, 4):
            corners = [i + j + (-24 if relative else 24 * k + 1) for j in range(4)]
            out.append("f " + " ".join(f"{at}/{at}/{at}" for at in corners))
    return "\n".join(out) + "\n"


def write(folder: Path, name: str, data: str | bytes) -> str:
    path = folder / name
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return str(path)


def said(make: Callable[[], object]) -> list[str]:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        make()
    assert all(issubclass(one.category, AirlightWarning) for one in found)
    return [str(one.message) for one in found]


@pytest.mark.parametrize("relative", [False, True])
def test_obj_with_its_materials(relative: bool, tmp_path: Path) -> None:
    write(tmp_path, "room.mtl", "newmtl left\nKd 1 0 0\nmap_Kd -s 2 2 2 C:\\work\\check.png\nnewmtl right\nKd .5 .5 .5\nd 0.25\nKe 8 4 2\n")
    pixels = np.full((4, 4, 4), 255, np.uint8)
    pixels[0] = 0, 0, 0, 255
    write(tmp_path, "check.png", png(pixels))
    stage = open_scene(write(tmp_path, "room.obj", obj(relative)), "none")
    left, right = sorted(drawn(stage), key=lambda thing: vertices(thing)[:, 0].mean())
    assert (left.name, right.name) == ("Left", "Right")
    for thing, x in ((left, -2), (right, 2)):
        places = vertices(thing)
        assert places.min(axis=0) == pytest.approx([x - 1, -1, -1]) and places.max(axis=0) == pytest.approx([x + 1, 1, 1])
        assert len(thing.geometry.indices.data) == 12 and not thing.material.flat_shading
    assert left.material.map.texture.data.shape == (4, 4, 4) and left.material.color.to_physical()[:3] == pytest.approx((1, 0, 0), abs=1e-3)
    assert right.material.map is None and right.material.alpha_mode == "blend" and not right.cast_shadow
    assert right.material.emissive_intensity == 8 and stage.glowing == ("Right",)
    top = left.geometry.texcoords.data[:, 1].max()
    assert top == 1.0, "v down"


def test_obj_whose_files_are_not_there(tmp_path: Path) -> None:
    outside = write(tmp_path, "room.mtl", "newmtl left\nKd 1 0 0\n")
    folder = tmp_path / "scene"
    folder.mkdir()
    for name, words in (("room.mtl", "No such file"), ("../room.mtl", "outside its folder"), (outside, "not a place in its folder")):
        (line,) = said(lambda name=name: open_scene(write(folder, "a.obj", obj(materials=name)), "none"))
        assert words in line and "shown without the materials of" in line
    write(folder, "b.mtl", "newmtl left\nmap_Kd ../secret.png\nnewmtl right\nmap_Kd /dev/zero\nmap_Bump x.png\n")
    lines = said(lambda: open_scene(write(folder, "b.obj", obj(materials="b.mtl")), "none"))
    assert sorted(line.split(": shown without ")[1].split(":")[0] for line in lines) == [
        "its maps map_bump",
        "the texture '../secret.png'",
        "the texture '/dev/zero'",
    ]
    write(folder, "two words.mtl", "newmtl left\nKe 1 1 1\n")
    lines = said(lambda: open_scene(write(folder, "c.obj", obj(materials="two words.mtl")), "none"))
    assert not lines, "a name with a blank"
    lines = said(lambda: open_scene(write(folder, "c.obj", obj(materials="none.mtl b.mtl")), "none"))
    assert any("materials of 'none.mtl':" in line for line in lines) and any("secret" in line for line in lines), "two names"
    os.symlink("/dev/zero", folder / "room.mtl")
    (line,) = said(lambda: open_scene(write(folder, "a.obj", obj()), "none"))
    assert "outside its folder" in line


def ply(kind: str, points: np.ndarray, faces: list[list[int]], colors: np.ndarray | None = None) -> bytes:
    text = BOX.format(kind, len(points))
    if colors is not None:
        text += "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    if faces:
        text += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nproperty uchar flags\n"
    head = (text + "end_header\n").encode()
    rows = [(*p, *(() if colors is None else colors[i])) for i, p in enumerate(points)]
    if kind == "ascii":
        lines = [" ".join(map(str, row)) for row in rows] + [" ".join(map(str, (len(f), *f, 7))) for f in faces]
        return head + "\n".join(lines).encode() + b"\n"
    order = "<" if "little" in kind else ">"
    body = b"".join(struct.pack(order + "3f" + "3B" * (colors is not None), *row) for row in rows)
    return head + body + b"".join(struct.pack(f"{order}B{len(f)}iB", len(f), *f, 7) for f in faces)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("mixed", [False, True])
def test_ply_with_colours_and_polygons(kind: str, mixed: bool, tmp_path: Path, eye: Eye) -> None:
    """Quads, and a triangle and a pentagon among them; the colour is that of the vertices."""
    points = np.array([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [0, 3, 0], [-2, 2, 0.0]])
    faces = [[0, 1, 2, 3, 4], [0, 2, 4]] if mixed else [[0, 1, 2, 4]]
    colors = np.full((5, 3), 188)
    stage = open_scene(write(tmp_path, "a.ply", ply(kind, points, faces, colors)), "none")
    (mesh,) = drawn(stage)
    assert len(mesh.geometry.indices.data) == (4 if mixed else 2) and mesh.material.color_mode == "vertex"
    assert mesh.geometry.colors.data[0, :3] == pytest.approx(0.503, abs=0.002), "linear"
    assert mesh.material.flat_shading and mesh.receive_shadow


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("mixed", [False, True])
def test_ply_with_colours_of_quads(kind: str, mixed: bool, tmp_path: Path) -> None:
    """Each face keeps its colour where trimesh cuts it into triangles, which are not in the faces' order then."""
    points = np.array([[x, y, 0.0] for x in range(4) for y in range(2)])
    faces = [[2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1] for i in range(3)]
    if mixed:
        faces[1:2] = [faces[1][:3], [faces[1][0], *faces[1][2:]]]
    data = ply(kind, points, faces).replace(b"uchar flags", b"uchar red\nproperty uchar green\nproperty uchar blue")
    codes = [(188, 0, 0) if max(face) <= 3 else (0, 188, 0) if min(face) < 4 else (0, 0, 188) for face in faces]
    if kind == "ascii":
        lines = data.split(b"\n")
        for i, code in enumerate(codes):
            at = len(lines) - 1 - len(codes) + i
            lines[at] = lines[at].rpartition(b" ")[0] + b" %d %d %d" % code
        data = b"\n".join(lines)
    else:
        start = len(data) - sum(2 + 4 * len(face) for face in faces)
        body = b"".join(struct.pack(f"<B{len(f)}i3B", len(f), *f, *code) for f, code in zip(faces, codes, strict=True))
        data = data[:start] + body
    (mesh,) = drawn(open_scene(write(tmp_path, "a.ply", data), "none"))
    geometry = mesh.geometry
    middles = geometry.positions.data[geometry.indices.data].mean(axis=1)[:, 0] + mesh.local.position[0]
    shown = geometry.colors.data[geometry.indices.data[:, 0]][:, :3].argmax(axis=1)
    assert len(shown) == 6 and mesh.material.color_mode == "vertex"
    np.testing.assert_array_equal(shown, middles.astype(int))


@pytest.mark.parametrize("least, modes", [(255, ["solid"]), (250, ["solid"]), (100, ["solid", "blend"])])
def test_ply_with_alpha_is_solid_where_it_is_opaque(least: int, modes: list[str], tmp_path: Path) -> None:
    colors = np.array([[188, 188, 188, 255]] * 3 + [[188, 188, 188, least]])
    data = ply("ascii", np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]]), [[0, 1, 2, 3]], colors)
    data = data.replace(b"property uchar blue\n", b"property uchar blue\nproperty uchar alpha\n")
    found = drawn(open_scene(write(tmp_path, "a.ply", data), "none"))
    assert [mesh.material.alpha_mode for mesh in found] == modes
    assert [mesh.cast_shadow for mesh in found] == [mesh.material.depth_write for mesh in found] == [mode == "solid" for mode in modes]


def test_ply_of_points(tmp_path: Path, eye: Eye) -> None:
    grid = np.array([[x, y, 0] for x in np.arange(-2, 2, 1 / 16) for y in np.arange(-1, 1, 1 / 16)])
    grid[5] = np.nan
    data = ply("binary_little_endian", grid, [], np.full((len(grid), 3), (188, 0, 0)))
    path = write(tmp_path, "a.ply", data)
    assert said(lambda: open_scene(path, "none")) == [f"{path}: 1 point that is no number is left out"]
    with warnings.catch_warnings(action="ignore"):
        stage = open_scene(path, "none")
    seen = eye.linear(stage.scene, frontal())
    assert np.median(seen[24:40, 32:64, 0]) == pytest.approx(0.503, abs=0.01) and np.median(seen[24:40, 32:64, 1]) < 0.01


def stl(triangles: np.ndarray, text: bool) -> bytes:
    if text:
        rows = (
            "facet normal 0 0 0\nouter loop\n" + "".join("vertex {} {} {}\n".format(*p) for p in t) + "endloop\nendfacet\n"
            for t in triangles
        )
        return ("solid x\n" + "".join(rows) + "endsolid x\n").encode()
    head = b"solid by a program".ljust(80) + struct.pack("<I", len(triangles))
    return head + b"".join(struct.pack("<12fH", *(0, 0, 0), *t.ravel(), 0) for t in triangles)


def triangles(shift: tuple[float, float, float] = (0, 0, 0)) -> np.ndarray:
    points, _, faces = box(1, 2, 3)
    return (points + shift)[np.reshape(faces, (-1, 3))]


@pytest.mark.parametrize("text", [False, True])
def test_stl_has_z_up_and_another_axis_by_request(text: bool, tmp_path: Path) -> None:
    path = write(tmp_path, "a.stl", stl(triangles((0, 0, 3)), text))
    places = vertices(drawn(open_scene(path, "none"))[0])
    assert places.min(axis=0) == pytest.approx([-1, 0, -2]) and places.max(axis=0) == pytest.approx([1, 6, 2])
    places = vertices(drawn(open_scene(path, "none", up="y"))[0])
    assert places.max(axis=0) == pytest.approx([1, 2, 6])
    assert set(UP) == {"obj", "ply", "stl"} and is_scene("A.STL")
    with pytest.raises(AirlightError, match="says itself which way is up"):
        open_scene("table", up="z")


def test_they_are_seen_and_far_ones_too(tmp_path: Path) -> None:
    """With a camera that sees them, and as near the origin in UTM coordinates, which text holds in full."""
    pictures = []
    for shift in ((0, 0, 0), (500_000, 5_400_000, 200)):
        points, _, faces = box(1, 2, 3)
        lines = [f"v {a} {b} {c}" for a, b, c in (points + shift).tolist()]
        lines += ["f {} {} {}".format(*(i + 1 for i in faces[k : k + 3])) for k in range(0, 36, 3)]
        path, out = write(tmp_path, "a.obj", "\n".join(lines)), str(tmp_path / "a.png")
        assert main(["render", path, "-o", out, "-y", "--width", "96", "--quality", "draft", "--environment", "none"]) == 0
        from airlight.files import read_image

        pictures.append(read_image(out).codes.astype(int))
    assert pictures[0].std() > 10 and np.abs(pictures[1] - pictures[0]).max() <= 1


REFUSED = {
    "empty.obj": (b"", "shows nothing|damaged"),
    "points.stl": (stl(triangles()[:0], False), "shows nothing"),
    "cut.stl": (stl(triangles(), False)[:-9], "cut off"),
    "cut-text.stl": (stl(triangles(), True)[:-60], "cut off"),
    "words.stl": (stl(triangles(), True).replace(b"vertex -1", b"vertex x", 1), "damaged"),
    "many.stl": (b"solid a\nendsolid a\n" * 5000, "solids"),
    "header.ply": (b"ply\nformat ascii 1.0\n", "does not begin as PLY does"),
    "huge.ply": (BOX.format("ascii", 4_000_000_000).encode() + b"end_header\n0 0 0\n", "4000000000 elements"),
    "lists.ply": (
        BOX.format("binary_little_endian", 1).encode()
        + b"element face 1\nproperty list int int vertex_indices\nend_header\n"
        + bytes(12)
        + b"\xff\xff\xff\x7f",
        "cut off",
    ),
    "range.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "damaged|not among"),
    "far.obj": (b"v 0 0 0\nv 1e30 0 0\nv 0 1 0\nf 1 2 3\n", "reaches farther"),
    "nan.obj": (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "shows nothing"),
    "lines.obj": (b"v 0 0 0\nv 1 0 0\nl 1 2\n", "holds no faces"),
    "picture.obj": (png(np.zeros((4, 4, 4), np.uint8)), "shows nothing|damaged"),
}


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.filterwarnings("ignore::airlight.errors.AirlightWarning")
def test_refusals_are_one_line(name: str, tmp_path: Path) -> None:
    data, words = REFUSED[name]
    with pytest.raises(AirlightError, match=words) as error:
        open_scene(write(tmp_path, name, data))
    assert "\n" not in str(error.value) and str(error.value).startswith(str(tmp_path))


def test_a_fifo_and_a_device_are_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.ply")
    os.symlink("/dev/zero", tmp_path / "b.stl")
    for name in ("a.ply", "b.stl"):
        with pytest.raises(AirlightError, match="not a regular file"):
            open_scene(str(tmp_path / name))


def test_many_parts_do_not_take_for_ever(tmp_path: Path) -> None:
    """Each part of an .obj costs trimesh a mask over all vertices, and each of its names a search."""
    vertex = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    start = time.monotonic()
    many = vertex * 1000 + "".join(f"o {i}\nf 1 2 3\n" for i in range(5000))
    path = write(tmp_path, "a.obj", many)
    assert said(lambda: open_scene(path)) == [f"{path}: its 5000 objects are shown as one for each material"]
    with pytest.raises(AirlightError, match="too many to be told apart"):
        open_scene(write(tmp_path, "b.obj", vertex + "".join(f"usemtl {i}\nf 1 2 3\n" for i in range(5000))))
    assert time.monotonic() - start < 20


@pytest.mark.parametrize("number, seed", [(300, 1), pytest.param(6000, 2, marks=[pytest.mark.slow, pytest.mark.timeout(1800)])])
@pytest.mark.filterwarnings("ignore::airlight.errors.AirlightWarning")
def test_mutants(number: int, seed: int, tmp_path: Path) -> None:
    """Each becomes a stage, or is refused in one line, soon."""
    points = box(1, 2, 3)[0]
    quads = [list(range(i, i + 4)) for i in range(0, 24, 4)] + [[0, 1, 2]]
    seeds = {"obj": [obj().encode(), obj(True).encode()], "stl": [stl(triangles(), text) for text in (False, True)]}
    seeds["ply"] = [ply(kind, points, quads, np.full((24, 3), 99)) for kind in ("ascii", "binary_little_endian")]
    mtl = b"newmtl left\nKd 1 0 0\nmap_Kd check.png\nnewmtl right\nKe 1 2 3\nd 0.5\nNs 30\n"
    write(tmp_path, "check.png", png(np.full((4, 4, 4), 200, np.uint8)))
    faults, made = [], 0
    for i, kind in zip(range(number), itertools.cycle(seeds), strict=False):
        chance = random.Random(f"{seed}:{i}")
        data = mutate(chance, chance.choice(seeds[kind]), chance.choice(seeds[kind]))
        write(tmp_path, "room.mtl", mutate(chance, mtl, mtl) if chance.random() < 0.5 else mtl)
        start = time.monotonic()
        try:
            stage = open_scene(write(tmp_path, f"a.{kind}", data), "none")
            made += 1
            assert np.isfinite(stage.center).all() and stage.radius > 0
        except AirlightError as error:
            if "\n" in str(error) or len(str(error)) > 500:
                faults.append(f"{i}: {error}")
        except BaseException as error:
            faults.append(f"{i} {kind}: {error!r}")
        if time.monotonic() - start > 10:
            faults.append(f"{i} {kind}: hangs")
    assert not faults, "\n".join(faults[:5])
    assert made > number // 20


def test_a_face_of_vertices_that_are_not_there(tmp_path: Path) -> None:
    path = tmp_path / "bad.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n")
    with pytest.raises(AirlightError, match=r"is damaged, or no obj file \(a face has a vertex that is not there\); export it again"):
        open_scene(str(path))
