"""Flow control: the next picture waits for the acknowledgement of the last, and the newest wins."""

from __future__ import annotations

import asyncio

from dloftbs.ui.viewer import Viewer


class Socket:
    def __init__(self):
        self.sent = []

    async def send_str(self, data):
        self.sent.append(data)

    async def send_bytes(self, data):
        self.sent.append(data)


def run(play):
    """Play with a viewer whose pictures are numbered."""

    async def both():
        socket, made = Socket(), []

        async def render(_):
            made.append(len(made) + 1)
            return made[-1], b"%d" % made[-1]

        viewer = Viewer(socket, render)
        task = asyncio.ensure_future(viewer.run())
        await play(viewer, socket, lambda: asyncio.sleep(0.01))
        task.cancel()

    asyncio.run(both())


def test_one_picture_is_on_its_way():
    async def play(viewer, socket, pause):
        for _ in range(5):
            viewer.refresh()
            await pause()
        assert socket.sent == [b"1"]
        assert not viewer.acknowledge(7)
        await pause()
        assert socket.sent == [b"1"]
        assert viewer.acknowledge(1)
        await pause()
        assert socket.sent == [b"1", b"2"]  # one for all that was asked meanwhile
        viewer.acknowledge(2)
        await pause()
        assert socket.sent == [b"1", b"2"]

    run(play)


def test_texts_do_not_wait_for_pictures_and_the_newest_of_a_kind_is_sent():
    async def play(viewer, socket, pause):
        viewer.refresh()
        await pause()
        viewer.post("strip", "old")
        viewer.post("strip", "new")
        viewer.post("state", "state")
        await pause()
        assert socket.sent == [b"1", "new", "state"]

    run(play)


def test_a_picture_that_there_is_not_is_not_waited_for():
    async def both():
        socket, answers = Socket(), [None, (4, b"4")]

        async def render(_):
            return answers.pop(0)

        viewer = Viewer(socket, render)
        task = asyncio.ensure_future(viewer.run())
        for _ in range(2):
            viewer.refresh()
            await asyncio.sleep(0.01)
        task.cancel()
        assert socket.sent == [b"4"]

    asyncio.run(both())
