"""Bags of ROS 1 and 2, and MCAP files, read by `rosbags`, without ROS."""

from __future__ import annotations

import functools
import threading
import weakref
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from .._check import error
from ..io import RangeImage
from .bag_cameras import camera_name, cameras_of
from .messages import CLOUD, COMPRESSED, IMAGE, range_image_of
from .source import FrameSource, Unreadable, extra, failures_named, kept


def is_bag(path: Path) -> bool:
    """Whether it is a bag of ROS 1, the folder of one of ROS 2, or an MCAP file."""
    return path.suffix.lower() in (".bag", ".mcap") or (path / "metadata.yaml").is_file()


def bag_frames(path: str, topics: tuple[str, ...] = ()) -> list[FrameSource]:
    """The depth images and organized clouds of a bag in the order of their times, with the camera of each topic.

    Without `topics`, every topic that holds some is taken, but of a picture that was recorded in several forms only
    one, depth before cloud: two topics of one camera are the same frames twice.
    """
    with _failures_named(path):
        bag = _opened(path)
        reader = bag.reader
        found = [c for c in reader.connections if c.msgtype in (IMAGE, COMPRESSED, CLOUD)]
        chosen = [c for c in found if c.topic in topics] if topics else _depths(reader, found)
        missing = set(topics) - {c.topic for c in chosen}
        if missing or not chosen:
            have = ", ".join(sorted({c.topic for c in found})) or "none"
            wanted = f"no topic {', '.join(sorted(missing))}" if missing else "no depth images or organized clouds"
            raise error(f"{path!r} has {wanted}; topics of images and clouds: {have}")
        cameras = {c.topic: cameras_of(reader, c.topic) for c in chosen if c.msgtype != CLOUD}
        seen: dict[tuple[str, int], int] = {}
        frames: list[FrameSource] = []
        for connection, time, data in _listed(path, reader, chosen, frames):
            topic = connection.topic
            repeat = seen[topic, time] = seen.get((topic, time), -1) + 1
            mark = f"{time}_{repeat}" if repeat else f"{time}"
            name = f"{Path(path).stem}/{topic.strip('/')}/{mark}"
            load = functools.partial(_frame, path, topic, time, repeat)
            source = FrameSource(name, path, f"{topic} at {mark}", load)
            frames.append(cameras[topic].seen_by(source, connection, time, data) if topic in cameras else source)
        return frames


def _listed(path: str, reader: Any, chosen: list[Any], frames: list[FrameSource]) -> Iterator[tuple[Any, int, bytes]]:
    """Topic, time and content of every message; where the bag ends before its end, a frame that says so comes last."""
    try:
        with _failures_named(path):
            yield from reader.messages(chosen)
    except error as problem:
        frames.append(FrameSource(f"{Path(path).stem}/end", path, "the end", Unreadable(problem.err)))


def _failures_named(path: str) -> AbstractContextManager[None]:
    return failures_named(repr(path), lambda reason: "; run `rosbag reindex`" if "index" in str(reason).lower() else "")


class _Bag:
    """An open bag, which is closed when nobody holds it any more; its readers seek, and so threads take turns."""

    def __init__(self, reader: Any) -> None:
        self.reader = reader
        self.turn = threading.Lock()
        weakref.finalize(self, reader.close)


@kept(2)
def _opened(path: str) -> _Bag:
    highlevel = extra("rosbags.highlevel", "bags", f"{path!r}")
    stores = extra("rosbags.typesys", "bags", f"{path!r}")
    reader = highlevel.AnyReader([Path(path)], default_typestore=stores.get_typestore(stores.Stores.ROS2_HUMBLE))
    reader.open()
    return _Bag(reader)


def _depths(reader: Any, connections: list[Any]) -> list[Any]:
    """The connections that hold depths, as their first messages tell; one a camera."""
    usable = []
    for connection in connections:
        kind, messages = connection.msgtype, reader.messages([connection])
        if any(_is_depth(reader.deserialize(data, kind)) for _, (*_, data) in zip(_LOOKED_AT, messages, strict=False)):
            usable.append(connection)
    usable.sort(key=lambda c: (_FORMS.index(c.msgtype), c.topic))
    best: dict[str, Any] = {}
    for connection in usable:
        best.setdefault(camera_name(connection.topic), connection)
    return [c for c in usable if best[camera_name(c.topic)].topic == c.topic]


def _is_depth(message: Any) -> bool:
    """Whether it is no picture in colours or of infrared light, and no cloud without rows."""
    if getattr(message, "encoding", None) == "mono16":
        return False
    try:
        range_image_of(message)
    except ValueError:
        return False
    return True


_LOOKED_AT = range(3)  # first messages of a topic, one of which may be garbled
_FORMS = (IMAGE, COMPRESSED, CLOUD)


def _frame(path: str, topic: str, time: int, repeat: int) -> RangeImage:
    """The message of a topic at a time, or that many after it at the same time."""
    with _failures_named(path):
        bag = _opened(path)
        reader = bag.reader
        chosen = [c for c in reader.connections if c.topic == topic]
        with bag.turn:
            messages = reader.messages(chosen, start=time, stop=time + 1)
            connection, _, data = [message for _, message in zip(range(repeat + 1), messages, strict=False)][repeat]
        return range_image_of(reader.deserialize(data, connection.msgtype))
