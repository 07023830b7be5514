"""The composite of 8-bit sRGB pictures on the GPU, so that neither picture nor layer visits the CPU as floats."""

from typing import Any

import numpy as np

from airlight.composite.blend import Rule, measured, sample_step
from airlight.gpu.device import Device
from airlight.gpu.timing import timing
from airlight.noise import dither

COMPOSITE, LUMINANCES = "composite/composite.wgsl", "composite/luminances.wgsl"
RULE = np.dtype([("peak", "f4"), ("veil", "f4"), ("mix", "f4"), ("", "u4")])


def _luminances(device: Device, layer: Any) -> np.ndarray:
    """Those of every n-th pixel of a layer, n as in `blend.sample_step`."""
    width, height, _ = layer.size
    step = sample_step(width, height)
    columns, rows = -(-width // step), -(-height // step)
    found = device.buffer(size=4 * columns * rows)
    encoder = device.encoder()
    run = encoder.begin_compute_pass()
    run.set_pipeline(device.pipeline(LUMINANCES, "pick", STEP=step))
    run.set_bind_group(0, device.bind(LUMINANCES, layer, found))
    run.dispatch_workgroups(-(-columns // 64), rows)
    run.end()
    device.submit(encoder)
    return np.frombuffer(device.queue.read_buffer(found), np.float32)


def composite(device: Device, codes: Any, layer: Any, rule: Rule, timer: Any = None) -> Any:
    """The composited picture, an rgba8unorm texture, from codes (rgba8unorm) and layer (rgba16float); submits its work."""
    width, height, _ = codes.size
    peak, mix = measured(rule, _luminances(device, layer))
    values = np.zeros((), RULE)
    values["peak"], values["veil"], values["mix"] = peak, rule.veil**4, mix
    tile = np.ones((256, 256, 4), np.float32)
    tile[..., :3] = dither()
    noise = device.texture(256, 256, "rgba32float", target=False)
    device.write(noise, tile, 256 * 16)
    result = device.texture(width, height, "rgba8unorm")
    pipeline = device.pipeline(COMPOSITE, "composite", SCREEN=rule.blend == "screen", VEIL=peak > 0)
    bind = device.bind(COMPOSITE, device.buffer(values.tobytes(), uniform=True), codes, layer, noise, result)
    encoder = device.encoder()
    run = encoder.begin_compute_pass(**timing(timer, "composite"))
    run.set_pipeline(pipeline)
    run.set_bind_group(0, bind)
    run.dispatch_workgroups(-(-width // 64), height)
    run.end()
    if timer:
        timer.resolve(encoder)
    device.submit(encoder)
    return result
