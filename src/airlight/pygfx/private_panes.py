"""Wraps the private attributes of pygfx that drawing what is seen through touches, beside those of private.py: which objects of a scene are
drawn later, or otherwise, and with which shaders. tests/test_scene_private.py names those that go away."""

import weakref
from collections.abc import Callable
from typing import Any

import wgpu
from pygfx.renderers.wgpu.engine import renderer as rendering
from pygfx.renderers.wgpu.engine.pipeline import get_pipeline_container_group
from pygfx.renderers.wgpu.engine.renderer import FlatScene, WobjectWrapper
from pygfx.renderers.wgpu.engine.shared import get_shared

from airlight.gpu.shader import load
from airlight.pygfx.private import upload

Code = Callable[[int, int], str]  # of a bind group's number and that of its first free binding, what becomes of fragments
_owners: Any = weakref.WeakKeyDictionary()  # of a renderer's blender: weak references to what holds objects back


class State:
    """Stands in for a render state of pygfx, with its lights, and another blender and more to read.

    base: the state. blender: see private.Blender. code: what becomes of fragments; None: what the blender says. kinds: of what is bound
    beside the lights by `bind`, as WebGPU's layouts have them.
    """

    def __init__(self, base: Any, blender: Any, code: Code | None = None, kinds: tuple[dict[str, Any], ...] = ()) -> None:
        self.base, self.blender, self.code = base, blender, code
        self.bindings = base.bindings
        self.wgpu_bind_group_layout, self.wgpu_bind_group = base.wgpu_bind_group_layout, base.wgpu_bind_group
        if kinds:
            found = [binding.get_bind_group_descriptors(i) for i, binding in enumerate(self.bindings)]
            self._entries = [entry for entry, _ in found]
            more = [{"binding": len(found) + i, "visibility": wgpu.ShaderStage.FRAGMENT, **kind} for i, kind in enumerate(kinds)]
            self._device = get_shared().device
            self.wgpu_bind_group_layout = self._device.create_bind_group_layout(entries=[layout for _, layout in found] + more)
            self._bound: tuple[Any, ...] = ()

    def bind(self, *resources: Any) -> None:
        """Binds what the shaders read beside the lights."""
        if resources != self._bound:
            more = [{"binding": len(self._entries) + i, "resource": resource} for i, resource in enumerate(resources)]
            self.wgpu_bind_group = self._device.create_bind_group(layout=self.wgpu_bind_group_layout, entries=self._entries + more)
            self._bound = resources

    def get_shader_kwargs(self, bind_group_index: int = 1) -> dict[str, Any]:
        found: dict[str, Any] = self.base.get_shader_kwargs(bind_group_index)
        if self.code is not None:
            found = {**found, "fragment_output_code": self.code(bind_group_index, len(self.bindings))}
        return found


def code_of(path: str, **constants: str) -> Code:
    """Reads a .wgsl file whose bindings are of group 9, from 90 on, for where they come to be. constants: other values of its `const`s."""
    code = load(path)
    for name, value in constants.items():
        before, _, after = code.partition(f"const {name} = ")
        code = f"{before}const {name} = {value};{after.partition(';')[2]}"

    def numbered(group: int, first: int) -> str:
        found = code.replace("@group(9)", f"@group({group})")
        for i in range(8):
            found = found.replace(f"@binding({90 + i})", f"@binding({first + i})")
        return found

    return numbered


def hold_back(renderer: Any, owner: Any) -> None:
    """Lets `owner` choose, while it lives, what of a scene a renderer draws otherwise.

    owner: has sort(scene, objects, renderstate), which gives for each object None, as pygfx draws it, "held": not at all, or states in the
    place of its own, to draw it with one after the other: (state, whether among what is solid); and hold(objects, renderstate, camera's
    uniforms), which is told those that are held, in the order of their drawing. Touches renderer._blender, FlatScene and its
    shadow_objects, _wobject_wrappers, _bake_functions, _compute_pipeline_containers; replaces the class that pygfx's renderers make.
    """
    if rendering.FlatScene is FlatScene:
        rendering.FlatScene = _Sorted
    _owners.setdefault(renderer._blender, []).append(weakref.ref(owner))


class _Sorted(FlatScene):  # type: ignore[misc]
    """Draws a scene as what holds objects back wants it."""

    shadow_objects: list[Any]
    _wobject_wrappers: list[Any]
    _bake_functions: list[Any]
    _compute_pipeline_containers: list[Any]

    def collect_pipelines_container_groups(self, renderstate: Any) -> None:
        if getattr(renderstate, "glass", None) is not None and not self.shadow_objects:
            self.shadow_objects = [self.scene]  # or pygfx asks for no maps of what dims lights
        alive = [owner for owner in _owners.get(renderstate.blender, ()) if owner() is not None]
        drawn = self._wobject_wrappers
        ways: Any = [None] * len(drawn)
        chosen = None
        for one in alive:
            owner = one()
            found = owner.sort(self.scene, [wrapper.wobject for wrapper in drawn], renderstate)
            if found is not None and chosen is None:
                chosen, ways = owner, found
        self._wobject_wrappers = [wrapper for wrapper, way in zip(drawn, ways, strict=True) if way is None]
        super().collect_pipelines_container_groups(renderstate)
        if chosen is None:
            return
        solid: list[Any] = []
        kept: list[Any] = []
        held: list[tuple[Any, Any]] = []
        for wrapper, way in zip(drawn, ways, strict=True):
            if way is None:
                (kept if wrapper.sort_key[0] > 2500 else solid).append(wrapper)
                continue
            for state, place in way:
                group = self._group(wrapper.wobject, state)
                if place == "held":
                    held.append((state, group.render_containers))
                    continue
                other = WobjectWrapper(wrapper.wobject, wrapper.sort_key, "opaque")
                other.render_containers = group.render_containers
                (solid if place == "solid" else kept).append(other)
        self._wobject_wrappers = solid + kept
        if held and not self._wobject_wrappers:
            _clear(renderstate.blender)
        chosen.hold(held, get_shared().uniform_buffer.data.copy())

    def _group(self, wobject: Any, state: Any) -> Any:
        group = get_pipeline_container_group(wobject, self.scene, state)
        self._compute_pipeline_containers.extend(group.compute_containers)
        self._bake_functions.extend((wobject, bake) for bake in group.bake_functions)
        return group


def _clear(blender: Any) -> None:
    """Clears a renderer's targets where nothing is drawn on them at once. Touches get_color_attachments, get_depth_attachment."""
    device = get_shared().device
    encoder = device.create_command_encoder()
    colors, depth = blender.get_color_attachments("opaque"), blender.get_depth_attachment()
    encoder.begin_render_pass(color_attachments=colors, depth_stencil_attachment=depth).end()
    device.queue.submit([encoder.finish()])


def pick_attachment(renderer: Any) -> Any:
    """Finds the attachment of a renderer's picture of what is picked; None where it has none. Touches renderer._blender."""
    blender = renderer._blender
    return blender.get_color_attachments("opaque")[1] if "pick" in blender.texture_info else None


def camera_data() -> Any:
    """Copies the uniforms of the camera that all of pygfx's shaders share. Touches get_shared and its uniform_buffer."""
    return get_shared().uniform_buffer.data.copy()


def use_camera(data: Any, **values: Any) -> None:
    """Fills these uniforms with a copy of them, some values of which are others, and uploads."""
    shared = get_shared().uniform_buffer
    shared.data[()] = data
    for name, value in values.items():
        shared.data[name] = value
    shared.update_full()
    upload()
