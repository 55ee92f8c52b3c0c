"""Many frames, from Python as from the command line: recordings, archives, clusters."""

from .app.batch import detectBatch, runBatch
from .app.blocks import runBlocks
from .app.run import BatchItem
from .frames import eachFrame
from .recording import FrameSource, framesOf

__all__ = ["BatchItem", "FrameSource", "detectBatch", "eachFrame", "framesOf", "runBatch", "runBlocks"]
