"""Draws examples/depths/hill-sunset.exr, the depths of examples/photos/hill-sunset.jpg: metres along the view's axis, in halves.

Outlines are traced on the photograph, x and y in its pixels, and settle on the sharpest edge within a few pixels where the sun does not
dazzle; how far things are is an estimate by eye. Each layer hides those before it, from its outline on down.
"""

import sys
from dataclasses import dataclass

import numpy as np
import OpenImageIO as oiio

WIDTH, HEIGHT = 1600, 1067
DAZZLED = (690, 885)  # columns where the sun hides outlines
SETTLING_PX, MEDIAN_PX = 3, 5  # how far an outline may move to an edge, and the columns of whose moves the median is taken
Curve = list[tuple[float, float]]


@dataclass
class Layer:
    """Holds the outline of what lies behind it, from the left to the right, and metres there and `fall` pixels below, and so on down."""

    outline: Curve
    top: float
    foot: float
    fall: float


# fmt: off
LAYERS = [
    Layer([(830, 488), (870, 488), (900, 487), (915, 486), (930, 485), (955, 483), (970, 482), (985, 485.5), (1000, 489), (1095, 489),
           (1125, 476), (1140, 473), (1160, 470.5), (1175, 468.5), (1190, 467), (1200, 466.5), (1220, 468), (1240, 467.5), (1260, 465),
           (1275, 464), (1290, 465.5), (1300, 465), (1310, 459), (1316, 455.5), (1325, 457.5), (1340, 458), (1352, 462.5),
           (1370, 462.5), (1385, 461), (1400, 460), (1430, 459), (1465, 459), (1480, 460), (1490, 459.5), (1500, 455.5), (1520, 454),
           (1530, 453.5), (1540, 454.5), (1550, 453), (1565, 455), (1580, 453), (1599, 453)], 42000, 36000, 40),  # the farthest summits
    Layer([(0, 541), (25, 539), (50, 536), (75, 534.5), (100, 535), (118, 536), (140, 534), (170, 531), (200, 528), (230, 525),
           (255, 520), (275, 521), (300, 516.5), (315, 518), (335, 509), (345, 505.5), (360, 504), (372, 505.5), (385, 508.5),
           (400, 509), (420, 510), (437, 509), (455, 501), (470, 497), (495, 491.5), (520, 488), (535, 486.5), (560, 488),
           (572, 486.5), (585, 489), (605, 488.5), (650, 489), (690, 487), (710, 485), (720, 488), (780, 489), (850, 492), (900, 500),
           (935, 495), (960, 489), (985, 485.5), (1000, 482.5), (1020, 482.5), (1040, 481), (1060, 480.5), (1075, 479.5),
           (1090, 478.5), (1110, 479), (1130, 477.5), (1150, 475.5), (1165, 477), (1180, 479), (1210, 477), (1230, 475), (1250, 474.5),
           (1265, 475), (1290, 477.5), (1340, 478.5), (1358, 481), (1400, 486),
           (1599, 486)], 21000, 7500, 95),  # the range behind the valley
    Layer([(1335, 493), (1350, 488), (1362, 482), (1375, 476.5), (1390, 471.5), (1400, 468), (1415, 462), (1430, 457.5), (1438, 456.5),
           (1450, 458.5), (1465, 460), (1500, 461), (1515, 463), (1530, 465), (1550, 466.5), (1565, 468), (1599, 472)], 13000, 10000, 40),
    Layer([(1240, 505), (1265, 498), (1278, 494), (1290, 491), (1298, 489.5), (1310, 493), (1330, 494), (1350, 494), (1380, 493),
           (1400, 492), (1440, 489), (1460, 486), (1480, 485.5), (1500, 480.5), (1520, 474.5), (1540, 471), (1560, 468), (1575, 464),
           (1590, 460.5), (1599, 458)], 8500, 6000, 50),
    Layer([(835, 562), (860, 550), (890, 540), (920, 535), (945, 533), (965, 532.5), (985, 530), (1000, 529), (1015, 531), (1040, 527),
           (1060, 522.5), (1080, 520), (1095, 516), (1110, 512.5), (1122, 511.5), (1135, 516), (1160, 520)], 6500, 5500, 40),
    Layer([(280, 608), (300, 595), (315, 588), (330, 582.5), (345, 582), (360, 585), (375, 587), (390, 585), (410, 580), (430, 578),
           (455, 580), (500, 590)], 4500, 3500, 30),
    Layer([(0, 624.5), (20, 620), (40, 614), (60, 607), (75, 603), (100, 600), (120, 597.5), (135, 598.5), (142, 600), (150, 595.5),
           (162, 594), (175, 597), (190, 601), (205, 601.5), (212, 595), (225, 592), (262, 592), (266, 598), (280, 603), (300, 606),
           (420, 615)], 3200, 700, 130),  # wooded hills
    Layer([(1060, 540), (1100, 530), (1120, 524), (1145, 518), (1160, 515.5), (1175, 514.5), (1190, 510.5), (1210, 508), (1225, 506.5),
           (1240, 505), (1250, 507), (1265, 505.5), (1280, 506.5), (1300, 508.5), (1320, 513), (1340, 518), (1360, 522), (1380, 526),
           (1400, 528), (1415, 528), (1430, 527), (1440, 525), (1460, 522.5), (1480, 522.5), (1500, 523), (1520, 522), (1540, 520),
           (1560, 517), (1580, 519), (1599, 516)], 3200, 2000, 70),
    Layer([(0, 690), (66, 674), (133, 664), (200, 642), (267, 623), (330, 608), (385, 592), (410, 585), (450, 580), (500, 581.5),
           (525, 580), (560, 584), (570, 585), (595, 592), (620, 595), (645, 590), (657, 585), (685, 571), (705, 560), (730, 554),
           (750, 552), (780, 552), (810, 549), (840, 556), (860, 564), (890, 566), (910, 559), (920, 555), (940, 547.5), (970, 542),
           (1000, 537.5), (1040, 534), (1060, 534), (1080, 537.5), (1100, 540.5), (1140, 542), (1160, 544), (1200, 548), (1230, 555),
           (1260, 561), (1300, 563), (1330, 569), (1360, 573), (1400, 577), (1450, 580), (1500, 586), (1560, 600),
           (1599, 612)], 1500, 350, 120),
]
GRASS = [(0, 800), (67, 780), (85, 776), (110, 774), (140, 772), (165, 766), (200, 757), (215, 754), (250, 743), (300, 739), (320, 735),
         (350, 727), (375, 721), (400, 713), (430, 707), (450, 701), (480, 698), (520, 689), (560, 682), (600, 674), (640, 667), (680, 660),
         (720, 655), (760, 649), (800, 645), (840, 640), (880, 636), (920, 633), (960, 630), (1000, 628), (1040, 622.5), (1080, 618),
         (1100, 613), (1140, 611), (1180, 608), (1200, 606.5), (1300, 606), (1330, 609), (1360, 613), (1400, 614), (1420, 616), (1450, 620),
         (1500, 625.5), (1540, 632), (1570, 636), (1599, 640)]
