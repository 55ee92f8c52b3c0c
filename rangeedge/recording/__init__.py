"""Recordings as frames: image sequences, stacks, bags of ROS; who works on them, and where the results go."""

from .listing import framesOf
from .source import FrameSource

__all__ = ["FrameSource", "framesOf"]
