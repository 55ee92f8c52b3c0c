"""Range images and their geometry from and to files, one family of formats a module."""

from .files import imreadRange, imwriteRange
from .range_image import RangeImage

__all__ = ["RangeImage", "imreadRange", "imwriteRange"]
