"""Lights: of pictures in `image`, of media in `punctual`, a file a kind, with their table in `kinds`."""

from airlight.lights.image import IMAGE_LIGHT_KINDS, ImageLight, as_lights, parse_position

Light = ImageLight  # its public name, airlight.Light

__all__ = ["IMAGE_LIGHT_KINDS", "ImageLight", "Light", "as_lights", "parse_position"]
