"""A comparison as one HTML page that needs nothing else: pictures within it, no network."""

import base64
import html
import tempfile
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy.typing as npt

from airlight.compare.sheet import codes_of
from airlight.compare.shown import Shown
from airlight.files import write_image

PANEL = 960  # px, of a picture's longer side


def _uri(linear: npt.NDArray[Any]) -> str:
    """(H, W, 3) or (H, W) linear as a JPEG in a data URI."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.jpg"
        write_image(path, None, encoded=codes_of(linear, PANEL))
        return "data:image/jpeg;base64," + base64.b64encode(path.read_bytes()).decode()


def page(shown: Shown, title: str) -> str:
    """The page's text."""
    height, width = shown.before.shape[:2]
    size = f'width="{width}" height="{height}"'
    rows, variants = [], []
    for row in shown.rows:
        name, text = html.escape(row.name), html.escape(row.text)
        rows.append(f"<tr><td>{name}</td>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row.cells.values()) + "</tr>\n")
        (caption, first), *others = ((html.escape(caption), picture) for caption, picture in row.pictures)
        pictures = [
            f'<figure><div class="wipe"><img alt="{name}" src="{_uri(first)}" {size}></div>'
            f"<figcaption>{caption}: <code>{text}</code></figcaption></figure>"
        ]
        for caption, picture in others:
            alt = f"{caption.partition(':')[0]}, {name}"
            pictures.append(f'<figure><img alt="{alt}" src="{_uri(picture)}" {size}><figcaption>{caption}</figcaption></figure>')
        variants.append(f'<h2>{name}</h2>\n<div class="pair">\n' + "\n".join(pictures) + "\n</div>\n")
    return Template(files("airlight").joinpath("compare/page.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        columns="".join(f"<th>{html.escape(name)}</th>" for name in shown.rows[0].cells),
        rows="".join(rows),
        notes="".join(f"<li>{html.escape(note)}</li>\n" for note in shown.notes),
        before=_uri(shown.before),
        width=width,
        height=height,
        variants="".join(variants),
    )
