"""Edges of many range images, from Python as from the command line."""

from .app.batch import BatchItem, detectBatch

__all__ = ["BatchItem", "detectBatch"]
