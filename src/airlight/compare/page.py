"""A comparison as one HTML page that needs nothing else: pictures within it, no network."""

import base64
import html
import tempfile
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy.typing as npt

from airlight.compare import words
from airlight.compare.measure import Comparison
from airlight.compare.sheet import codes_of
from airlight.files import write_image

PANEL = 960  # px, of a picture's longer side


def _uri(linear: npt.NDArray[Any]) -> str:
    """(H, W, 3) or (H, W) linear as a JPEG in a data URI."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.jpg"
        write_image(path, None, encoded=codes_of(linear, PANEL))
        return "data:image/jpeg;base64," + base64.b64encode(path.read_bytes()).decode()


def page(result: Comparison, title: str, amplify: float) -> str:
    """The page's text."""
    height, width = result.before.shape[:2]
    size = f'width="{width}" height="{height}"'
    rows, variants = [], []
    for row in result.rows:
        name, text = html.escape(row.variant.name), html.escape(row.variant.text)
        error, p99, worst, _ = words.figures(row)
        cells = (error, p99, worst, f"{row.copies:.1f}", f"{row.ms:.1f}", html.escape(words.limit(row.parameters)))
        rows.append(f"<tr><td>{name}</td>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>\n")
        pictures = f'<figure><div class="wipe"><img alt="{name}" src="{_uri(row.shown)}" {size}></div>'
        pictures += f"<figcaption>with shafts: <code>{text}</code></figcaption></figure>\n"
        pictures += f'<figure><img alt="difference of {name}" src="{_uri(amplify * row.difference)}" {size}>'
        pictures += f"<figcaption>difference × {amplify:g}: error {error}, max {worst}</figcaption></figure>"
        variants.append(f'<h2>{name}</h2>\n<div class="pair">\n{pictures}\n</div>\n')
    return Template(files("airlight").joinpath("compare/page.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        rows="".join(rows),
        notes="".join(f"<li>{html.escape(note)}</li>\n" for note in words.notes(result, amplify)),
        before=_uri(result.before),
        width=width,
        height=height,
        variants="".join(variants),
    )
