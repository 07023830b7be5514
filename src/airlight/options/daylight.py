"""Declares daylight: the air, the sun's place, and what a picture or a scene alone needs to have it."""

from typing import Literal

from airlight.options.declare import RGB, Options, choice, real, rgb, text

ANY = r"^[^\r\n]{1,200}$"  # read, and refused in words, by what makes use of it
CLEAR = "Bruneton and Neyret 2008; Hillaire 2020"
PRINTED = "Hoffman and Preetham 2002"
SUN = "Reda and Andreas 2004"


class Daylight(Options, group="daylight"):
    """Describe the air and the sun of a picture or a scene. Validated on construction; raises AirlightError."""

    daylight: str = choice(
        "none", ("none", "air", "hoffman-preetham"),
        "what daylight is computed by: none; a round atmosphere of Rayleigh's air, an aerosol and ozone; even air by Eq. 1 as printed. "
        "It needs a sun",
        "GPU Gems 3, ch. 13, Eq. 1; " + CLEAR,
    )
    when: str | None = text(
        None, ANY,
        "date and time of the sun, with a zone, as 2026-06-21T19:30+02:00 or with Z; exif: those of the photograph. Needs where",
        SUN, words=("exif",), form="TIME|exif",
    )
    where: str | None = text(
        None, ANY,
        "place of the eye, latitude and longitude in degrees, and metres above the sea: 47.42,10.98,2962; exif: that of the photograph",
        SUN, words=("exif",), form="LAT,LON[,ALT]|exif",
    )
    altitude: float | None = real(
        None, "height of the eye, of y = 0 in a scene, above the sea; unset: that of where, else 2", CLEAR, "m", ge=0, le=1e5,
        slider=(0, 5000),
    )
    visibility: float | None = real(
        None,
        "distance at which a contrast of 2 % is left, by an aerosol that is grey; unset: very clear air, of some 217. Not with turbidity",
        "Koschmieder 1924", "km", ge=0.05, le=280, log=True, beyond="; clean air has 289 km",
    )
    turbidity: float | None = real(
        None, "how hazy the air is, instead of visibility: 2 clear, 10 very hazy", "Preetham et al. 1999", ge=1, le=10
    )
    aerosol_albedo: float = real(0.9, "the part of what the aerosol takes that it scatters", CLEAR, ge=0, le=1)
    aerosol_anisotropy: float = real(
        0.8, "mean cosine by which the aerosol turns light, roughly: g of its phase function", "Cornette and Shanks 1992",
        ge=-0.99, le=0.99,
    )
    ozone: float = real(300.0, "ozone: blue of the dusk", CLEAR, "DU", ge=0, le=600)
    ground_albedo: RGB = rgb((0.3, 0.3, 0.3), "the part of the light that the ground below returns", CLEAR, ge=0, le=1)
    sun_strength: float | None = real(
        None,
        "irradiance by the sun above the air; unset: in a picture by its own sky, or so that white that faces the sun is 1, in a scene the "
        "sun's lux",
        "Airlight", "linear", ge=0, le=1e9, slider=(0, 10),
    )
    wavelengths: str = choice(
        "4", ("4", "rgb"),
        "wavelengths that are computed: four, of which colours are made; three taken for red, green and blue, as most do",
        "Airlight; " + CLEAR,
    )
    multiple: str = choice(
        "orders", ("orders", "psi", "none"),
        "light scattered more than once: order by order; as if evenly to all sides; none", "Airlight; Hillaire 2020",
    )
    beta_rayleigh: RGB = rgb(
        (6.953e-6, 11.757e-6, 24.380e-6), "with hoffman-preetham: what the air scatters on a metre", PRINTED, "1/m", ge=0, le=1,
        slider=(0, 1e-3),
    )
    beta_mie: RGB = rgb(
        (2e-5, 3e-5, 4e-5), "with hoffman-preetham: what haze scatters on a metre; light haze unless given", PRINTED, "1/m", ge=0, le=1,
        slider=(0, 1e-2),
    )
    attenuate: str | None = choice(
        None, ("source", "all"),
        "what shafts take away: the sun's light that is scattered once; all light of the pixel, as Eq. 2 is printed. Unset: source, with "
        "hoffman-preetham all",
        "GPU Gems 3, ch. 13, Eq. 2",
    )
    sky: str | None = choice(
        None, ("keep", "air", "replace"),
        "what is done where there is sky: its own light stays, and shafts are missing in it; the air's light is added to it; it is drawn "
        "anew. Unset: keep, in scenes replace",
        "Airlight",
    )


class DaylightPicture(Options, group="daylight"):
    """Place sun, camera and depths of a picture. Validated on construction; raises AirlightError."""

    sun: str | None = text(
        None, ANY, "the sun's azimuth, clockwise from north, and its elevation, in degrees: 240,12. Not with when", "Airlight",
        form="AZ,EL",
    )
    sun_elevation: float | None = real(
        None, "the sun's elevation, its azimuth being that of light", "Airlight", "degrees", ge=-18, le=90, slider=(-10, 90)
    )
    fov: float | Literal["exif"] | None = real(
        None, "angle of view of the picture's smaller side; exif: by the lens's focal length", "Airlight", "degrees", ge=1, le=170,
        words=("exif",),
    )
    pitch: float | None = real(
        None, "how far the camera looks up; unset: as light and sun have it, else 0", "Airlight", "degrees", ge=-90, le=90
    )
    roll: float = real(0.0, "how far the camera is turned clockwise", "Airlight", "degrees", ge=-180, le=180)
    heading: float | None = real(
        None, "azimuth of the picture's middle, clockwise from north; unset: as light and sun have it", "Airlight", "degrees", ge=-360,
        le=360,
    )
    depth_unit: float = real(1.0, "metres of a unit of depths in floats", "Airlight", "m", gt=0, le=1e6, slider=(0.01, 1000), log=True)
    depth_range: str | None = text(
        None, ANY,
        "metres from the eye that the nearest and the farthest value of a map of depths stand for: 2,5000", "Airlight", form="NEAR,FAR",
    )
    depth_kind: str = choice(
        "z", ("z", "ray", "inverse"), "what depths are: along the view's axis; along each ray; 1 / z, larger being nearer", "Airlight"
    )
    distance: float | None = real(
        None, "distance of all that is not sky, where there is no map of depths", "Airlight", "m", gt=0, le=1e7, slider=(10, 1e5), log=True
    )


class DaylightScene(Options, group="daylight"):
    """Let the sun of a scene run through a day. Validated on construction; raises AirlightError."""

    day: str | None = text(
        None, ANY, "a date, as 2026-06-21: the frames run from sunrise to sunset at where, or between the times of from and to",
        SUN, form="DATE",
    )
    north: float = real(0.0, "azimuth of north: 0 at -Z, 90 at +X", "Airlight", "degrees", ge=-360, le=360)


OF_DAYLIGHT = frozenset(one.name for group in (Daylight, DaylightPicture, DaylightScene) for one in group.options())
OF_PICTURE = frozenset(DaylightPicture.__struct_fields__)  # some have a name that is another option's of scenes
