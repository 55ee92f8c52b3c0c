"""Edges in range images by scan line approximation, and what follows from them."""

from ._args import error

__version__ = "0.1.0"
__all__ = ["error"]
from ._constants import *  # noqa
from .edges import *  # noqa
