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
from airlight.compare.result import Comparison, PictureComparison, SceneComparison, SceneRow
from airlight.compare.sheet import codes_of
from airlight.files import write_image

PANEL = 960  # px, of a picture's longer side


def _uri(linear: npt.NDArray[Any]) -> str:
    """Encode (H, W, 3) or (H, W) linear as a JPEG in a data URI."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.jpg"
        write_image(path, None, encoded=codes_of(linear, PANEL))
        return "data:image/jpeg;base64," + base64.b64encode(path.read_bytes()).decode()


def _figure(linear: npt.NDArray[Any], alt: str, caption: str = "", *, id: str = "", under: str = "") -> str:
    """Write a figure. caption: HTML. id: of the picture; under: of that which is wiped over it."""
    height, width = linear.shape[:2]
    image = f'<img{f" id={id!r}" if id else ""} alt="{alt}" src="{_uri(linear)}" width="{width}" height="{height}">'
    image = f'<div class="wipe" data-over="{under}">{image}</div>' if under else image
    return f"<figure>{image}{f'<figcaption>{caption}</figcaption>' if caption else ''}</figure>"


def _pair(name: str, figures: list[str]) -> str:
    return f'<h2>{name}</h2>\n<div class="pair">\n' + "\n".join(figures) + "\n</div>\n"


def page(result: Comparison, title: str, amplify: float) -> str:
    """Write the page's text."""
    heads, cells = words.table(result)
    parts = []
    in_scene = isinstance(result, SceneComparison)
    if isinstance(result, SceneComparison):
        for i, truth in enumerate(result.truths):
            about = f"light {html.escape(truth.about)}"
            figures = [_figure(truth.shown, "the picture with the true light", about, id=f"before{i}")]
            parts.append(_pair("The truth", [*figures, _figure(truth.layer / result.white, "the true light alone", "its light alone")]))
    elif isinstance(result, PictureComparison):
        parts.append(_pair("The picture", [_figure(result.before, "the picture without shafts", id="before0")]))
    for row in result.rows:
        name, text = html.escape(row.variant.name), html.escape(row.variant.text)
        over, light = (row.truth, "light") if isinstance(row, SceneRow) else (0, "shafts")
        figures = [_figure(row.shown, name, f"with {light}: <code>{text}</code>", under=f"before{over}")]
        if isinstance(row, SceneRow) and isinstance(result, SceneComparison):
            times = f" {words.fitted(row)}" if row.factor else ""
            figures.append(_figure(row.layer / result.white, f"light of {name}", f"its light alone{times}; {words.cost(row)}"))
        figures.append(_figure(amplify * row.difference, f"difference of {name}", f"difference × {amplify:g}: {words.errors(row)}"))
        parts.append(_pair(name, figures))
    return Template(files("airlight").joinpath("compare/page.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        heads="".join(f"<th>{html.escape(head)}</th>" for head in heads),
        rows="".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in line) + "</tr>\n" for line in cells),
        notes="".join(f"<li>{html.escape(note)}</li>\n" for note in words.notes(result, amplify)),
        parts="".join(parts),
        wiped="how much of the picture is shown with the true light" if in_scene else "how much of the picture is shown without shafts",
    )
