"""A newcomer's way, by the commands of README: from a video to curves in ten actions or fewer."""

from __future__ import annotations

import pytest
from benchmarks.newcomer import MAX_ACTIONS, README, command_of, ids, travel


@pytest.mark.slow
def test_from_a_video_of_a_pink_cable_to_its_curves(chromium_path, tmp_path):
    journey, lines = travel(tmp_path, frames=30)
    assert len(journey.actions) <= MAX_ACTIONS
    assert len(lines) == 30
    assert ids(lines).most_common(1)[0][1] == 30
    assert (tmp_path / "overlay.mp4").stat().st_size > 1000


def test_the_pages_commands_are_those_of_readme():
    assert command_of("tune") == ["tune", "cable.mp4", "--out", "cable.yaml"]
    assert "dloftbs track cable.mp4 --config cable.yaml --out curves.jsonl --overlay overlay.mp4" in README.read_text()
