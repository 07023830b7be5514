"""Lights: of pictures in `image`, of media in `punctual`, a file a kind, with their table in `kinds`."""

from airlight.lights.image import KINDS, ImageLight, as_lights, parse_position

Light = ImageLight

__all__ = ["KINDS", "ImageLight", "Light", "as_lights", "parse_position"]
