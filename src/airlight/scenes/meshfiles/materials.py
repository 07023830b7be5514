"""Make pygfx's materials of what an .mtl file says, with textures that lie in its folder."""

import io
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pygfx as gfx
from PIL import Image

from airlight.errors import AirlightError, warn
from airlight.scenes.gltf import MAX_PIXELS, images
from airlight.scenes.gltf.container import Container, shown
from airlight.scenes.gltf.materials import colour

MAX_STRENGTH = 60000.0  # radiance of what emits
_OPTION = re.compile(r"-(?:[os]|t)(?:\s+-?[\d.]+){1,3}\s+|-mm(?:\s+-?[\d.]+){2}\s+|-\w+\s+\S+\s+")
_USED = {"map_kd", "map_ke"}


def _stand_in() -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (1, 1)).save(out, "png")
    return out.getvalue()


class Library(Mapping[str, bytes]):
    """Gives trimesh an .obj's .mtl files, all of them as one, and in place of each texture a small one: pixels are decoded here, after a
    look at their size.

    files: as the .obj names them. split: whether it is split by objects. lost: what to tell of files that cannot be read.
    """

    def __init__(self, file: Container) -> None:
        self.file, self.files, self.split = file, [], False
        self.file_name = None  # trimesh would name meshes by it
        self.lost: list[str] = []
        self._spent = 0
        self._textures: dict[str, gfx.Texture | None] = {}
        self._stand_in = _stand_in()
        self._asked: list[str] = []  # names of textures

    files: list[str]

    def get(self, name: str, default: Any = None) -> Any:
        return self[name]

    def __getitem__(self, name: str) -> bytes:
        if not self.files or name != self.files[0]:
            self._asked.append(name)
            return self._stand_in
        found = []
        waiting = list(dict.fromkeys(self.files))
        while waiting:
            each = waiting.pop(0)
            try:
                found.append(self.file.resource(_plain(each), "its .mtl file"))
            except AirlightError as error:
                if len(each.split()) > 1:  # no name with blanks, then, but several names, as the format has them
                    waiting[:0] = each.split()
                    continue
                reason = str(error).partition(": ")[2].partition(";")[0]
                self.lost.append(f"{self.file.path}: shown without the materials of {shown(each)}: {reason}")
        return b"\n".join(found)

    def __iter__(self) -> Any:
        return iter(self.files)

    def __len__(self) -> int:
        return len(self.files)

    # ------------------------------------------------------------ materials

    def material(self, described: Any, textured: bool, flat: bool) -> gfx.MeshStandardMaterial:
        """Make the material of a trimesh.visual.material.SimpleMaterial, None: grey. textured: whether the mesh has texture coordinates."""
        if described is None:
            return gfx.MeshStandardMaterial(color="#c8c8c8", roughness=0.8, metalness=0.0, side="both", flat_shading=flat)
        values = {key: _numbers(value) for key, value in described.kwargs.items()}
        kd, ke = _triple(values.get("kd"), 0.8), _triple(values.get("ke"), 0.0)
        image = None
        if described.image is not None:  # of a PLY there is one, whose name trimesh does not keep
            image = described.image.info.get("file_path") or next(iter(self._asked), None)
        base = self._texture(image) if image and textured else None
        glow = self._texture(" ".join(described.kwargs["map_ke"])) if "map_ke" in described.kwargs and textured else None
        if glow is not None and not ke.any():
            ke = np.ones(3)
        alpha = _one(values.get("d"), 1.0 - _one(values.get("tr"), 0.0))
        shine = described.glossiness if isinstance(described.glossiness, float | int) else 0.0
        strength = float(ke.max())
        more: dict[str, Any] = {"alpha_mode": "solid"}
        if alpha < 1:
            more = {"alpha_mode": "blend", "depth_write": False}
        elif base is not None and base.texture.data[..., 3].min() < 255:
            more = {"alpha_mode": "solid", "alpha_test": 0.5}  # leaves
        return gfx.MeshStandardMaterial(
            color=colour((*np.clip(kd, 0, 1), alpha)),
            map=base,
            emissive=colour(tuple(ke / strength)) if strength > 0 else "#000",
            emissive_intensity=min(strength, MAX_STRENGTH) if strength > 0 else 1.0,
            emissive_map=glow,
            roughness=_one(values.get("pr"), float(np.clip(2 / (max(shine, 0.0) + 2), 0, 1) ** 0.5)),
            metalness=_one(values.get("pm"), 0.0),
            side="both",
            flat_shading=flat,
            **more,
        )

    def say_ignored(self, used: list[Any]) -> None:
        """Tell, once, which maps of the materials have no part in the picture."""
        named = {str(key) for one in used if one is not None for key in one.kwargs}
        ignored = sorted(name for name in named if name.startswith(("map_", "bump", "disp", "norm", "refl")) and name not in _USED)
        if ignored:
            warn(f"{self.file.path}: shown without its maps {', '.join(name[:20] for name in ignored[:8])}", 6)

    def _texture(self, text: str) -> gfx.TextureMap | None:
        """Decode the texture of a map_ line; None, with a line, where it is not there or not readable."""
        name = _plain(text)
        if name not in self._textures:
            try:
                self._textures[name] = gfx.Texture(self._pixels(name), dim=2, generate_mipmaps=True)
            except AirlightError as error:
                reason = str(error).partition(": ")[2].partition(";")[0]
                warn(f"{self.file.path}: shown without the texture {shown(name)}: {reason}", 8)
                self._textures[name] = None
        found = self._textures[name]
        return None if found is None else gfx.TextureMap(found, wrap="repeat", filter="linear")

    def _pixels(self, name: str) -> np.ndarray:
        data = self.file.resource(name, "a texture")
        size = images.size(data)
        if size is None or not images.readable(data):
            self.file.refuse(f"{shown(name)} is none of PNG, JPEG, WebP and AVIF")
        self._spent += size[1] * size[2]
        if self._spent > MAX_PIXELS:
            self.file.refuse(f"its textures have more than {MAX_PIXELS >> 20} million pixels", "make them smaller")
        return images.pixels(data, size[0], f"{self.file.path}: {shown(name)}")


def _plain(text: str) -> str:
    """Take the options off a file's name; a whole path of another machine names a file beside the scene."""
    text = text.strip().strip('"')
    while (found := _OPTION.match(text)) is not None:
        text = text[found.end() :]
    text = text.replace("\\", "/")
    return text.rpartition("/")[2] if re.match(r"[A-Za-z]:", text) else text


def _numbers(value: Any) -> list[float]:
    """Read finite numbers, as trimesh keeps the values of a line: a number, numbers, or words."""
    try:
        found = [float(v) for v in (value if isinstance(value, list | tuple) else [value])]
    except (TypeError, ValueError):
        return []
    return found if np.isfinite(found).all() else []


def _triple(values: list[float] | None, default: float) -> np.ndarray:
    if not values:
        return np.full(3, default)
    return np.maximum(np.array((values * 3)[:3] if len(values) < 3 else values[:3]), 0)


def _one(values: list[float] | None, default: float) -> float:
    return min(max(values[0] if values else default, 0.0), 1.0)
