"""Declares the medium of a scene."""

from airlight.options.declare import RGB, Options, choice, real, rgb, switch, vector, whole

PBR = "Pharr, Jakob and Humphreys, Physically Based Rendering"


class Medium(Options, group="medium"):
    """Fill the air of a scene. Validated on construction; raises AirlightError."""

    sigma_t: RGB | None = rgb(
        None,
        "extinction: the part of the light that is lost on a metre, to absorption and scattering; unset: an optical depth of 0.5 "
        "across the scene, with fog of 3",
        PBR + ", 11.1", "1/m", ge=0, le=1e6, slider=(0, 1), log=True,
    )
    albedo: RGB = rgb((0.9, 0.9, 0.9), "the part of what is lost that is scattered, sigma_s / sigma_t", PBR + ", 11.1", ge=0, le=1)
    phase: str = choice(
        "henyey-greenstein", ("henyey-greenstein", "two-lobe", "isotropic", "rayleigh", "cornette-shanks"),
        "how scattered light spreads over directions; each integrates to 1 over the sphere",
        PBR + ", 11.3",
    )
    anisotropy: float = real(
        0.3,
        "mean cosine of the angle by which light is turned: above 0 forward",
        "Henyey and Greenstein 1941", ge=-0.99, le=0.99,
    )
    back_anisotropy: float = real(
        -0.3,
        "with phase two-lobe: anisotropy of the second lobe",
        "Henyey and Greenstein 1941", ge=-0.99, le=0.99,
    )
    back_share: float = real(0.3, "with phase two-lobe: share of the second lobe", "Henyey and Greenstein 1941", ge=0, le=1)
    ambient: RGB = rgb(
        (0.0, 0.0, 0.0),
        "radiance of light from all sides, which is scattered too",
        "Hx Volumetric Lighting", "linear", ge=0, le=1e6, slider=(0, 1),
    )
    max_distance: float | None = real(
        None,
        "how far from the eye the medium reaches; unset: four times the scene's radius",
        "Hx Volumetric Lighting", "m", gt=0, le=1e9, slider=(1, 1000), log=True,
    )
    lamp_distance: float | None = real(
        None,
        "lamps farther from the eye light no medium; unset: all do",
        "Hx Volumetric Lighting", "m", gt=0, le=1e9, slider=(1, 1000), log=True,
    )
    lamp_fade: float = real(0.2, "the last part of that distance, over which lamps fade", "Hx Volumetric Lighting", ge=0, le=1)
    sun_distance: float | None = real(
        None,
        "how far from the eye suns light the medium; unset: to its end, max-distance",
        "Hx Volumetric Lighting", "m", gt=0, le=1e9, slider=(1, 1000), log=True,
    )
    sun_glow: float = real(
        0.0,
        "artistic: share of suns' light that is scattered into a glow around them, instead of by the phase function",
        "Hx Volumetric Lighting", ge=0, le=1,
    )
    sun_glow_size: float = real(
        5.0,
        "with sun-glow: angle from a sun at which the glow has half its brightness",
        "Hx Volumetric Lighting", "degrees", gt=0, le=90, slider=(0.5, 45), log=True,
    )
    fog: str = choice(
        "none", ("none", "exponential", "linear"),
        "how the density falls with height above fog-base, below which it is 1: never; by e for every fog-depth; "
        "along a ramp as high as fog-depth, to fog-above",
        "Hx Volumetric Lighting",
    )
    fog_base: float = real(0.0, "world y up to which the density is 1", "Hx Volumetric Lighting", "m", ge=-1e9, le=1e9, slider=(-20, 20))
    fog_depth: float | None = real(
        None,
        "with fog exponential: the height over which it falls by e; linear: of the whole ramp; unset: a tenth of the scene's height",
        "Hx Volumetric Lighting", "m", gt=0, le=1e9, slider=(0.1, 100), log=True,
    )
    fog_above: float = real(0.0, "with fog linear: the density above the ramp", "Hx Volumetric Lighting", ge=0, le=1)
    air: float | None = real(
        None,
        "density of the air itself, which fog and noise multiply; unset: 1, or 0 where there are volumes or particles",
        "Airlight", ge=0, le=1e6, slider=(0, 2),
    )
    noise_amount: float = real(
        0.0,
        "how much the density varies by noise, whose mean is 1: e^(k n) of gradient noise n, over its mean",
        "Perlin 2002", ge=0, le=8,
    )
    noise_size: float | None = real(
        None,
        "size of the noise's largest features; unset: an eighth of the scene's radius",
        "Hx Volumetric Lighting", "m", gt=0, le=1e9, slider=(0.1, 100), log=True,
    )
    noise_octaves: int = whole(3, "octaves of noise, each half as large as the one before", "Perlin 1985", ge=1, le=6)
    noise_seed: int = whole(0, "which noise", "Airlight", ge=0, le=9999)
    wind: RGB = vector((0.0, 0.0, 0.0), "velocity of the noise", "Hx Volumetric Lighting", "m/s", ge=-1000, le=1000, slider=(-5, 5))
    particle_cells: int = whole(
        128, "cells along the longest side of the grid that particles are put into", "Hx Volumetric Lighting", ge=16, le=512,
        slider=(16, 256), log=True,
    )
    basin_level: float | None = real(
        None,
        "world y of a level: over ground that lies lower, seen from above, the air up to it is denser by basin-density; unset: none",
        "shadow-map article (unpublished, 2014)", "m", ge=-1e9, le=1e9, slider=(-20, 20),
    )
    basin_density: float = real(1.0, "density that is added there", "shadow-map article (unpublished, 2014)", ge=0, le=1e6, slider=(0, 4))
    sun_extinction: str | None = choice(
        None, ("none", "volumes", "all"),
        "what dims a sun's light on its own way to a place: nothing; volumes and particles alone; all of the medium. Unset: all, but where "
        "the air has no end above, as without fog or with fog-above, volumes alone",
        "Airlight",
    )
    transparency: str = choice(
        "layers", ("none", "dither", "layers"),
        "how the medium is seen before and behind what one sees through: none: as before what is behind it; dither: pixels of it, by its "
        "alpha, are drawn as solid: right on the mean over several samples a pixel; layers: exactly",
        "Hx Volumetric Lighting",
    )
    extinction: bool = switch(True, "whether surfaces are seen dimmed through the medium", "Airlight")
    extinction_share: float = real(
        1.0,
        "artistic: with extinction, the share of that dimming; what the medium scatters stays as it is",
        "Hx Volumetric Lighting", ge=0, le=1,
    )
