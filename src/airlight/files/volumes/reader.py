"""Read numbers and texts of a binary file in little-endian order, none beyond its end."""

import struct
from typing import BinaryIO, NoReturn

from airlight.errors import AirlightError

MAX_TEXT = 1024  # bytes of a name


class Reader:
    """Wrap an open file. path: as the user gave it. size: bytes of the file, as it was opened."""

    def __init__(self, file: BinaryIO, path: str) -> None:
        self.file, self.path = file, path
        self.size = file.seek(0, 2)
        file.seek(0)

    def refuse(self, what: str, cure: str = "export it again") -> NoReturn:
        raise AirlightError(f"{self.path}: {what}; {cure}")

    def damaged(self, what: str) -> NoReturn:
        self.refuse(f"is damaged: {what}", "copy or export it again")

    def bytes(self, count: int) -> bytes:
        found = self.file.read(count) if 0 <= count <= self.size else b""
        if len(found) != count:
            self.refuse("is cut off", "copy or export it again")
        return found

    def skip(self, count: int) -> None:
        self.seek(self.file.tell() + count)

    def seek(self, position: int) -> None:
        if not 0 <= position <= self.size:
            self.refuse("is cut off", "copy or export it again")
        self.file.seek(position)

    def u8(self) -> int:
        return self.bytes(1)[0]

    def u32(self) -> int:
        return int.from_bytes(self.bytes(4), "little")

    def i64(self) -> int:
        return int.from_bytes(self.bytes(8), "little", signed=True)

    def numbers(self, format: str) -> tuple[float, ...]:
        """Unpack numbers by a format of the struct module, without the sign of its order."""
        return struct.unpack(f"<{format}", self.bytes(struct.calcsize(f"<{format}")))

    def text(self) -> str:
        """Read a text with its length before it."""
        length = self.u32()
        if length > MAX_TEXT:
            self.damaged(f"a name of {length} bytes")
        return self.bytes(length).decode("utf-8", "replace")
