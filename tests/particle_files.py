"""Files of particles made by hand: tables of text, NumPy's archives, and PLY in its three orders."""

import io
import struct

import numpy as np

NAMES = ("x", "y", "z", "radius", "density")


def table(rows: np.ndarray, names: str | None = "x,y,z,radius,density", divider: str = ",", end: str = "\n") -> bytes:
    """Write rows as text. names: the first line, or none."""
    lines = [] if names is None else [names]
    return (end.join([*lines, *(divider.join(f"{v:.9g}" for v in row) for row in rows)]) + end).encode()


def npz(**arrays: np.ndarray) -> bytes:
    held = io.BytesIO()
    np.savez(held, **arrays)
    return held.getvalue()


def ply(rows: np.ndarray, names: tuple[str, ...] = NAMES, order: str = "ascii", kind: str = "float", before: bytes = b"") -> bytes:
    """Write rows as vertices. before: of the header, elements before them."""
    properties = "".join(f"property {kind} {name}\n" for name in names[: rows.shape[1]])
    head = f"ply\nformat {order} 1.0\ncomment by hand\n".encode() + before
    head += f"element vertex {len(rows)}\n{properties}element face 0\nproperty list uchar int vertex_indices\nend_header\n".encode()
    if order == "ascii":
        return head + table(rows, None, " ")
    sign = "<" if "little" in order else ">"
    return head + b"".join(struct.pack(f"{sign}{len(row)}{'d' if kind == 'double' else 'f'}", *row) for row in rows)


def rows(count: int = 20, columns: int = 5, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.1, 4, (count, columns)).astype(np.float32).astype(np.float64)


def seeds() -> list[bytes]:
    some = rows()
    return [
        table(some),
        table(some[:, :3], None, " "),
        table(some[:, :4], "# Points:0;Points:1;Points:2;diameter", ";", "\r\n"),
        npz(positions=some[:, :3], radius=some[:, 3], density=np.float32(2)),
        npz(x=some[:, 0], y=some[:, 1], z=some[:, 2]),
        ply(some),
        ply(some[:, :4], order="binary_little_endian"),
        ply(some, order="binary_big_endian", kind="double"),
    ]
