"""Reads a picture and the planes beside it: its mask, depths, subject."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from airlight.files import Picture


@dataclass(frozen=True)
class Reading:
    """Says how files are read; the names are those of the options of `airlight image`."""

    on_damage: str = "error"
    input_layer: str | None = None
    colorspace: str | None = None
    mask_invert: bool = False
    depth_near: str = "black"
    depth_layer: str | None = None
    subject_layer: str | None = None

    def picture(self, path: str) -> "Picture":
        """Read a picture. Raises AirlightError."""
        from airlight.files import read_image

        return read_image(path, self.on_damage, self.input_layer, self.colorspace)

    def mask(self, path: str | None) -> "np.ndarray | None":
        """Read a mask, (H, W) in 0..1: white emits."""
        from airlight.files import read_mask

        emits = None if path is None else read_mask(path, self.on_damage)
        return 1 - emits if emits is not None and self.mask_invert else emits

    def depth(self, path: str | None, picture: "Picture") -> "np.ndarray | None":
        """Read depths, (H, W), larger is farther: of a file, or of a channel of the picture."""
        from airlight.files import read_mask

        far = None if path is None else read_mask(path, self.on_damage, depth=True)
        if self.depth_layer is not None:
            far = picture.channel(self.depth_layer)
        if far is not None and self.depth_near == "white":
            far = (far.max() if far.max() > 1 else 1) - far
        return far

    def subject(self, path: str | None, picture: "Picture") -> "np.ndarray | None":
        """Read the mask of a subject, (H, W) in 0..1, of a file or of a channel of the picture: white hides shafts."""
        from airlight.files import read_mask

        if self.subject_layer is not None:
            return picture.channel(self.subject_layer)
        return None if path is None else read_mask(path, self.on_damage)
