"""The firmware's image in an installed package: put there by the release (tools/wheels.py), absent in a checkout, which
builds its own."""

from bifa.firmware.image import FOLDER, Image, ImageError, carried_image, carried_path, image_of, write_image

__all__ = ["FOLDER", "Image", "ImageError", "carried_image", "carried_path", "image_of", "write_image"]
