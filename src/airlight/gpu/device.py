"""The adapter, its limits, and a cache of what is compiled on it. Nothing here knows about scattering."""

import contextlib
import os
import sys
import tempfile
import threading
from functools import lru_cache
from typing import Any

from airlight.errors import AirlightError, MachineError
from airlight.gpu.cffi_type_cache import cache_simple_types
from airlight.gpu.shader import bindings, load
from airlight.gpu.slices import current
from airlight.messages import nearest

CURE = {
    "linux": "install a Vulkan driver; software Vulkan: `sudo apt install mesa-vulkan-drivers libvulkan1`",
    "darwin": "Metal is part of macOS: update it, or run outside a container",
    "win32": "update the graphics driver",
}
WANTED_FEATURES = ("timestamp-query", "float32-filterable", "float32-blendable")


def cure() -> str:
    """Say how to get an adapter on this system, in a few words."""
    return CURE.get(sys.platform, CURE["linux"])


@lru_cache(maxsize=1)
def _wgpu() -> Any:
    if "XDG_RUNTIME_DIR" not in os.environ and sys.platform.startswith("linux"):
        os.environ["XDG_RUNTIME_DIR"] = tempfile.gettempdir()  # the driver prints a complaint without it
    import wgpu

    with contextlib.suppress(ImportError):  # elsewhere in another version: only slower
        from wgpu.backends.wgpu_native._ffi import ffi

        cache_simple_types(ffi)
    return wgpu


def adapters() -> list[Any]:
    """List the adapters of native back ends. OpenGL is left out: it is what wgpu falls back to where no driver is."""
    try:
        found = _wgpu().gpu.enumerate_adapters_sync()
    except Exception:  # the library raises different types where no driver can be loaded
        return []
    return [a for a in found if a.info["backend_type"] in ("Vulkan", "Metal", "D3D12")]


def driver_of(info: Any) -> str:
    """Name the driver of an adapter and its version, of what wgpu tells of it; not every driver tells a version."""
    name, version = str(info.get("vendor") or ""), str(info.get("description") or "")
    return f"{name} {version}".strip() if version else f"{name or 'one without a name'}, which tells no version"


class Recording:
    """Records commands, which may also be carried out before all are there, see `pause`."""

    def __init__(self, device: "Device") -> None:
        self.device = device
        self._encoder = device.device.create_command_encoder()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._encoder, name)

    def pause(self) -> None:
        """Submit what was recorded and wait until it is done: between two long passes, so that an interrupt is answered."""
        self.device.submit(self)
        self.device.wait()
        self._encoder = self.device.device.create_command_encoder()

    def divide(self) -> None:
        """Submit what was recorded where work is carried out in slices, see `gpu.slices`; elsewhere it stays one piece."""
        if current():
            self.device.submit(self)
            self._encoder = self.device.device.create_command_encoder()


