"""The cameras of the images of a bag, from the CameraInfo beside their topics, which may change on the way."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Any

import numpy as np

from .messages import CAMERA, camera_of
from .source import FrameSource


@dataclass(frozen=True)
class _Known:
    """What one CameraInfo says: a camera, or why there is none."""

    time: int  # when it was recorded
    stamp: tuple[int, int]  # of its image
    geometry: dict[str, Any] = field(default_factory=dict)
    obstacle: str = ""

    @property
    def content(self) -> tuple[Any, ...]:
        values = {name: np.asarray(value).tolist() for name, value in self.geometry.items()}
        return tuple(sorted(values.items(), key=lambda item: item[0])), self.obstacle


class Cameras:
    """The cameras of a topic: of all its images, if they are the same."""

    def __init__(self, reader: Any, known: list[_Known]) -> None:
        self._reader = reader
        self._known = sorted(known, key=lambda one: one.time)
        self._same = len(list(groupby(self._known, lambda one: one.content))) < 2
        self._by_stamp = {} if self._same else {one.stamp: one for one in self._known}
        self._times = [one.time for one in self._known]

    def seen_by(self, source: FrameSource, connection: Any, time: int, data: bytes) -> FrameSource:
        """An image with its camera: that of the same stamp, else the last one before it, else the first."""
        if not self._known:
            return source
        one = self._known[0]
        if not self._same:
            one = self._known[max(0, bisect_right(self._times, time) - 1)]
            try:
                one = self._by_stamp.get(_stamp(self._reader.deserialize(data, connection.msgtype)), one)
            except Exception:  # a garbled image, which says so when it is read
                return source
        return replace(source, geometry=one.geometry, obstacle=one.obstacle)


def camera_name(topic: str) -> str:
    """The namespace of a camera: `/camera/depth` of `/camera/depth/image_raw/compressedDepth`."""
    parts = topic.removesuffix("/compressedDepth").split("/")
    return "/".join(parts[:-1])


def cameras_of(reader: Any, topic: str) -> Cameras:
    """The cameras that the CameraInfo beside a topic describes."""
    wanted = f"{camera_name(topic)}/camera_info"
    rectified = "rect" in topic.removeprefix(camera_name(topic))
    connections = [c for c in reader.connections if c.msgtype == CAMERA and c.topic == wanted]
    return Cameras(reader, list(_read(reader, connections, rectified)) if connections else [])


def _read(reader: Any, connections: list[Any], rectified: bool) -> Iterator[_Known]:
    """What the messages say, as far as the bag can be read."""
    messages = iter(reader.messages(connections))
    while True:
        try:
            connection, time, data = next(messages)
        except Exception:  # the end, or what the images come upon too
            return
        stamp = (-1, 0)
        try:
            message = reader.deserialize(data, CAMERA)
            stamp = _stamp(message)
            yield _Known(time, stamp, camera_of(message, rectified))
        except Exception as reason:
            yield _Known(time, stamp, obstacle=f"the camera in {connection.topic!r} cannot be used: {reason}")


def _stamp(message: Any) -> tuple[int, int]:
    return message.header.stamp.sec, message.header.stamp.nanosec