POST = [[(0, 712), (18, 651), (23, 652), (26.5, 745), (21, 798), (15, 828), (0, 830)], [(0, 825), (26, 815), (50, 966), (33, 966)],
        [(18, 770), (40, 757), (55, 770), (63, 797), (61, 820), (54, 828), (32, 832), (16, 815)]]
TABLE = [(1006, 742), (1010, 730), (1025, 717), (1050, 706), (1080, 697), (1120, 693), (1180, 692), (1250, 694), (1300, 699), (1350, 707),
         (1390, 719), (1430, 736), (1460, 755), (1477, 772), (1483, 785), (1483, 810), (1477, 825), (1460, 842), (1430, 857), (1400, 866),
         (1360, 872), (1300, 875), (1250, 872), (1200, 862), (1145, 846), (1100, 835), (1060, 820), (1030, 800), (1015, 782), (1007, 762)]
PILLAR = [(1140, 840), (1306, 850), (1306, 1067), (1156, 1067)]
# fmt: on
GRASS_METRES = 45.0, 2.4  # at its outline, and at the picture's lower border
POST_METRES, PILLAR_METRES = 3.0, 2.2
TABLE_METRES = (3.0, 692), (1.7, 820)  # and the rows of its far and its near rim
SMOOTH_PX = 121  # columns over which depths below an outline are alike


