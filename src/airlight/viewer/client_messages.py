"""Decode what a page of the browser view may say over its websocket, its numbers clamped."""

import math
from typing import Annotated, Literal

import msgspec

MOST_PIXELS, MOST_SIDE = 3840 * 2160, 4096  # of the canvas, physical

# What a client may say. Anything else is dropped: other types (close, and what rendercanvas means for itself, with a "_"), other fields.

Button = Annotated[int, msgspec.Meta(ge=0, le=6)]
Buttons = Annotated[list[Button], msgspec.Meta(max_length=6)]
Modifiers = Annotated[list[Literal["Alt", "Control", "Meta", "Shift"]], msgspec.Meta(max_length=4)]
Word = Annotated[str, msgspec.Meta(max_length=32)]


class _Message(msgspec.Struct, tag_field="type", forbid_unknown_fields=True):
    timestamp: float


class _At(_Message):
    x: float
    y: float
    modifiers: Modifiers


class _Pointer(_At):
    button: Button
    buttons: Buttons
    ntouches: Literal[0] = 0
    touches: Annotated[dict[str, None], msgspec.Meta(max_length=0)] = {}


class _Down(_Pointer, tag="pointer_down"):
    pass


class _Up(_Pointer, tag="pointer_up"):
    pass


class _Move(_Pointer, tag="pointer_move"):
    pass


class _Enter(_Pointer, tag="pointer_enter"):
    pass


class _Leave(_Pointer, tag="pointer_leave"):
    pass


class _Double(_At, tag="double_click"):
    button: Button
    buttons: Buttons


class _Wheel(_At, tag="wheel"):
    dx: float
    dy: float
    buttons: Buttons


class _Key(_Message):
    key: Word
    modifiers: Modifiers


class _KeyDown(_Key, tag="key_down"):
    pass


class _KeyUp(_Key, tag="key_up"):
    pass


class _Char(_Message, tag="char"):
    data: Word | None
    is_composing: bool
    input_type: Word


class _Resize(_Message, tag="resize"):
    width: float
    height: float
    pwidth: float
    pheight: float
    ratio: float


class Paste(_Message, tag="paste"):
    """Text of the clipboard, which the page tells when it is pasted."""

    text: Annotated[str, msgspec.Meta(max_length=4096)]


class Feedback(_Message, tag="_framefeedback"):
    index: int
    localtime: float


ClientMessage = _Down | _Up | _Move | _Enter | _Leave | _Double | _Wheel | _KeyDown | _KeyUp | _Char | _Resize | Feedback | Paste
_DECODER = msgspec.json.Decoder(ClientMessage)
_SPANS = {
    **dict.fromkeys(("x", "y"), (-2.0 * MOST_SIDE, 2.0 * MOST_SIDE)),
    **dict.fromkeys(("dx", "dy"), (-10_000.0, 10_000.0)),
    **dict.fromkeys(("timestamp", "localtime"), (0.0, 1e10)),
    "ratio": (0.1, 10.0),
}


def decode_message(text: str) -> ClientMessage | None:
    """Decode a client's message, its numbers clamped; None where it is none that a client may send."""
    try:
        message: ClientMessage = _DECODER.decode(text)
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        return None
    for name in message.__struct_fields__:
        if name in _SPANS:
            low, high = _SPANS[name]
            setattr(message, name, min(max(getattr(message, name), low), high))
    if isinstance(message, _Resize):
        _bound(message)
    return message


def _bound(size: _Resize) -> None:
    """Give too large a canvas fewer pixels a point: the points stay, and so the pointer's coordinates."""
    width, height = (min(max(v, 1.0), 1e6) for v in (size.pwidth, size.pheight))
    shrunk = min(1.0, MOST_SIDE / max(width, height), math.sqrt(MOST_PIXELS / (width * height)))
    size.pwidth, size.pheight = (max(1, math.floor(v * shrunk)) for v in (width, height))
    size.ratio *= shrunk
    size.width, size.height = size.pwidth / size.ratio, size.pheight / size.ratio
