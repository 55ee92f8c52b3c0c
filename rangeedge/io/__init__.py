"""Range images and their geometry from and to files, one family of formats a module."""

from .range_image import RangeImage, imreadRange, imwriteRange

__all__ = ["RangeImage", "imreadRange", "imwriteRange"]
