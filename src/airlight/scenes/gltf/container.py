"""The bytes of a glTF file and of what it names: regular files inside its folder only, up to MAX_BYTES together."""

import base64
import binascii
import os
import re
import stat
import struct
from dataclasses import dataclass, field
from typing import NoReturn
from urllib.parse import unquote

import msgspec

from airlight.errors import AirlightError
from airlight.messages import nearest_file
from airlight.process import standard
from airlight.scenes.gltf import MAX_BYTES, MAX_JSON_VALUES
from airlight.scenes.gltf.schema import Document
from airlight.scenes.names import A_FILE, is_picture

_GLB = struct.Struct("<4sII")
_CHUNK = struct.Struct("<II")
_JSON, _BIN = 0x4E4F534A, 0x004E4942
_DATA = re.compile(r"data:[\w.+/;=-]{0,200};base64,", re.ASCII)


@dataclass
class Container:
    """path: as the user gave it. document: the JSON. binary: the GLB's own chunk, or None. spent: bytes read so far."""

    path: str
    document: Document = field(init=False)
    binary: memoryview | None = None
    spent: int = 0

    def refuse(self, what: str, cure: str = "export it again") -> NoReturn:
        raise AirlightError(f"{self.path}: {what}; {cure}")

    def spend(self, size: int, name: str) -> None:
        self.spent += size
        if self.spent > MAX_BYTES:
            self.refuse(f"{name} makes it larger than the limit of {MAX_BYTES >> 20} MiB", "make it smaller first")

    def read(self, path: str, name: str) -> bytes:
        """Read a regular file, or what is piped in; other things (FIFOs, devices, folders) are refused without being read."""
        path = standard.local(path)
        try:
            if not stat.S_ISREG(os.stat(path).st_mode):  # before the opening: a device may act on being opened
                self.refuse(f"{name} is not a regular file", "give the name of a .glb or .gltf file and keep what it names beside it")
            handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            hint = nearest_file(path) if isinstance(error, FileNotFoundError) else ""
            raise AirlightError(f"{self.path}: {name} cannot be read ({reason}){hint or '; check the name and the permissions'}") from error
        with open(handle, "rb") as file:
            status = os.fstat(handle)
            if not stat.S_ISREG(status.st_mode):
                self.refuse(f"{name} is not a regular file", "give the name of a .glb or .gltf file")
            self.spend(status.st_size, name)
            return file.read(status.st_size)

    def resource(self, uri: str, name: str) -> bytes:
        """Read what a URI names: data in base64, or a file in the scene's folder or below it, links followed."""
        if uri[:5].lower() == "data:":
            match = _DATA.match(uri)
            if match is None:
                self.refuse(f"{name} holds data that are not in base64", "export it as .glb")
            self.spend(len(uri), name)
            try:
                return base64.b64decode(uri[match.end() :], validate=True)
            except (binascii.Error, ValueError):
                self.refuse(f"{name} holds damaged base64 data")
        plain = unquote(uri)
        if not plain or len(plain) > 1024 or ":" in plain or "\\" in plain or "\0" in plain or plain.startswith("/"):
            self.refuse(f"{name} lies at {shown(uri)}, which is not a place in its folder", "put the file there and name it without a path")
        try:
            folder = os.path.realpath(os.path.dirname(os.path.abspath(self.path)))
            place = os.path.realpath(os.path.join(folder, plain))
            inside = os.path.commonpath([folder, place]) == folder
        except (OSError, ValueError):
            inside = False
        if not inside:
            self.refuse(f"{name} lies at {shown(uri)}, outside its folder", "copy the file into the folder and name it without a path")
        return self.read(place, f"{name} ({shown(uri)})")


def shown(text: str) -> str:
    """Quote a text of the file in a message: one line, short, printable."""
    text = "".join(c if c.isprintable() else "?" for c in text[:60])
    return repr(text.encode("utf-8", "replace").decode())


def open_container(path: str) -> Container:
    """Read and parse a .glb or .gltf file; its buffers are read later. Raises AirlightError."""
    found = Container(path)
    data = memoryview(found.read(path, "the file"))
    text = data
    if data[:4] == b"glTF":
        text = _chunks(found, data)
    elif path.lower().endswith(".glb"):
        found.refuse("does not begin as GLB does", "rename it to .gltf if it is JSON, or export it again")
    raw = bytes(text)
    if standard.is_input(path) and not raw.strip():
        found.refuse("is empty", "copy or export it again")
    if standard.is_input(path) and not raw.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{"):
        if is_picture(path):
            found.refuse("is a picture, not a scene", "airlight image adds light shafts to it")
        found.refuse("is not a scene", f"give table, flying, or {A_FILE}")
    if raw.startswith(b"\xef\xbb\xbf"):
        raw = raw[3:]
    if raw.count(b",") + raw.count(b"[") + raw.count(b"{") > MAX_JSON_VALUES:
        found.refuse(f"holds more than {MAX_JSON_VALUES} JSON values", "make it smaller first")
    try:
        found.document = msgspec.json.decode(raw, type=Document)
    except RecursionError:
        found.refuse("its JSON is nested too deeply")
    except (msgspec.MsgspecError, ValueError) as error:  # ValueError: text that is not UTF-8
        found.refuse(f"its JSON is not that of glTF 2.0 ({' '.join(str(error).split())[:200]})")
    return found


def _chunks(found: Container, data: memoryview) -> memoryview:
    """Read the JSON chunk; the binary one goes into `found`."""
    if len(data) < 20:
        found.refuse("is cut off", "copy or export it again")
    _, version, length = _GLB.unpack_from(data)
    if version != 2:
        found.refuse(f"is GLB of version {version}", "export it as glTF 2.0")
    if not 20 <= length <= len(data):
        found.refuse(f"says that it has {length} bytes, but has {len(data)}", "copy or export it again")
    text, at = None, 12
    while at + 8 <= length:
        size, kind = _CHUNK.unpack_from(data, at)
        at += 8
        if size > length - at:
            found.refuse("has a chunk that ends behind the end of the file", "copy or export it again")
        if text is None:
            if kind != _JSON:
                found.refuse("does not begin with JSON")
            text = data[at : at + size]
        elif kind == _BIN and found.binary is None:
            found.binary = data[at : at + size]
        at += size
    if text is None:
        found.refuse("holds no JSON")
    return text
