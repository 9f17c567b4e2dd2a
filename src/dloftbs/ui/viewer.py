"""One browser, served at the pace at which it paints."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Protocol


class Socket(Protocol):
    """The part of a WebSocket that a viewer uses."""

    async def send_str(self, data: str) -> None:
        """Send text."""

    async def send_bytes(self, data: bytes) -> None:
        """Send a binary message."""


class Viewer:
    """Sends text as it comes and pictures one at a time: the next one when the browser has acknowledged the last.

    Of what waits, the newest of each kind is sent and the rest is not: a slow browser sees fewer pictures, none of
    them late, and holds up nobody else. All methods belong to the event loop.

    Parameters
    ----------
    socket : Socket
    render : callable
        Makes the picture of the moment: its number and its bytes, or None where there is none.
    """

    def __init__(self, socket: Socket, render: Callable[[Viewer], Awaitable[tuple[int, bytes] | None]]) -> None:
        self._socket = socket
        self._render = render
        self._texts: dict[str, str] = {}
        self._wants_picture = False
        self._unacknowledged: int | None = None
        self._news = asyncio.Event()

    def post(self, kind: str, text: str) -> None:
        """Send a text, in the place of one of its kind that waits."""
        self._texts[kind] = text
        self._news.set()

    def refresh(self) -> None:
        """Send a picture as soon as the browser is ready for one."""
        self._wants_picture = True
        self._news.set()

    def acknowledge(self, number: int) -> bool:
        """Note that a picture was painted; False if it was not the one that is on its way."""
        if number != self._unacknowledged:
            return False
        self._unacknowledged = None
        self._news.set()
        return True

    async def run(self) -> None:
        """Send until cancelled."""
        while True:
            await self._news.wait()
            self._news.clear()
            while self._texts:
                await self._socket.send_str(self._texts.pop(next(iter(self._texts))))
            if self._wants_picture and self._unacknowledged is None:
                self._wants_picture = False
                picture = await self._render(self)
                if picture is not None:
                    self._unacknowledged, data = picture
                    await self._socket.send_bytes(data)
                if self._texts:
                    self._news.set()
