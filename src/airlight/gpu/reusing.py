"""Reuse of textures, buffers and bind groups by a plan made anew, so that lights move without allocation."""

from typing import Any

from airlight.gpu.device import Device

ROOM = 1.25  # factor of what is needed, where a resource is made anew because it was too small


class ReusingDevice(Device):
    """Hands out after `again`, in the same order, what it made before, where that is large enough; buffers get their new data.

    So a plan may be made for each frame: while its shape stays, nothing is allocated or bound.
    """

    def __init__(self, device: Device) -> None:
        self.__dict__.update(device.__dict__)  # one cache of what is compiled
        self._made: dict[Any, list[Any]] = {}
        self._at: dict[Any, int] = {}
        self._binds: dict[Any, Any] = {}

    def again(self) -> None:
        """Begin a new plan, which replaces the one before."""
        self._at.clear()

    def _next(self, key: Any) -> tuple[list[Any], int]:
        at = self._at.get(key, 0)
        self._at[key] = at + 1
        return self._made.setdefault(key, []), at

    def _replace(self, made: list[Any], at: int, new: Any) -> Any:
        made[at:] = [new, *made[at + 1 :]]
        self._binds.clear()  # those of the resource before it
        return new

    def texture(self, width: int, height: int, format: str, *, target: bool = True, roomy: bool = False) -> Any:
        """Create or reuse a texture, as Device.texture."""
        made, at = self._next(("texture", format, target, roomy or (width, height)))
        if at < len(made):
            w, h, _ = made[at].size
            if w >= width and h >= height:
                return made[at]
            width, height = (had if had >= need else min(int(ROOM * need), self.max_side) for had, need in ((w, width), (h, height)))
        return self._replace(made, at, super().texture(width, height, format, target=target))

    def buffer(self, data: Any = None, size: int = 0, uniform: bool = False) -> Any:
        """Create or reuse a buffer, as Device.buffer; one given by its size holds what it held."""
        made, at = self._next(("buffer", uniform, data is None))
        need = size if data is None else len(data)
        if at == len(made) or made[at].size < need:
            room = need if at == len(made) else int(ROOM * need)
            self._replace(made, at, super().buffer(size=-(-room // 16) * 16, uniform=uniform))
        if data is not None:
            self.queue.write_buffer(made[at], 0, data)
        return made[at]

    def bind(self, path: str, *resources: Any) -> Any:
        """Create or reuse a bind group, as Device.bind."""
        key = path, *map(id, resources)
        if key not in self._binds:
            self._binds[key] = resources, super().bind(path, *resources)  # the resources are held, so that no id is used again
        return self._binds[key][1]