class Device:
    """Holds a device, its queue, and the pipelines compiled so far (each once)."""

    def __init__(self, device: Any) -> None:
        self.wgpu = _wgpu()
        self.device, self.queue = device, device.queue
        self.info: dict[str, Any] = dict(device.adapter.info)
        self.max_side: int = device.limits["max-texture-dimension-2d"]
        self.is_cpu = self.info.get("adapter_type") == "CPU"
        self.timestamps = "timestamp-query" in device.features
        self.kept: dict[str, Any] = {}  # what plans share
        self._lock = threading.Lock()
        self._pipelines: dict[Any, Any] = {}
        self._modules: dict[str, Any] = {}
        self._numbers: dict[str, list[int]] = {}  # of the bindings of each module
        self._samplers: dict[str, Any] = {}

    @classmethod
    def of(cls, device: Any) -> "Device":
        """Return a Device as it is, or wrap a wgpu.GPUDevice that the caller holds. Raises AirlightError for anything else."""
        if not isinstance(device, (cls, _wgpu().GPUDevice)):
            raise AirlightError(f"device {device!r}: give the name of an adapter, an airlight.Renderer or a wgpu.GPUDevice")
        return device if isinstance(device, cls) else cls(device)

    @classmethod
    def on(cls, adapter: Any) -> "Device":
        """Open a new device of an adapter, with as large textures and buffers as it gives. Raises MachineError."""
        wanted = ("max-texture-dimension-2d", "max-storage-buffer-binding-size", "max-buffer-size")
        try:
            return cls(
                adapter.request_device_sync(
                    required_features=[f for f in WANTED_FEATURES if f in adapter.features],
                    required_limits={name: adapter.limits[name] for name in wanted},
                )
            )
        except Exception as error:
            raise MachineError(f"the adapter {adapter.info['device']} gave no device ({error}); {cure()}") from None

    @property
    def name(self) -> str:
        return str(self.info.get("device", "unknown"))

    @property
    def driver(self) -> str:
        return driver_of(self.info)

    @property
    def described(self) -> str:
        """Describe the adapter, its interface and its driver in a line."""
        return f"{self.name}, {self.info.get('backend_type')}, driver: {self.driver}"

    def _module(self, path: str) -> tuple[Any, Any, Any]:
        if path not in self._modules:
            code = load(path)
            module = self.device.create_shader_module(code=code, label=path)
            entries = bindings(code)
            group = self.device.create_bind_group_layout(entries=entries)
            self._modules[path] = module, group, self.device.create_pipeline_layout(bind_group_layouts=[group])
            self._numbers[path] = sorted(entry["binding"] for entry in entries)
        return self._modules[path]

    def pipeline(self, path: str, entry: str, **constants: float) -> Any:
        """Compile the compute pipeline of an entry point of a .wgsl file of the package, with its override constants."""
        key = (path, entry, tuple(sorted(constants.items())))
        with self._lock:
            if key in self._pipelines:
                return self._pipelines[key]
            module, _, layout = self._module(path)
            compute = {"module": module, "entry_point": entry, "constants": {k: float(v) for k, v in constants.items()}}
            self._pipelines[key] = self.device.create_compute_pipeline(layout=layout, compute=compute, label=f"{path}:{entry}")
            return self._pipelines[key]

    def raster(
        self, path: str, corners: str, pixels: str, format: str = "rgba16float", *, blend: Any = None, depth: Any = None, **constants: float
    ) -> Any:
        """Compile the render pipeline of a vertex and a fragment entry point, of triangles onto one image of a format, which it replaces,
        or onto several, their formats with + between.

        blend, depth: the states of WebGPU's names, to mix with the image and to test depths.
        """
        key = (path, corners, pixels, format, str(blend), str(depth), tuple(sorted(constants.items())))
        with self._lock:
            if key in self._pipelines:
                return self._pipelines[key]
            module, _, layout = self._module(path)
            overrides = {k: float(v) for k, v in constants.items()}
            mixed = {} if blend is None else {"blend": blend}
            targets = [{"format": one, **mixed} for one in format.split("+")]
            self._pipelines[key] = self.device.create_render_pipeline(
                layout=layout,
                vertex={"module": module, "entry_point": corners},
                fragment={"module": module, "entry_point": pixels, "constants": overrides, "targets": targets},
                primitive={"topology": "triangle-list"},
                depth_stencil=depth,
                label=f"{path}:{pixels}",
            )
            return self._pipelines[key]

    def texture(self, width: int, height: int, format: str, *, target: bool = True, roomy: bool = False) -> Any:
        """Create a 2-D texture to sample, load and copy; `target`: also to be written by shaders, or drawn on; `roomy`: it may be
        larger."""
        usage = self.wgpu.TextureUsage
        flags = usage.TEXTURE_BINDING | usage.COPY_DST | usage.COPY_SRC
        if target:
            flags |= usage.STORAGE_BINDING | usage.RENDER_ATTACHMENT
        return self.device.create_texture(size=(width, height, 1), format=format, usage=flags)

    def buffer(self, data: Any = None, size: int = 0, uniform: bool = False) -> Any:
        """Create a storage buffer, which may be a uniform's too, filled with bytes-like data if given."""
        usage = self.wgpu.BufferUsage
        flags = usage.COPY_DST | usage.STORAGE | (usage.UNIFORM if uniform else usage.COPY_SRC)
        if data is not None:
            return self.device.create_buffer_with_data(data=data, usage=flags)
        return self.device.create_buffer(size=size, usage=flags)

    def sampler(self, filter: str = "linear") -> Any:
        if filter not in self._samplers:
            self._samplers[filter] = self.device.create_sampler(mag_filter=filter, min_filter=filter)
        return self._samplers[filter]

    def bind(self, path: str, *resources: Any) -> Any:
        """Create the bind group of a .wgsl file: textures, samplers, buffers in the order of their binding numbers."""
        numbers = self._numbers[path]
        entries = [{"binding": i, "resource": self.binding(r)} for i, r in zip(numbers, resources, strict=True)]
        return self.device.create_bind_group(layout=self._modules[path][1], entries=entries)

    def binding(self, r: Any) -> Any:
        """Describe a resource for a bind group: a whole buffer, a view of a texture, a sampler as it is."""
        if isinstance(r, self.wgpu.GPUBuffer):
            return {"buffer": r, "offset": 0, "size": r.size}
        return r.create_view() if isinstance(r, self.wgpu.GPUTexture) else r

    def write(self, texture: Any, data: Any, bytes_per_row: int) -> None:
        """Upload rows of pixels; submitted at once, since uploads without a submit never free their memory."""
        width, height, _ = texture.size
        layout = {"bytes_per_row": bytes_per_row, "rows_per_image": height}
        self.queue.write_texture({"texture": texture}, data, layout, (width, height, 1))

    def read(self, texture: Any, bytes_per_pixel: int) -> memoryview:
        """Download a texture, rows tight."""
        width, height, _ = texture.size
        layout = {"bytes_per_row": width * bytes_per_pixel, "rows_per_image": height}
        data: memoryview = self.queue.read_texture({"texture": texture}, layout, (width, height, 1))
        return data

    def encoder(self) -> "Recording":
        return Recording(self)

    def submit(self, encoder: Recording) -> None:
        """Submit what was recorded; work in slices waits for it, and lets go if its time is over."""
        self.queue.submit([encoder.finish()])
        if work := current():
            self.wait()
            work.pause()

    def wait(self) -> None:
        """Wait until all that was submitted is done."""
        if "fence" not in self.kept:
            self.kept["fence"] = self.buffer(size=16)
        self.queue.read_buffer(self.kept["fence"])


