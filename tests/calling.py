"""Calls one function of a shader of the package over arrays, on the device.

`call` adds a compute entry point to the shader as the package loads it, and runs nothing else of the file.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from wgsl import functions, uncommented

from airlight.gpu.device import Device, open_device
from airlight.gpu.shader import load
from airlight.gpu.structs import dtype_of

ARGUMENTS, RESULTS = 900, 901  # bindings, beyond those of any shader
LANES = 64


def call(
    path: str,
    function: str,
    arrays: Sequence[Any],
    *,
    constants: Mapping[str, float] | None = None,
    bindings: Mapping[str, Any] | None = None,
    private: Mapping[str, Any] | None = None,
    after: Sequence[str] = (),
) -> Any:
    """Call a function of a .wgsl file, or of one that it includes, once for each value of the arrays, which are broadcast together.

    arrays: one for each parameter, (...,) of scalars and bool, (..., n) of vectors, (..., columns, rows) of matrices, records of
    struct_dtype of structs. constants: of overrides. bindings: by the name of the variable: a record or an array of numbers for a buffer,
    (H, W, 4) for a texture, or what the device made: a buffer, a texture, a view, a sampler. private: values of var<private>, set before
    each call, as `arrays`. Returns what the function returns, (..., *shape); with `after`, the names of var<private>, (that or None,
    {name: values after each call}).
    """
    device = open_device()
    code = load(path)
    own = next(f for f in functions(code) if f.name == function)
    private = private or {}
    kinds = _private(code)
    names = [*(name for name, _ in own.parameters), *private]
    types = [*(kind for _, kind in own.parameters), *(kinds[name] for name in private)]
    values = [*arrays, *private.values()]
    if len(values) != len(types):
        raise TypeError(f"{function} takes {len(own.parameters)} arrays, not {len(arrays)}")
    outputs = ({"": own.returns} if own.returns else {}) | {name: kinds[name] for name in after}
    source = code + _entry(own, names, types, list(outputs.values()), list(private), list(after))

    layout = dtype_of(source, "Called_") if types else np.dtype([])
    parts = [np.asarray(v) for v in values]
    leading = [v.shape[: v.ndim - len(_shape(layout, i))] for i, v in enumerate(parts)]
    shape = np.broadcast_shapes(*leading) if leading else ()
    count = int(np.prod(shape))
    data = np.zeros(count, layout) if types else np.zeros(1, "u4")
    for i, v in enumerate(parts):
        component = _shape(layout, i)
        data[f"a{i}"] = _padded(np.broadcast_to(v, shape + v.shape[v.ndim - len(component) :]), component).reshape(count, *component)
    wanted = dtype_of(source, "Gave_")
    results = device.buffer(size=count * wanted.itemsize)
    _run(device, source, constants or {}, bindings or {}, device.buffer(data.tobytes()), results, count)
    gave = np.frombuffer(device.queue.read_buffer(results), wanted)
    found = {}
    for i, (name, kind) in enumerate(outputs.items()):
        value = gave[f"r{i}"]
        if three := re.match(r"mat\dx3", kind):
            value = value[..., : int(three[0][-1])]
        found[name] = (value != 0 if kind == "bool" else value).reshape(shape + value.shape[1:])
    if not after:
        return found[""]
    return found.pop("", None), found


def _entry(own: Any, names: list[str], types: list[str], gives: list[str], private: list[str], after: list[str]) -> str:
    """Write the entry point: its records hold bool as u32, which is host-shareable."""
    stored = ["u32" if kind == "bool" else kind for kind in types]
    read = [f"called_[i_].a{i}" + (" != 0u" if kind == "bool" else "") for i, kind in enumerate(types)]
    count = len(own.parameters)
    run = f"{own.name}({', '.join(read[:count])})"
    lines = [f"{name} = {text};" for name, text in zip(names[count:], read[count:], strict=True)]
    lines.append(f"let r_ = {run};" if own.returns else f"{run};")
    results = (["r_"] if own.returns else []) + after
    for i, (name, kind) in enumerate(zip(results, gives, strict=True)):
        lines.append(f"gave_[i_].r{i} = " + (f"u32({name});" if kind == "bool" else f"{name};"))
    members = "".join(f" a{i}: {kind}," for i, kind in enumerate(stored))
    given = "".join(f" r{i}: {'u32' if kind == 'bool' else kind}," for i, kind in enumerate(gives))
    text = f"\nstruct Gave_ {{{given} }}\n@group(0) @binding({RESULTS}) var<storage, read_write> gave_: array<Gave_>;\n"
    if types:
        text += f"struct Called_ {{{members} }}\n@group(0) @binding({ARGUMENTS}) var<storage, read> called_: array<Called_>;\n"
    lines = ["let i_ = id_.x;", "if (i_ >= arrayLength(&gave_)) { return; }", *lines]
    head = f"@compute @workgroup_size({LANES})\nfn call_(@builtin(global_invocation_id) id_: vec3u) {{\n"
    return text + head + "\n".join(lines) + "\n}\n"


@cache
def _pipeline(device: Device, source: str, constants: tuple[tuple[str, float], ...]) -> Any:
    module = device.device.create_shader_module(code=source)
    compute = {"module": module, "entry_point": "call_", "constants": dict(constants)}
    return device.device.create_compute_pipeline(layout="auto", compute=compute)


def _run(device: Device, source: str, constants: Any, bindings: Any, arguments: Any, results: Any, count: int) -> None:
    pipeline = _pipeline(device, source, tuple(sorted((name, float(value)) for name, value in constants.items())))
    entries = [{"binding": RESULTS, "resource": device.binding(results)}]
    if "called_" in source:
        entries.append({"binding": ARGUMENTS, "resource": device.binding(arguments)})
    numbers = dict(re.findall(r"@binding\((\d+)\) var(?:<[^>]*>)? (\w+):", uncommented(source)))
    by_name = {name: int(number) for number, name in numbers.items()}
    for name, value in bindings.items():
        entries.append({"binding": by_name[name], "resource": device.binding(_resource(device, source, name, value))})
    encoder = device.encoder()
    run = encoder.begin_compute_pass()
    run.set_pipeline(pipeline)
    run.set_bind_group(0, device.device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries))
    run.dispatch_workgroups(-(-count // LANES))
    run.end()
    device.submit(encoder)


def _resource(device: Device, source: str, name: str, value: Any) -> Any:
    """Upload an array; leave what the device made as it is."""
    if not isinstance(value, (np.ndarray, np.generic)):
        return value
    if not re.search(rf"\bvar {name}: texture", source):
        data = value.tobytes()
        return device.buffer(data + bytes(-len(data) % 16), uniform=True)
    height, width, _ = value.shape
    texture = device.texture(width, height, "rgba32float", target=False)
    device.write(texture, np.ascontiguousarray(value, np.float32), 16 * width)
    return texture


def _private(code: str) -> dict[str, str]:
    return {name: kind.replace(" ", "") for name, kind in re.findall(r"\bvar<private> (\w+): ([^;=]+?)\s*[;=]", uncommented(code))}


def _shape(layout: np.dtype[Any], i: int) -> tuple[int, ...]:
    return layout[f"a{i}"].shape


def _padded(value: Any, component: tuple[int, ...]) -> Any:
    """Pad columns of three rows to four."""
    if component and value.shape[-1] == 3 and component[-1] == 4:
        return np.concatenate([value, np.zeros_like(value[..., :1])], axis=-1)
    return value
