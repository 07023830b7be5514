"""Pictures and files: OpenImageIO and OpenColorIO behind checks, with nothing half-written."""

from airlight.arrays import encode, to_linear
from airlight.files.atomic import check_output, replacing
from airlight.files.decode import read_settings
from airlight.files.images import Picture, read_image, read_mask
from airlight.files.writing import write_image
from airlight.options.storage import OUTPUTS

__all__ = [
    "OUTPUTS",
    "Picture",
    "check_output",
    "encode",
    "read_image",
    "read_mask",
    "read_settings",
    "replacing",
    "to_linear",
    "write_image",
]
