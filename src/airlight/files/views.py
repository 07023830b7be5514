"""Choose among the views of a stereo EXR, whose names stand before those of its channels; the first is the default, and has none."""

from typing import Any

from airlight.errors import AirlightError, warn
from airlight.messages import nearest


def views_of(spec: Any) -> tuple[str, ...]:
    """List the views, the default first; none where a picture has only one."""
    value = spec.getattribute("multiView")
    found = tuple(value) if isinstance(value, (tuple, list)) else (value,) if isinstance(value, str) else ()
    return tuple(str(one) for one in found) if len(found) > 1 else ()


def in_view(name: str, view: str) -> str:
    """Name a channel of a view as an EXR of one part does: `R` of right is `right.R`, `diffuse.R` is `diffuse.right.R`."""
    layer, _, channel = name.rpartition(".")
    return f"{layer}.{view}.{channel}" if layer else f"{view}.{channel}"


def layer_of(spec: Any, view: str | None, layer: str | None, path: str) -> str | None:
    """Name the layer to work on in a view; None for the picture's own. Raises AirlightError for a view that is not there.

    view: None for the default, of which a line tells.
    """
    views = views_of(spec)
    if view is None:
        if views and layer is None:
            warn(f"{path}: holds the views {', '.join(views)}; {views[0]} is used (--view names another)", 5, common=True)
        return layer
    if view not in views:
        there = f"it has {', '.join(views)}" if views else "it is of one view: leave --view out"
        raise AirlightError(f"{path}: has no view {view!r}; {there}{nearest(view, views)}")
    if view == views[0]:
        return layer
    return view if layer is None or layer.lower() == "rgba" else f"{layer}.{view}"


def of_name(spec: Any, name: str) -> str | None:
    """Name the view that a channel or a layer belongs to; None in a picture of one view."""
    views = views_of(spec)
    return next((one for one in views[1:] if one in name.split(".")), views[0]) if views else None


def group_of(spec: Any, layer: str | None, group: str) -> str:
    """Name a layer of ours beside the layer that is worked on: airlight, or airlight.right in a view that is not the default."""
    view = of_name(spec, layer or "")
    return f"{group}.{view}" if view is not None and view != views_of(spec)[0] else group


def told(spec: Any, layer: str | None, names: list[str]) -> list[str]:
    """List channels for the user: those of the view that is worked on by their names, of the others the views."""
    view = of_name(spec, layer or "")
    others = dict.fromkeys(f"the view {other}" for name in names if (other := of_name(spec, name)) != view)
    return [*others, *(name for name in names if of_name(spec, name) == view)]


def join(spec: Any, parts: list[Any]) -> None:
    """Put the views that the parts of an EXR name into the spec of all, as an EXR of one part has them."""
    found = tuple(dict.fromkeys(name for part in parts if (name := part.get_string_attribute("view"))))
    spec.erase_attribute("view")
    if len(found) > 1:
        spec.attribute("multiView", f"string[{len(found)}]", found)
