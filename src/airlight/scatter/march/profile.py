"""Keeps the profiles of rays: what is scattered into them up to surfaces that are seen through, knot by knot."""

from typing import Any

from airlight.gpu.device import Device

SPANS = "scatter/march/spans.wgsl"
FORMAT = "rgba16float"
KNOTS = 8  # at most, of a ray; one more lies at its end
FEWER = 4  # of a march of more pixels than
MANY_PIXELS = 2**21


class Profile:
    """Holds the profiles of a march of a size (width, height).

    reaches: rgba16float, of that size, to be drawn on before `record`: (farthest, -nearest, 0, count) of what is seen through on a ray, m.
    spans: rgba32float, (first, last, count, reach) of its knots. textures: rgba16float, a layer a knot: in-scattered radiance up to there,
    and optical length; lights write them in turn.
    """

    def __init__(self, device: Device, size: tuple[int, int], lights: int) -> None:
        self.device, self.size = device, size
        self.knots = KNOTS if size[0] * size[1] <= MANY_PIXELS else FEWER
        self.reaches, self.spans = device.texture(*size, FORMAT), device.texture(*size, "rgba32float")
        first = layers(device, size, self.knots + 1)
        self.textures = [first, layers(device, size, self.knots + 1) if lights > 1 else first]

    def fits(self, size: tuple[int, int], lights: int) -> bool:
        """Tells whether it serves a march of this size and so many lights."""
        return size == self.size and (lights < 2 or self.textures[0] is not self.textures[1])


def layers(device: Device, size: tuple[int, int], count: int) -> Any:
    """Creates a texture of several layers, to be written and loaded by shaders."""
    usage = device.wgpu.TextureUsage
    flags = usage.STORAGE_BINDING | usage.TEXTURE_BINDING | usage.COPY_SRC
    return device.device.create_texture(size=(*size, count), format=FORMAT, usage=flags)
