"""Keeps the profiles of rays: what is scattered into them up to surfaces that are seen through, knot by knot."""

from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype

SPANS = "scatter/march/spans.wgsl"
SPAN = struct_dtype("scatter/march/profile.wgsl", "PackedSpan")
KNOTS = 8  # at most, of a ray; one more lies at its end
MOST_BYTES = 2**29  # of profiles, for which rays have fewer
BYTES = 8  # of a knot: four half floats


class Profile:
    """Holds the profiles of a march of a size (width, height).

    extremes, sums: textures of that size, to be drawn on before spans are found, (farthest, -nearest) of what is seen through on a ray, m,
    and (sum of distances, of their squares, their number). spans: a buffer of PackedSpan, in profile.wgsl. knots: at most, of a ray, but
    for the one at its end; values: a buffer of each knot's in-scattered radiance up to there, and optical length, as packed half floats,
    all rays' first ones first.
    """

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.size = size
        rays = size[0] * size[1]
        most = min(MOST_BYTES, device.device.limits["max-storage-buffer-binding-size"]) // (BYTES * rays)
        self.knots = min(max(most - 1, 1), KNOTS)
        self.extremes, self.sums = (device.texture(*size, blendable(device)) for _ in range(2))
        usage = device.wgpu.TextureUsage.RENDER_ATTACHMENT
        self.depth = device.device.create_texture(size=(*size, 1), format="depth32float", usage=usage)  # for whoever draws on these
        self.spans = device.buffer(size=SPAN.itemsize * rays)
        self.values = device.buffer(size=BYTES * rays * (self.knots + 1))


def blendable(device: Device) -> str:
    """Chooses the format of pictures that are blended onto, two and what is picked at once: with digits to spare, where the device can."""
    room = device.device.limits["max-color-attachment-bytes-per-sample"] >= 2 * 16 + 8
    return "rgba32float" if "float32-blendable" in device.device.features and room else "rgba16float"
