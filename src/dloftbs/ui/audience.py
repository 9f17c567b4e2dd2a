"""The browsers that watch a session, told of news from any thread."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

from dloftbs.ui.viewer import Viewer
from dloftbs.ui.wire import encode_text


class Audience:
    """Viewers of one session.

    Any thread may call `tell` and `refresh` and look who is there; the rest is for the event loop's.
    """

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._viewers: set[Viewer] = set()

    def open(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to pass news on, in a loop."""
        self._loop = loop

    def close(self) -> None:
        """Pass nothing on any more."""
        self._loop = None

    def __len__(self) -> int:
        return len(self._viewers)

    def __iter__(self) -> Iterator[Viewer]:
        return iter(tuple(self._viewers))

    def add(self, viewer: Viewer) -> None:
        """Take a viewer in."""
        self._viewers.add(viewer)

    def remove(self, viewer: Viewer) -> None:
        """Forget a viewer."""
        self._viewers.discard(viewer)

    def tell(self, kind: str, /, **fields: Any) -> None:
        """Send a text to all."""
        text = encode_text(kind, **fields)
        self._soon(lambda viewer: viewer.post(kind, text))

    def refresh(self) -> None:
        """Let all ask for a picture."""
        self._soon(lambda viewer: viewer.refresh())

    def _soon(self, action: Any) -> None:
        def act() -> None:
            for viewer in self._viewers:
                action(viewer)

        loop = self._loop
        if loop is None:
            return
        try:
            loop.call_soon_threadsafe(act)
        except RuntimeError:  # the server is just ending
            return
