"""Depth textures of given numbers."""

from pathlib import Path
from typing import Any

import numpy as np

from airlight.gpu.device import Device

SHADER = str(Path(__file__).with_suffix(".wgsl"))


def depth_texture(device: Device, depths: np.ndarray) -> Any:
    """A depth32float texture of (height, width), or of layers (n, height, width), 0..1."""
    layers = np.asarray(depths, np.float32).reshape(-1, *depths.shape[-2:])
    count, height, width = layers.shape
    usage = device.wgpu.TextureUsage.RENDER_ATTACHMENT | device.wgpu.TextureUsage.TEXTURE_BINDING
    texture = device.device.create_texture(size=(width, height, count), format="depth32float", usage=usage)
    state = {"format": "depth32float", "depth_write_enabled": True, "depth_compare": "always"}
    pipeline = device.raster(SHADER, "cover", "write", depth=state)
    spare = device.texture(width, height, "rgba16float")
    encoder = device.encoder()
    for i, layer in enumerate(layers):
        picture = device.texture(width, height, "rgba32float")
        device.write(picture, np.repeat(layer[..., None], 4, axis=2), 16 * width)
        run = encoder.begin_render_pass(
            color_attachments=[{"view": spare.create_view(), "load_op": "clear", "store_op": "discard"}],
            depth_stencil_attachment={
                "view": texture.create_view(dimension="2d", base_array_layer=i, array_layer_count=1),
                "depth_clear_value": 0.0,
                "depth_load_op": "clear",
                "depth_store_op": "store",
            },
        )
        run.set_pipeline(pipeline)
        run.set_bind_group(0, device.bind(SHADER, picture))
        run.draw(3)
        run.end()
    device.submit(encoder)
    return texture
