"""The tags of a TIFF or BigTIFF file: where its pages are, and what is said of each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .source import expect_at_least

_TYPES = {
    **{1: "u1", 2: "S1", 3: "u2", 4: "u4", 6: "i1", 7: "u1", 8: "i2", 9: "i4", 11: "f4", 12: "f8", 13: "u4"},
    **{16: "u8", 17: "i8", 18: "u8"},
}
PAGES = 4096  # of an image of its own; more than that are not counted

NEW_SUBFILE_TYPE = 254
WIDTH = 256
LENGTH = 257
BITS_PER_SAMPLE = 258
COMPRESSION = 259
PHOTOMETRIC = 262
FILL_ORDER = 266
STRIP_OFFSETS = 273
SAMPLES_PER_PIXEL = 277
ROWS_PER_STRIP = 278
STRIP_BYTE_COUNTS = 279
PLANAR_CONFIGURATION = 284
SOFTWARE = 305
PREDICTOR = 317
TILE_WIDTH = 322
TILE_LENGTH = 323
TILE_OFFSETS = 324
TILE_BYTE_COUNTS = 325
EXTRA_SAMPLES = 338
SAMPLE_FORMAT = 339
MODEL_PIXEL_SCALE = 33550
MODEL_TIE_POINT = 33922
MODEL_TRANSFORMATION = 34264
GEO_KEYS = 34735
GEO_REALS = 34736
GEO_TEXTS = 34737
GDAL_METADATA = 42112
GDAL_NODATA = 42113


class Page:
    """One image of the file, by its tags."""

    def __init__(self, data: bytes, order: str, entries: np.ndarray, first_entry: int) -> None:
        self.data, self.order, self._first = data, order, first_entry
        self._entries = entries

    def _place(self, code: int) -> int | None:
        """Which entry is that of a tag; the last one, if there are several."""
        found = np.flatnonzero(self._entries["code"] == code)
        return int(found[-1]) if len(found) else None

    def __contains__(self, code: int) -> bool:
        return self._place(code) is not None

    def values(self, code: int, default: tuple[int, ...] = ()) -> np.ndarray:
        """All values of a tag."""
        place = self._place(code)
        if place is None:
            return np.array(default, dtype=np.int64)
        entry = self._entries[place]
        kind, count = int(entry["kind"]), int(entry["count"])
        if kind not in _TYPES:
            raise ValueError(f"its tag {code} has the unknown type {kind}")
        dtype = np.dtype(self.order + _TYPES[kind])
        start = self._first + place * self._entries.dtype.itemsize
        start += self._entries.dtype.fields["value"][1]  # type: ignore[index]
        if count * dtype.itemsize > self._entries.dtype["value"].itemsize:
            start = int(entry["value"])
        expect_at_least(len(self.data), start + count * dtype.itemsize)
        return np.frombuffer(self.data, dtype, count, start)

    def value(self, code: int, default: int | None = None) -> int:
        """The only or first value of a tag."""
        values = self.values(code, () if default is None else (default,))
        if not len(values):
            raise ValueError(f"it has no tag {code}")
        return int(values[0])

    def text(self, code: int) -> str:
        return self.values(code).tobytes().split(b"\0")[0].decode("latin-1").strip()


def pages(data: bytes, limit: int = PAGES) -> Iterator[Page]:
    """The pages of the main chain, in the order of the file."""
    order = "<" if data[:2] == b"II" else ">"
    version = int(np.frombuffer(data, order + "u2", 1, 2)[0])
    big = version == 43
    offset, count = (f"{order}u8", f"{order}u8") if big else (f"{order}u4", f"{order}u2")
    layout = np.dtype([("code", order + "u2"), ("kind", order + "u2"), ("count", offset), ("value", offset)])

    def integer(kind: str, at: int) -> int:
        expect_at_least(len(data), at + np.dtype(kind).itemsize)
        return int(np.frombuffer(data, kind, 1, at)[0])

    at = integer(offset, 8 if big else 4)
    seen: set[int] = set()
    read = 0  # bytes of the entries of all pages
    while at and len(seen) < limit:
        if at in seen:
            raise ValueError("its pages form a circle")
        seen.add(at)
        entries = integer(count, at)
        first = at + np.dtype(count).itemsize
        end = first + entries * layout.itemsize
        expect_at_least(len(data), end)
        read += end - at
        if read > len(data):
            raise ValueError("its pages overlap")
        yield Page(data, order, np.frombuffer(data, layout, entries, first), first)
        # Some writers leave out what would point to nothing.
        at = integer(offset, end) if end + np.dtype(offset).itemsize <= len(data) else 0
