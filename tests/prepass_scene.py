"""A scene for the pre-pass: boxes, glass, a leaf, a skinned, a morphed and an instanced mesh, a lamp, before a sky."""

from types import SimpleNamespace

import numpy as np
import pygfx as gfx
import pylinalg as la


def leaf_map(size: int = 64) -> gfx.Texture:
    """A leaf's outline in the alpha of a texture (size, size), green."""
    y, x = np.mgrid[-1 : 1 : size * 1j, -1 : 1 : size * 1j]
    inside = np.abs(x) < 0.7 * (1 - y**2) * (0.75 + 0.25 * np.cos(9 * y))
    pixels = np.zeros((size, size, 4), np.uint8)
    pixels[...] = (40, 160, 30, 0)
    pixels[..., 3] = 255 * inside
    return gfx.Texture(pixels, dim=2)


def skinned_bar() -> tuple[gfx.SkinnedMesh, gfx.Bone]:
    """A bar of height 2 with a bone at its foot and one at its middle, which is given too."""
    geometry = gfx.box_geometry(0.35, 2.0, 0.35, 1, 12, 1)
    height = geometry.positions.data[:, 1] + 1.0
    weights = np.zeros((len(height), 4), np.float32)
    weights[:, 1] = np.clip((height - 0.7) / 0.6, 0, 1)
    weights[:, 0] = 1 - weights[:, 1]
    indices = np.zeros((len(height), 4), np.uint32)
    indices[:, 1] = 1
    geometry.skin_weights, geometry.skin_indices = gfx.Buffer(weights), gfx.Buffer(indices)
    mesh = gfx.SkinnedMesh(geometry, gfx.MeshStandardMaterial(color="#a33", side="front"))
    foot, middle = gfx.Bone(), gfx.Bone()
    foot.local.position, middle.local.position = (0, -1, 0), (0, 1, 0)
    foot.add(middle)
    mesh.add(foot)
    mesh.bind(gfx.Skeleton([foot, middle]))
    return mesh, middle


def morphed_ball() -> gfx.Mesh:
    """A ball of radius 0.4, whose one morph target is a column."""
    geometry = gfx.sphere_geometry(0.4, 24, 16)
    at = geometry.positions.data
    geometry.morph_positions = [at * np.array([0.4, 2.2, 0.4], np.float32) - at]
    geometry.morph_targets_relative = True
    mesh = gfx.Mesh(geometry, gfx.MeshPhongMaterial(color="#36c", alpha_mode="solid"))
    mesh.morph_target_influences = [0.0]
    return mesh


def exhibition() -> SimpleNamespace:
    """The scene, its camera (a picture twice as wide as high) and its parts by name."""
    scene = gfx.Scene()
    sky = gfx.Background(None, gfx.BackgroundMaterial("#334", "#223", "#99a", "#dde"))
    lamp = gfx.Mesh(gfx.sphere_geometry(0.5, 24, 16), gfx.MeshBasicMaterial(color="#fd8"))
    lamp.local.position = (0, 1.2, -3)
    box = gfx.Mesh(gfx.box_geometry(0.8, 0.8, 0.8), gfx.MeshStandardMaterial(color="#888", alpha_mode="solid"))
    box.local.position, box.local.rotation = (-3.4, 0, 0), la.quat_from_euler((0.4, 0.6, 0))
    glass = gfx.Mesh(gfx.plane_geometry(1.6, 1.6), gfx.MeshPhongMaterial(color="#8cf", opacity=0.5, alpha_mode="blend"))
    glass.local.position = (0.4, 1.0, 0)
    pane = gfx.Mesh(gfx.plane_geometry(0.8, 1.9), gfx.MeshBasicMaterial(color="#fff", opacity=0.25))
    pane.local.position = (0.6, 1.0, 0.4)
    leaf = gfx.Mesh(gfx.plane_geometry(1.2, 1.2), gfx.MeshStandardMaterial(map=leaf_map(), alpha_test=0.5, alpha_mode="solid", side="both"))
    leaf.local.position = (-1.7, 0.9, 0)
    frond = gfx.Mesh(gfx.plane_geometry(1.0, 1.0), gfx.MeshBasicMaterial(map=leaf_map()))
    frond.local.position = (-1.7, -0.6, 0)
    bar, bone = skinned_bar()
    bar.local.position = (2.0, 0.2, 0)
    bone.local.rotation = la.quat_from_euler((0, 0, -0.8))
    ball = morphed_ball()
    ball.local.position = (3.4, 0.6, 0)
    ball.morph_target_influences = [0.7]
    many = gfx.InstancedMesh(gfx.box_geometry(0.2, 0.2, 0.2), gfx.MeshToonMaterial(color="#c70"), 7)
    for i in range(7):
        many.set_matrix_at(i, la.mat_compose((-1.2 + 0.4 * i, -1.3, 0), la.quat_from_euler((0, 0.2 * i, 0.3 * i)), (1, 1 + 0.1 * i, 1)))
    line = gfx.Line(
        gfx.Geometry(positions=np.array([(-4, -1.8, 0), (4, -1.6, 0)], np.float32)), gfx.LineMaterial(thickness=6, color="#f0f")
    )
    hidden = gfx.Mesh(gfx.box_geometry(9, 9, 0.1), gfx.MeshBasicMaterial(), visible=False)
    helper = gfx.AxesHelper(2.0)
    sun = gfx.DirectionalLight(cast_shadow=True)
    sun.local.position = (3, 5, 4)
    for ob in (box, bar, ball, many, leaf):
        ob.cast_shadow = ob.receive_shadow = True
    parts = {"sky": sky, "lamp": lamp, "box": box, "glass": glass, "pane": pane, "leaf": leaf, "frond": frond, "bar": bar, "ball": ball}
    parts |= {"many": many, "line": line, "hidden": hidden, "helper": helper, "sun": sun, "ambient": gfx.AmbientLight(intensity=0.4)}
    scene.add(*parts.values())
    camera = gfx.PerspectiveCamera(50, 2, depth_range=(0.1, 100))
    camera.local.position = (0, 0.2, 5)
    return SimpleNamespace(scene=scene, camera=camera, bone=bone, **parts)
