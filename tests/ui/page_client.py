"""A browser's side of the protocol, without a browser; and small sources."""

from __future__ import annotations

import asyncio
import json
import time
from contextlib import contextmanager

import aiohttp
import numpy as np
from drawings import draw_cable, wave

from dloftbs.data.frame import Frame
from dloftbs.sources.source import Source

SIZE = (120, 200)
ORANGE = (30, 120, 230)  # BGR; hue 12 or so
GROUND = (90, 120, 90)
TIMEOUT_S = 15.0


def cable_mask(shift=0.0, size=SIZE):
    return draw_cable(wave(size, 1.0, shift), 7, size) > 0


def cable_image(shift=0.0, size=SIZE, colour=ORANGE):
    image = np.full((*size, 3), GROUND, np.uint8)
    image[cable_mask(shift, size)] = colour
    noise = np.random.default_rng(int(1000 * shift)).integers(-4, 5, image.shape)
    return np.clip(image + noise, 0, 255).astype(np.uint8)


def wait_for(condition):
    """Wait until a condition holds."""
    end = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.002)


class CableSource(Source):
    """A moving cable, as a recording or as a camera."""

    def __init__(self, count=12, *, live=False, known_length=True, size=SIZE, depth=None):
        self.name, self.fps, self.live = "cable.mp4", 30.0, live
        self.length = count if known_length and not live else None
        self.count, self.size, self.depth = count, size, depth
        self.passes = 0

    def __iter__(self):
        self._begin()
        self.passes += 1
        for index in range(self.count):
            if self._closed:
                return
            yield self.frame(index)

    def frame(self, index):
        image = cable_image(0.03 * (index % 20), self.size)
        return Frame(image=image, depth=self.depth, index=index, name=f"cable#{index}")


class Client:
    """A connection to a session; pictures are acknowledged by hand."""

    def __init__(self, address):
        self.url = address.url
        self.loop = asyncio.new_event_loop()
        self.kept = []
        self._run(self._open(self.url + "socket"))

    def _run(self, work):
        return self.loop.run_until_complete(asyncio.wait_for(work, TIMEOUT_S))

    async def _open(self, url):
        self.session = aiohttp.ClientSession()
        self.socket = await self.session.ws_connect(url)

    def send(self, **message):
        self.send_text(json.dumps(message))

    def send_text(self, text):
        self._run(self.socket.send_str(text))

    def receive(self, timeout_s=TIMEOUT_S):
        """Return the next message: a text as a dictionary, a picture as (header, parts); None where none comes."""
        try:
            message = self.loop.run_until_complete(asyncio.wait_for(self.socket.receive(), timeout_s))
        except asyncio.TimeoutError:
            return None
        if message.type == aiohttp.WSMsgType.BINARY:
            return split_picture(message.data)
        return json.loads(message.data) if message.type == aiohttp.WSMsgType.TEXT else None

    def text(self, kind, when=lambda message: True):
        """Return the next text of a kind that is as wanted; pictures meanwhile are kept."""
        return self._next(lambda one: isinstance(one, dict) and one["type"] == kind and when(one), f"no {kind}", dict)

    def picture(self, when=lambda header: True, *, ack=True):
        """Return the next picture that is as wanted; those before it are acknowledged, texts meanwhile are kept."""

        def wanted(one):
            if not isinstance(one, tuple):
                return False
            found = when(one[0])
            if ack or not found:
                self.send(type="ack", number=one[0]["number"])
            return found

        return self._next(wanted, "no picture", tuple)

    def drain(self, silence_s=0.3):
        """Acknowledge all that was on its way, until nothing more comes."""
        kept, self.kept = self.kept, []
        while (one := kept.pop(0) if kept else self.receive(silence_s)) is not None:
            if isinstance(one, tuple):
                self.send(type="ack", number=one[0]["number"])

    def _next(self, wanted, otherwise, kind):
        kept, self.kept = self.kept, []
        while kept:
            one = kept.pop(0)
            if wanted(one):
                self.kept += kept
                return one
            if not isinstance(one, kind):
                self.kept.append(one)
        while (one := self.receive()) is not None:
            if wanted(one):
                return one
            if not isinstance(one, kind):
                self.kept.append(one)
        raise AssertionError(otherwise)

    def close(self):
        async def end():
            await self.socket.close()
            await self.session.close()

        self._run(end())
        self.loop.close()


@contextmanager
def connected(address):
    client = Client(address)
    try:
        yield client
    finally:
        client.close()


def split_picture(data):
    length = int.from_bytes(data[:4], "little")
    header = json.loads(data[4 : 4 + length])
    parts, at = {}, 4 + length
    for name, size in header["parts"]:
        parts[name] = data[at : at + size]
        at += size
    assert at == len(data)
    return header, parts


def mask_of(parts, size=SIZE):
    runs = np.frombuffer(parts["mask"], "<u4")
    values = np.arange(len(runs)) % 2
    return np.repeat(values, runs).reshape(size) > 0


def get(url, **headers):
    """Return the status, the headers and the text of an answer."""

    async def ask():
        async with aiohttp.ClientSession() as session, session.get(url, headers=headers) as answer:
            return answer.status, dict(answer.headers), await answer.text()

    return asyncio.run(ask())