def drawn(outline: Curve) -> np.ndarray:
    """Rows (W,) of an outline; infinite, so below the picture, where it has none."""
    xs, ys = np.array(outline, float).T
    return np.interp(np.arange(WIDTH), xs, ys, np.inf, np.inf)


def settled(rows: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Move an outline to where the photograph becomes darkest near it, smoothly from column to column; steps: (H, W), by which it does."""
    columns = np.flatnonzero(np.isfinite(rows))
    moves = np.arange(-SETTLING_PX, SETTLING_PX + 1)
    near = np.clip(np.round(rows[columns, None]).astype(int) + moves, 1, HEIGHT - 2)
    strength = np.clip(steps[near, columns[:, None]], 1e-6, None) ** 2
    move = (strength * moves).sum(axis=1) / strength.sum(axis=1)
    move[(columns > DAZZLED[0]) & (columns < DAZZLED[1])] = 0
    padded = np.pad(move, MEDIAN_PX // 2, mode="edge")
    out = rows.copy()
    out[columns] += np.median([padded[k : k + len(move)] for k in range(MEDIAN_PX)], axis=0)
    return out


def smoothed(rows: np.ndarray) -> np.ndarray:
    """Average an outline over neighbouring columns, so that depths below it draw no streaks."""
    out, columns = np.zeros_like(rows), np.flatnonzero(np.isfinite(rows))
    padded = np.pad(rows[columns], SMOOTH_PX // 2, mode="edge")
    out[columns] = np.convolve(padded, np.full(SMOOTH_PX, 1 / SMOOTH_PX), mode="valid")
    return out


def within(corners: Curve) -> np.ndarray:
    """Tell which pixels' centres lie in a polygon, (H, W) of bool."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    inside = np.zeros((HEIGHT, WIDTH), bool)
    for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1]):
        if y0 != y1:
            inside ^= ((y0 > y) != (y1 > y)) & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
    return inside


def draw(photo: np.ndarray) -> np.ndarray:
    """Draw the depths (H, W) of a photograph (H, W, 3) of codes, m."""
    grey = photo.astype(float).mean(axis=2)
    steps = np.zeros_like(grey)
    steps[1:] = (grey[:-1] - grey[1:]) / (grey[:-1] + grey[1:] + 8)
    y = np.arange(HEIGHT)[:, None] + 0.5
    metres = np.full((HEIGHT, WIDTH), np.inf)
    for layer in LAYERS:
        top = settled(drawn(layer.outline), steps)  # hills are darker than what is behind
        share = np.clip((y - smoothed(top)) / layer.fall, 0, 1)
        metres = np.where(y >= top, layer.top * (layer.foot / layer.top) ** share, metres)
    below = np.vstack([metres[1:], metres[-1:]])
    metres = np.where(np.isinf(metres), below, metres)  # what is partly land counts as land
    top = settled(drawn(GRASS), -steps)
    share = (y - top) / (HEIGHT - top)
    far, near = GRASS_METRES
    metres = np.where(y >= top, 1 / (1 / far + np.clip(share, 0, 1) * (1 / near - 1 / far)), metres)  # as of a plane
    for corners in POST:
        metres[within(corners)] = POST_METRES
    metres[within(PILLAR)] = PILLAR_METRES
    (far, first), (near, last) = TABLE_METRES
    return np.where(within(TABLE), 1 / np.interp(y, (first, last), (1 / far, 1 / near)), metres)


def main(photo: str, out: str) -> None:
    metres = draw(oiio.ImageBuf(photo).get_pixels(oiio.UINT8)[..., :3])
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 1, "half")
    spec.channelnames = ("Z",)
    spec["compression"] = "zip"
    spec["Copyright"] = "Drawn for the Airlight project, under its licence (MIT)"
    picture = oiio.ImageBuf(spec)
    picture.set_pixels(oiio.ROI(), np.ascontiguousarray(metres[..., None], np.float32))
    if not picture.write(out):
        sys.exit(picture.geterror())


if __name__ == "__main__":
    main(*(sys.argv[1:] or ("examples/photos/hill-sunset.jpg", "examples/depths/hill-sunset.exr")))
