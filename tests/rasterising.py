"""Measures how finely the driver places the edges of triangles, for tests of what is drawn by them.

Vulkan asks for 4 binary digits after the pixel, which is 1/32 of a pixel at most between where an edge is and where it is drawn; Mesa and
most GPUs have 8, which is 1/512.
"""

from functools import cache
from pathlib import Path

import numpy as np

from airlight.gpu.device import open_device

SHADER = str(Path(__file__).with_name("edges.wgsl"))
WIDTH, ROWS, COLUMN, FINENESS = 16, 1024, 8, 4096
COARSEST = 1 / 32  # pixels, by the standard


@cache
def edge_error() -> float:
    """Measure the greatest distance, in pixels, between where an edge is and where it is drawn."""
    device = open_device()
    target = device.texture(WIDTH, ROWS, "rgba16float")
    encoder = device.encoder()
    attachment = {"view": target.create_view(), "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 0)}
    run = encoder.begin_render_pass(color_attachments=[attachment])
    run.set_pipeline(device.raster(SHADER, "row", "white"))
    run.set_bind_group(0, device.bind(SHADER))
    run.draw(6 * ROWS)
    run.end()
    device.submit(encoder)
    drawn = np.frombuffer(device.read(target, 8), np.float16).reshape(ROWS, WIDTH, 4)[:, COLUMN, 0] > 0
    beyond = np.arange(ROWS) - ROWS // 2  # of an edge, the middle of the pixel; in 1 / FINENESS of one
    return float(np.abs(beyond[drawn != (beyond <= 0)]).max(initial=0)) / FINENESS
