from threading import Thread
from time import monotonic, sleep

import pytest
from ui.page_client import wait_for

from dloftbs.ui.playback import Playback


def counted(playback):
    """Start a thread that counts its turns."""
    turns = []

    def run():
        while playback.wait_turn():
            turns.append(monotonic())

    thread = Thread(target=run)
    thread.start()
    return turns, thread


def test_nothing_runs_while_nobody_looks():
    playback = Playback(None, needs_viewers=True)
    turns, thread = counted(playback)
    sleep(0.03)
    assert turns == []
    playback.steer(viewers=1)
    wait_for(lambda: len(turns) > 3)
    playback.close()
    thread.join(5.0)
    assert not thread.is_alive()


def test_a_step_is_one_frame():
    playback = Playback(None, needs_viewers=False)
    playback.steer(paused=True)
    turns, thread = counted(playback)
    for count in (1, 2, 3):
        playback.steer(steps=1)
        wait_for(lambda count=count: len(turns) == count)
        sleep(0.02)
        assert len(turns) == count
    playback.steer(paused=False)
    wait_for(lambda: len(turns) > 10)
    playback.close()
    thread.join(5.0)


def test_the_pace_is_kept():
    playback = Playback(100.0, needs_viewers=False)
    turns, thread = counted(playback)
    wait_for(lambda: len(turns) >= 20)
    playback.close()
    thread.join(5.0)
    assert turns[19] - turns[0] >= 0.18


@pytest.mark.parametrize("loop", [True, False])
def test_the_end_waits_for_a_restart_or_a_loop(loop):
    playback = Playback(None, needs_viewers=False)
    playback.steer(loop=loop)
    if not loop:
        playback.restart()
        assert not playback.wait_turn()
    assert playback.wait_for_restart()
    assert playback.wait_turn()
    playback.close()
    assert not playback.wait_for_restart()
    assert playback.closed
