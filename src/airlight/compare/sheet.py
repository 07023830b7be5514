"""A comparison as one image: for each variant the picture and its difference, with name, error and cost below them."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.colour import encode_codes
from airlight.compare import words
from airlight.compare.measure import fit
from airlight.compare.result import Comparison, SceneComparison
from airlight.errors import MachineError

Codes = npt.NDArray[np.uint8]
PANEL, GAP, SIZE, LINE = 320, 16, 17, 24  # px: a picture's longer side, between cells, height of the text, from line to line
PAPER, INK, FAINT = 24, (0.94, 0.94, 0.94), (0.66, 0.66, 0.66)


def codes_of(linear: npt.NDArray[Any], box: int) -> Codes:
    """Encode (H, W, 3) linear, or (H, W) as grey, as sRGB codes (h, w, 3), fitted into box x box pixels."""
    small = fit(linear, box)
    rgb = small if small.ndim == 3 else np.repeat(small[..., None], 3, axis=2)
    return np.asarray(encode_codes(rgb, np.uint8, dither=False))


class Paper:
    """A grey image to put pictures and text on."""

    def __init__(self, width: int, height: int) -> None:
        import OpenImageIO as oiio

        self.oiio = oiio
        self.codes = np.full((height, width, 3), PAPER, np.uint8)
        self.texts: list[tuple[int, int, str, int, tuple[float, float, float]]] = []

    def put(self, x: int, y: int, picture: Codes) -> None:
        self.codes[y : y + picture.shape[0], x : x + picture.shape[1]] = picture

    def write(self, x: int, y: int, text: str, room: int, color: tuple[float, float, float] = INK, size: int = SIZE) -> None:
        """Draw a line of text below y, cut to `room` pixels."""
        wide = self._width(text, size)
        if wide > room:
            while text and self._width(text + "…", size) > room:
                text = text[:-1]
            text += "…"
        self.texts.append((x, y + size, text, size, color))

    def wrap(self, text: str, room: int, size: int = SIZE) -> list[str]:
        lines = [""]
        for word in text.split():
            longer = f"{lines[-1]} {word}".strip()
            if self._width(longer, size) > room and lines[-1]:
                lines.append(word)
            else:
                lines[-1] = longer
        return lines

    def _width(self, text: str, size: int) -> int:
        roi = self.oiio.ImageBufAlgo.text_size(text, size)
        return int(roi.xend - roi.xbegin) if roi.defined else 0

    def done(self) -> Codes:
        sheet = self.oiio.ImageBuf(self.codes)
        for x, y, text, size, color in self.texts:
            if not self.oiio.ImageBufAlgo.render_text(sheet, x, y, text, size, "", color):
                reason = " ".join(sheet.geterror().split())
                raise MachineError(f"this OpenImageIO cannot draw text ({reason}): write an .html page instead")
        return np.asarray(sheet.get_pixels(self.oiio.UINT8))


def _cells(result: Comparison, amplify: float) -> list[tuple[list[npt.NDArray[Any]], list[tuple[str, tuple[float, float, float]]]]]:
    """List the pictures of each cell, linear, and its lines of text with their colours."""
    cells: list[Any] = []
    if isinstance(result, SceneComparison):
        for truth in result.truths:
            cells.append(([truth.shown, truth.layer / result.white], [("truth, and its light alone", INK)]))
    more = words.beside(result)
    for i, row in enumerate(result.rows):
        lines = [(row.variant.name, INK), (words.errors(row), INK), (words.cost(row), INK), *((text, FAINT) for text in more[i : i + 1])]
        cells.append(([row.shown, amplify * row.difference], lines))
    return cells


def sheet(result: Comparison, title: str, amplify: float) -> Codes:
    """Lay the cells out: (h, w, 3) sRGB codes."""
    cells = [([codes_of(part, PANEL) for part in parts], lines) for parts, lines in _cells(result, amplify)]
    high, wide = cells[0][0][0].shape[:2]
    measure = Paper(1, 1)
    widest = max(measure._width(text, SIZE) for _, lines in cells for text, _ in lines)
    room = max(2 * wide, 420, min(widest, 2 * PANEL))  # for the text
    cell = (room + GAP, high + GAP + max(len(lines) for _, lines in cells) * LINE)
    columns = 2 if len(cells) > 2 else 1
    rows = -(-len(cells) // columns)
    width = GAP + columns * cell[0]
    heading = measure.wrap(title, width - 2 * GAP, SIZE + 4)
    notes = [line for note in words.notes(result, amplify) for line in measure.wrap(note, width - 2 * GAP)]
    top = GAP + len(heading) * (LINE + 6)
    paper = Paper(width, top + GAP + rows * cell[1] + GAP + len(notes) * LINE + GAP)
    for i, line in enumerate(heading):
        paper.write(GAP, GAP + i * (LINE + 6), line, width, size=SIZE + 4)
    for i, (pictures, lines) in enumerate(cells):
        x, y = GAP + i % columns * cell[0], top + GAP + i // columns * cell[1]
        for k, picture in enumerate(pictures):
            paper.put(x + k * wide, y, picture)
        for k, (text, color) in enumerate(lines):
            paper.write(x, y + high + 4 + k * LINE, text, room, color)
    for i, line in enumerate(notes):
        paper.write(GAP, top + GAP + rows * cell[1] + GAP + i * LINE, line, width, FAINT)
    return paper.done()
