"""Refines the edge of a sky: the share of a pixel that is sky, and the part of its light that what stands before the sky has."""

import numpy as np

from airlight.planes import box

TILE = 512  # px, of the parts that are worked on one by one
BAND_PX = 3  # to each side of an edge that is known to a pixel: where pixels may be mixed
RADII_PX = (6, 16, 40, 100)  # of the squares over which the colours of pure sky and pure land are averaged
NEARNESS = 4  # power of these by which smaller ones count more
LEAST_SURE = 1e-9  # of such squares, by their weights: rounding leaves less where there is none
LEAST_CONTRAST = 0.06  # of the brighter, between sky and land, linear: less tells nothing apart, 1.4 times that all
WHITE = 0.95  # linear: what the sun dazzles tells no share either
SURE = 0.02  # share, up to which a pixel is pure
OVER = 1.25  # by how much shares are stretched about a half: sharpened edges overshoot, and land is not all of one colour
Plane = np.ndarray


def soften(image: Plane, sky: Plane, band: int = BAND_PX) -> Plane:
    """Give the share of each pixel that is sky, (H, W) float32, where its edge is known to some pixels.

    image: (H, W, 3) linear; sky: (H, W) bool. Pixels within band px of the edge lie between the mean colours of sky and land beside it,
    as a mixture of both does; where these are alike, the edge stays.
    """
    return mixture(image, eroded(sky, band), eroded(~sky, band), sky.astype(np.float32))


def eroded(mask: Plane, radius: int) -> Plane:
    """Leave out what is within radius px of a mask's edge. mask: (H, W) bool."""
    return np.asarray(box(mask.astype(np.float32), radius) > 1 - 1e-6)


def mixture(image: Plane, sky: Plane, land: Plane, otherwise: Plane) -> Plane:
    """Estimate the share of sky, (H, W), by colours: image (H, W, 3) linear; sky, land: (H, W) bool, where it is 1 and 0 for sure;
    otherwise: (H, W), taken where colours tell nothing."""
    found = np.where(sky, 1, np.where(land, 0, otherwise)).astype(np.float32)
    for own, wide in _tiles(~(sky | land), RADII_PX[-1]):
        inner = _within(own, wide)
        light, dark = (_means(image[wide], one[wide])[inner] for one in (sky, land))
        apart = light - dark
        contrast = (apart * apart).sum(axis=-1)
        strength = np.maximum((light * light).sum(axis=-1), (dark * dark).sum(axis=-1))
        with np.errstate(invalid="ignore", divide="ignore"):
            along = ((image[own] - dark) * apart).sum(axis=-1) / contrast
            trust = np.clip(contrast / (LEAST_CONTRAST**2 * strength) - 1, 0, 1)
        told = np.isfinite(trust) & np.isfinite(along) & ~(sky | land)[own] & (image[own].min(axis=-1) < WHITE)
        share = np.clip((along - 0.5) * OVER + 0.5, 0, 1)
        found[own] = np.where(told, found[own] + trust * (share - found[own]), found[own])
    return found


def land_part(image: Plane, share: Plane) -> Plane:
    """Estimate the part of each pixel's light that comes of what is before the sky, (H, W, 3) float32 of 0..1.

    image: (H, W, 3) linear; share: (H, W), of sky. A mixed pixel has s S + (1 - s) L, S and L near the mean colours of pure sky and land
    beside it: of all such, those with the least squares of changes.
    """
    part = np.repeat((1 - share)[..., None], 3, axis=-1).astype(np.float32)
    for own, wide in _tiles((share > 0) & (share < 1), RADII_PX[-1]):
        inner, s = _within(own, wide), share[wide]
        light, dark = _means(image[wide], s >= 1 - SURE)[inner], _means(image[wide], s <= SURE)[inner]
        s, whole = share[own][..., None], image[own]
        left = whole - s * light - (1 - s) * dark
        with np.errstate(invalid="ignore", divide="ignore"):
            found = (1 - s) * (dark + (1 - s) * left / (s * s + (1 - s) ** 2)) / whole
        mixed = (s > 0) & (s < 1) & np.isfinite(found)
        part[own] = np.where(mixed, np.clip(found, 0, 1), part[own])
    return part


def spread(values: Plane, known: Plane, wanted: Plane) -> Plane:
    """Give wanted pixels, (H, W) bool, the mean of values (H, W) that are known beside them; those that have none stay as they are."""
    out = np.array(values)
    for own, wide in _tiles(wanted, RADII_PX[-1]):
        found = _means(np.where(known[wide], values[wide], 0)[..., None], known[wide])[..., 0][_within(own, wide)]
        out[own] = np.where(wanted[own] & np.isfinite(found), found, out[own])
    return out


def _means(image: Plane, sure: Plane) -> Plane:
    """Average an image (H, W, C) over what is sure, (H, W) bool, near each pixel; NaN where there is none."""
    weight, values = sure.astype(np.float32), np.where(sure[..., None], image, 0)
    total, sums = np.zeros(sure.shape), np.zeros(image.shape)
    for radius in RADII_PX:  # together, so that the mean does not jump where a square comes to hold some
        part = (RADII_PX[0] / radius) ** NEARNESS
        total += part * box(weight, radius)
        sums += part * box(values, radius)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(total > LEAST_SURE, 1, np.nan)[..., None] * sums / total[..., None])


def _tiles(wanted: Plane, margin: int) -> list[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """List the tiles of a plane that hold wanted pixels, each with itself widened by a margin."""
    height, width = wanted.shape
    found = []
    for top in range(0, height, TILE):
        for left in range(0, width, TILE):
            own = slice(top, min(top + TILE, height)), slice(left, min(left + TILE, width))
            if wanted[own].any():
                wide = tuple(slice(max(one.start - margin, 0), min(one.stop + margin, size)) for one, size in zip(own, wanted.shape))
                found.append((own, (wide[0], wide[1])))
    return found


def _within(own: tuple[slice, slice], wide: tuple[slice, slice]) -> tuple[slice, slice]:
    """Find a tile in itself widened."""
    rows, columns = (slice(one.start - more.start, one.stop - more.start) for one, more in zip(own, wide))
    return rows, columns
