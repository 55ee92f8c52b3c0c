"""Where the page is, and who may use it: the page itself. What another page in the same browser asks is refused."""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import urlsplit

import cv2

from .._check import error, integer

Message = MutableMapping[str, Any]
Application = Callable[
    [Message, Callable[[], Awaitable[Message]], Callable[[Message], Awaitable[None]]], Awaitable[None]
]

LARGEST_UPLOAD = 200_000_000  # bytes
_AROUND = 100_000  # bytes that go with an upload


def expect_free(host: str, port: int) -> None:
    """Refuse an address at which nothing can be served."""
    integer("port", port, 1, 65535)
    try:
        with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except (OSError, ValueError, TypeError) as reason:  # of names that are none
        why = getattr(reason, "strerror", None) or reason
        raise error(f"cannot listen at {host!r}, port {port}: {why}", cv2.Error.StsError) from reason


class Guard:
    """Refuses requests by names that are not those of this machine, from pages of elsewhere, and of any size.

    A name that somebody else has let point to this machine makes their page one of the same origin in the eyes of the
    browser, which sends that name as the host. Where the explorer listens to other machines, its own names are not
    known, and any will do; a page of another origin than the one that is asked is refused there too.
    """

    def __init__(self, app: Application, host: str) -> None:
        self.app = app
        self.names = {host, "localhost", "127.0.0.1", "::1"} if _is_of_this_machine(host) else None

    async def __call__(self, scope: Message, receive: Any, send: Any) -> None:
        if scope["type"] == "websocket" and self.refusal(scope["headers"]):
            await send({"type": "websocket.close", "code": 1008})
            return
        if scope["type"] == "http" and (refusal := self.refusal(scope["headers"])):
            status, reason = refusal
            await send({"type": "http.response.start", "status": status, "headers": [(b"content-type", b"text/plain")]})
            await send({"type": "http.response.body", "body": reason.encode()})
            return
        await self.app(scope, receive, send)

    def refusal(self, headers: list[tuple[bytes, bytes]]) -> tuple[int, str] | None:
        """Why a request with these headers is refused, if it is: a status and a sentence."""
        given = {name.lower(): value.decode("latin-1") for name, value in headers}
        host = _name_in(f"//{given.get(b'host', '')}")
        if not host or (self.names is not None and host not in self.names):
            return 421, f"The explorer is at http://127.0.0.1, not at {host or 'no name'}."
        if b"origin" in given and _name_in(given[b"origin"]) != host:
            return 403, "This is for the page of the explorer alone."
        length = given.get(b"content-length", "0")
        if not length.isdecimal() or int(length[:20]) > LARGEST_UPLOAD + _AROUND:
            return 413, f"More than {LARGEST_UPLOAD} bytes."
        return None


def _name_in(address: str) -> str | None:
    """The host of an address, in lower case; None where it has none."""
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None


def _is_of_this_machine(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
