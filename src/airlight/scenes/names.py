"""Name the scenes that come with Airlight, and tell scenes from pictures."""

NAMES = ("table", "flying", "valley", "chapel", "matinee")
SUNLESS = ("table", "matinee")  # of these, which have no sun of their own
VALIDATION = {  # scattering in the world is validated on: the file of each, and its camera
    "slats": ("slats", "room"),
    "foliage-view": ("foliage", "view"),
    "foliage-beside": ("foliage", "beside"),
    "foliage-behind": ("foliage", "behind"),
    "cage": ("cage", "room"),
    "two-spots": ("two-spots", "front"),
    "window": ("window", "corner"),
    "headlamp": ("headlamp", "eye"),
    "dense": ("dense", "front"),
    "mirrored": ("mirrored", "front"),
    "mist-sun": ("foliage", "beside"),
    "mist-lamp": ("cage", "room"),
    "ramp-sun": ("foliage", "behind"),
    "ramp-spots": ("two-spots", "front"),
    "smoke-sun": ("window", "corner"),
    "smoke-spot": ("slats", "room"),
    "in-smoke": ("dense", "front"),
    "drift": ("two-spots", "front"),
    "puffs": ("cage", "room"),
    "panes": ("panes", "hall"),
    "stained": ("stained", "nave"),
    "slide": ("slats", "room"),
    "gobo": ("two-spots", "front"),
    "leaves": ("window", "corner"),
    "clipped": ("mirrored", "front"),
    "street": ("headlamp", "eye"),
    "flood": ("dense", "front"),
    "pendant": ("panes", "hall"),
    "smoke-slide": ("slats", "room"),
}
MESHES = (".obj", ".ply", ".stl")  # which have no cameras, no lights, and do not say what is up
FILES = (".glb", ".gltf", *MESHES)
A_FILE = "a .glb, .gltf, .obj, .ply or .stl file"


def is_picture(path: str) -> bool:
    """Tell whether a file is there that begins as a picture does."""
    from airlight.errors import AirlightError
    from airlight.files.decode import format_of

    try:
        return bool(format_of(path))
    except AirlightError:
        return False


def is_scene(source: str) -> bool:
    """Tell a scene, by its name or its file's, from a picture."""
    return source in (*NAMES, *VALIDATION) or source.lower().endswith(FILES)
