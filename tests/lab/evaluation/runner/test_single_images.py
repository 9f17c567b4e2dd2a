"""Sequences without a rate: each frame is read by a method that has seen no other."""

from __future__ import annotations

from pathlib import Path

import pytest
from lab.evaluation.runner_stubs import Bars, suite

from dloftbs_lab.evaluation.runner.run import evaluate
from dloftbs_lab.evaluation.runner.sequence_run import Method


class Counting:
    """Fails in every frame but its first one."""

    def __init__(self) -> None:
        self.frames = 0

    def __call__(self, frame: object) -> dict[int, object]:
        self.frames += 1
        if self.frames > 1:
            raise ValueError("it has a past")
        return {}


@pytest.mark.parametrize(("fps", "failures"), [(None, 0), (30.0, 2)])
def test_single_images_have_no_past(fps: float | None, failures: int, tmp_path: Path) -> None:
    (part,) = evaluate([suite(Bars(fps=fps))], [Method("counting", Counting)], tmp_path)
    assert len(part.rows) == 3
    assert sum(row.failure is not None for row in part.rows) == failures
