"""Stacks in NPZ files, a frame at a time: memory holds no more of them, however large they are."""

from __future__ import annotations

import math
import threading
import zipfile

import numpy as np

from ..io.arrays import read_header, read_npy, source_of
from ..io.source import expect_size, opened
from .source import kept

_AT_A_TIME = 2**22  # bytes


class NpzStack:
    """The array of an NPZ file, whose frames are unpacked when they are asked for, at the least cost in their order."""

    def __init__(self, path: str) -> None:
        with opened(path, math.inf) as (_, size):
            archive = zipfile.ZipFile(path)
            member, self.geometry = source_of(archive, size)
            self._stream = archive.open(member)
            self.shape, self._fortran, self.dtype = read_header(self._stream)
            self._first = self._stream.tell()
        self._path = path
        self._turn = threading.Lock()
        self._whole: np.ndarray | None = None

    def check(self) -> None:
        """Unpack all of it once, since only its end tells whether it is whole."""
        with opened(self._path, math.inf), self._turn:
            unpacked = 0
            self._stream.seek(self._first)
            while piece := self._stream.read(_AT_A_TIME):
                unpacked += len(piece)
            expect_size(unpacked, math.prod(self.shape) * self.dtype.itemsize)

    def frame(self, index: int) -> np.ndarray:
        shape = self.shape[1:]
        size = math.prod(shape) * self.dtype.itemsize
        with self._turn:
            if self._fortran:  # every frame is spread over all of it
                if self._whole is None:
                    self._stream.seek(0)
                    self._whole = read_npy(self._stream.read())
                return self._whole[index]
            self._stream.seek(self._first + index * size)
            data = self._stream.read(size)
        return np.frombuffer(data, self.dtype).reshape(shape)


@kept(4)
def npz_stack(path: str) -> NpzStack:
    """That of a file, open as long as it is among the last ones."""
    return NpzStack(path)