def choose(name: str | None = None) -> Any:
    """Choose the adapter whose name holds `name` (any case), else the fastest: discrete, integrated, then software."""
    found = adapters()
    if not found:
        raise MachineError(f"no graphics adapter found: {cure()}")
    if name:
        matching = [a for a in found if name.lower() in f"{a.info['device']} {a.info['backend_type']} {a.info['adapter_type']}".lower()]
        if not matching:
            there = [a.info["device"] for a in found]
            words = [word for device in there for word in device.replace("(", " ").replace(",", " ").split()]
            raise AirlightError(f"no adapter matches {name!r}{nearest(name, [*there, *words], ': there is ' + ', '.join(there))}")
        found = matching
    order = {"DiscreteGPU": 0, "IntegratedGPU": 1, "VirtualGPU": 2, "CPU": 3}
    return min(found, key=lambda a: order.get(a.info["adapter_type"], 4))


@lru_cache(maxsize=8)
def open_device(name: str | None = None) -> Device:
    """Open the device to compute on; the same one for the same name. Raises MachineError with the cure where there is none."""
    return Device.on(choose(name))


def shared_device(name: str | None = None) -> Device:
    """Open wgpu's default device, which pygfx uses too: on the adapter whose name holds `name`, with the times of passes where it can.
    Raises MachineError where there is no adapter, AirlightError where the device is made already, on another one."""
    wgpu = _wgpu()
    with contextlib.suppress(ImportError):
        import pygfx  # noqa: F401  first, as it asks for features of the device that is still to be made

    chosen = choose(name)
    with contextlib.suppress(RuntimeError):  # it is there already: everything has to use it
        features = {f for f in WANTED_FEATURES if f in chosen.features}
        wgpu.preconfigure_default_device("airlight", adapter=chosen, required_features=features)
    device = wgpu.get_default_device()
    info = device.adapter.info
    if name and name.lower() not in f"{info['device']} {info['backend_type']} {info['adapter_type']}".lower():
        raise AirlightError(f"this process computes on {info['device']} already; choose {name!r} in a new one")
    return Device.of(device)
