"""Keeps the profiles of rays: what is scattered into them up to surfaces that are seen through, knot by knot."""

from typing import Any

from airlight.gpu.device import Device

SPANS = "scatter/march/spans.wgsl"
KNOTS = 8  # at most, of a ray; one more lies at its end
MOST_BYTES = 2**28  # of profiles, for which rays have fewer
BYTES = 8  # of a knot: four half floats


class Profile:
    """Holds the profiles of a march of a size (width, height).

    reaches: a texture of that size, to be drawn on before they are found: (farthest, -nearest, 0, count) of what is seen through on a ray,
    m. spans: a buffer of (first, last, count, reach) of each ray's knots. knots: at most, of a ray, but for the one at its end; values: a
    buffer of each knot's in-scattered radiance up to there, and optical length, as packed half floats, all rays' first ones first.
    """

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.size = size
        rays = size[0] * size[1]
        most = min(MOST_BYTES, device.device.limits["max-storage-buffer-binding-size"]) // (BYTES * rays)
        self.knots = min(max(most - 1, 1), KNOTS)
        self.reaches: Any = device.texture(*size, "rgba16float")
        self.spans: Any = device.buffer(size=16 * rays)
        self.values: Any = device.buffer(size=BYTES * rays * (self.knots + 1))
