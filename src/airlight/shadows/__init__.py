"""Shadow maps: the kinds of lights fit them, through `fit`; `airlight.pygfx.casters` draws them, the methods of `scatter` read them."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt


@dataclass
class ShadowView:
    """Describes one layer of a shadow map.

    matrix: (4, 4) float64, world to (x w, y w, depth w, w): x, y in texels, (0, 0) the map's upper left corner, texel i from i to i + 1;
    depth is 1 at the near plane and falls with the distance from the light, to 0 at the far plane of a sun, or as near / distance of a
    light with a position, whose w is the distance along the view's axis. Where nothing is drawn the map holds 0, and beyond a far plane
    depth is below 0: lit is max(depth, 0) >= what the map holds.
    span: distances along the camera's axis between which a cascade holds; the first begins at 0, the last ends at infinity.
    texel: metres that a texel is wide; of a light with a position, at 1 m. depth_scale: metres from the near to the far plane of a sun;
    else near.
    """

    matrix: npt.NDArray[np.float64]
    span: tuple[float, float] = (0.0, np.inf)
    texel: float = 0.0
    depth_scale: float = 1.0


@dataclass
class Shadow:
    """Holds the shadow map of a light: a wgpu texture, depth32float, 2-D array of size x size, a layer each view.

    A sun has 1 to 4 views (cascades, near to far); beyond their map everything is lit. A spot has one: its cone lies in it. A point has
    six, which tile all directions. Views' order is that of the layers. drawn: what was drawn, to compare with what a later one says; None:
    it cannot be compared. glass: a buffer of what dims the light without hiding it, of glass_side x glass_side texels a view, see
    `pygfx.glass_maps.GlassMaps`; None: nothing does. coloured: it holds colours.
    """

    texture: Any
    size: int
    views: list[ShadowView] = field(default_factory=list)
    drawn: Any = None
    glass: Any = None
    glass_side: int = 0
    coloured: bool = False
