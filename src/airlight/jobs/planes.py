"""Reads a picture and the planes beside it: its mask, depths, subject."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from airlight.errors import AirlightError

if TYPE_CHECKING:
    import numpy as np

    from airlight.files import Picture


@dataclass(frozen=True)
class Reading:
    """Says how files are read; the names are those of the options of `airlight image`."""

    on_damage: str = "error"
    input_layer: str | None = None
    colorspace: str | None = None
    view: str | None = None
    mask_layer: str | None = None
    mask_invert: bool = False
    depth_near: str = "black"
    depth_layer: str | None = None
    subject_layer: str | None = None

    def picture(self, path: str) -> "Picture":
        """Read a picture. Raises AirlightError."""
        from airlight.files import read_image

        return read_image(path, self.on_damage, self.input_layer, self.colorspace, self.view)

    def _plane(self, path: str | None, layer: str | None, picture: "Picture", depth: bool = False) -> "np.ndarray | None":
        """Read a plane, (H, W): of a file, of a layer of it, or of a layer of the picture where there is no file."""
        from airlight.files import read_mask
        from airlight.files.planes_of import plane_of_file, plane_of_picture

        if layer is None:
            return None if path is None else read_mask(path, self.on_damage, depth, self.view)
        if path is None:
            return plane_of_picture(picture, layer, self.view)
        return plane_of_file(path, layer, self.on_damage, self.view, picture, depth)

    def mask(self, path: str | None, picture: "Picture") -> "np.ndarray | None":
        """Read a mask, (H, W) in 0..1: white emits."""
        emits = self._plane(path, self.mask_layer, picture)
        return 1 - emits if emits is not None and self.mask_invert else emits

    def depth(self, path: str | None, picture: "Picture") -> "np.ndarray | None":
        """Read depths, (H, W), larger is farther."""
        far = self._plane(path, self.depth_layer, picture, depth=True)
        if far is not None and self.depth_near == "white":
            far = (far.max() if far.max() > 1 else 1) - far
        return far

    def subject(self, path: str | None, picture: "Picture") -> "np.ndarray | None":
        """Read the mask of a subject, (H, W) in 0..1: white hides shafts."""
        return self._plane(path, self.subject_layer, picture)


def read_range(text: str) -> tuple[float, float]:
    """Read the two numbers of --near-range."""
    from airlight.look.near import check_range

    try:
        return check_range(text.split(","))
    except AirlightError:
        raise AirlightError(f"--near-range {text}: write two numbers, the first the smaller, as in 0.05,0.6") from None
