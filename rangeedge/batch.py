"""Many frames, from Python as from the command line: recordings, archives, clusters."""

from .app.batch import BatchItem, detectBatch, runBatch
from .frames import eachFrame
from .recording import FrameSource, framesOf

__all__ = ["BatchItem", "FrameSource", "detectBatch", "eachFrame", "framesOf", "runBatch"]
