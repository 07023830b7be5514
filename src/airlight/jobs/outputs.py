"""Says where pictures are written: their names in folders, folders that are made, and what an output holds."""

import contextlib
import glob
import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from airlight.errors import AirlightError
from airlight.messages import counted, nearest_file, say
from airlight.options.storage import OUTPUTS
from airlight.process import standard, temporaries
from airlight.scenes.names import is_scene

if TYPE_CHECKING:
    import numpy as np

    from airlight.files import Picture

HOLDS_ALL = "png"  # the format that is written where the input's own cannot be, as HEIC or RAW


def expanded(sources: Sequence[str]) -> list[str]:
    """Put a folder's pictures in its place, and tell what is left out of it, and what looks like a clip."""
    found: list[str] = []
    for source in sources:
        if not standard.is_folder(source):
            _refuse_what_is_no_picture(source)
            if not (os.path.splitext(source)[1] or os.path.lexists(source) or standard.is_input(source)):
                raise AirlightError(f"{source}: there is no such folder or picture{nearest_file(source)}")
            found.append(source)
            continue
        from airlight.files.folder import clip_of, pictures_in

        pictures, files, folders = pictures_in(source)
        found += pictures
        kinds = (files, "file that is no picture", "files that are no pictures"), (folders, "folder", "folders")
        out = [counted(*kind) for kind in kinds if kind[0]]
        if out:
            say(f"{source}: left out: {', '.join(out)}", prefix="")
        clip = clip_of(pictures)
        if clip is not None:
            pattern = f"{clip.before}{clip.written}{clip.after}"
            say(f'{source}: pictures, each with a light of its own; if they are frames of one clip, give "{pattern}"', prefix="")
    return found


def _refuse_what_is_no_picture(source: str) -> None:
    """Raise AirlightError for a scene, and for a pattern of the shell's that stands for nothing, or came in quotes."""
    from airlight.files.sequence import numbered

    if is_scene(source) and (os.path.splitext(source)[1] or not os.path.lexists(source)):
        raise AirlightError(f"{source}: is a 3-D scene, which airlight render draws")
    if glob.has_magic(source) and not os.path.lexists(source) and numbered(source) is None:
        there = len(glob.glob(source))
        cure = f"stands for {counted(there, 'file')}: leave its quotes out" if there else "stands for no file: nothing has such a name"
        raise AirlightError(f"{source}: {cure}")


def named_in(folder: str, source: str, format: str | None) -> str:
    """Name the output of a picture in a folder: as the input, with the ending of `format`, or of PNG where its own cannot be written."""
    name = os.path.basename(source)
    root, extension = os.path.splitext(name)
    if format is not None:
        return os.path.join(folder, f"{root}.{format}")
    return os.path.join(folder, name if extension.lower() in OUTPUTS else f"{root}.{HOLDS_ALL}")


def to_stdout(source: str, format: str | None) -> str:
    """Write `-` with an ending, by which formats are told: that of `format`, or of the input's own by its bytes, or of PNG."""
    from airlight.files.decode import format_of

    kind = format_of(source) if format is None else ""
    own = next((extension for extension, (name, _) in OUTPUTS.items() if name == kind), f".{HOLDS_ALL}")
    return standard.NAME + (own if format is None else f".{format}")


def is_folder(target: str, of_folder: bool) -> bool:
    """Tell whether an output names a folder. of_folder: whether a folder is read, so that one not there yet may be meant."""
    if standard.is_output(target):
        return False
    if os.path.isdir(target) or target.endswith(("/", os.sep)):
        return True
    return of_folder and os.path.splitext(target)[1].lower() not in OUTPUTS and not os.path.lexists(target)


def beside(folder: str, source: str) -> str:
    """Find the picture in a folder that has the name of another one, whatever its ending: its mask or depths. Raises AirlightError."""
    root = os.path.splitext(os.path.basename(source))[0]
    found = sorted(name for name in os.listdir(folder) if os.path.splitext(name)[0] == root)
    if len(found) != 1:
        there = f"{' and '.join(found[:2])} both have" if found else "nothing in it has"
        raise AirlightError(f"{folder}: {there} the name of {os.path.basename(source)}; give one picture of that name, whatever its ending")
    return os.path.join(folder, found[0])


@contextlib.contextmanager
def making(targets: Sequence[str | None], wanted: bool) -> Iterator[None]:
    """Make the folders of some outputs that are not there yet; those that are empty at the block's end go. wanted: else do nothing."""
    missing = dict.fromkeys(target for target in targets if target is not None and wanted and is_folder(target, True))
    made: list[str] = []
    try:
        for folder in missing:
            if not os.path.isdir(folder):
                temporaries.announce(folder)
                made.append(folder)
                try:
                    os.mkdir(folder)
                except OSError as error:
                    made.remove(folder)
                    raise AirlightError(f"{folder}: the folder cannot be made ({error.strerror}); choose another") from None
        yield
    finally:
        for folder in made:
            with contextlib.suppress(OSError):
                os.rmdir(folder)


def is_float(path: str, picture: "Picture") -> bool:
    """Tell whether the output holds more light than white: EXR, HDR, a TIFF made from floats, a DPX of film's codes."""
    from airlight.files.dpx import is_log_output

    if is_log_output(path, picture):
        return True
    return path.lower().endswith((".exr", ".hdr")) or (path.lower().endswith((".tif", ".tiff")) and picture.bits == 32)


def write_data(path: str, values: "np.ndarray", overwrite: bool, settings: str) -> None:
    """Write numbers 0..1 as grey, code = value, with no transfer curve: as --mask reads them."""
    import numpy as np

    from airlight import files

    grey = np.repeat(np.clip(values, 0, 1)[..., None], 3, axis=2).astype(np.float32)
    codes = np.rint(grey * 65535).astype(np.uint16) if path.lower().endswith(".dpx") else np.rint(grey * 255).astype(np.uint8)
    files.write_image(path, grey, encoded=codes, overwrite=overwrite, settings=settings)
