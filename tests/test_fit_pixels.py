"""The fit of what an image says about gaps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from benchmarks import fit_pixels
from benchmarks.fit_linking.scenes import Scene
from benchmarks.fit_pixels import SeenGap, list_seen_gaps
from benchmarks.pictured_gaps import ENDS, KINDS, list_gaps

from dloftbs.linking.kernels.pixel_weights import PIXELS


@pytest.fixture
def grounds(tmp_path: Path) -> list[Path]:
    """Return a photograph of even ground."""
    ground = np.full((60, 90, 3), (120, 170, 180), np.uint8)
    cv2.imwrite(str(tmp_path / "ground.png"), ground)
    return [tmp_path / "ground.png"]


@pytest.mark.parametrize("kind", KINDS)
def test_over_even_ground_the_image_shows_what_is_true(kind: str, grounds: list[Path]) -> None:
    scenes = [Scene("even", gap.frame, gap.cables, off_px=2.0) for gap in list_gaps(grounds, kind, 7, 12)]
    gaps = list(list_seen_gaps(scenes))
    assert len(gaps) >= 8
    assert {gap.joined for gap in gaps} == {kind not in ENDS}
    assert {gap.both_end for gap in gaps} == {kind in ENDS}
    log_odds = np.array([gap.pixels for gap in gaps]) @ PIXELS
    assert ((log_odds < 0.0) if kind in ENDS else (log_odds > 0.0)).mean() > 0.7, "a cable may look like its ground"


def test_the_fit_finds_the_numbers_that_made_the_data() -> None:
    rng = np.random.default_rng(0)
    gaps = []
    for source in fit_pixels.SOURCES_IN_SIGHT:
        # Of two normal densities that differ in their mean alone, the log-odds are a line.
        for seen, joined, both_end in ((-0.5, True, False), (1.5, False, True)):
            for x in rng.normal(seen, 1.0, 2000):
                gaps.append(SeenGap(source, np.array([1.0, x, max(x, 0.0) ** 2]), 0.0, joined, both_end))
        for x in np.where(rng.random(4000) < 0.2, rng.normal(1.5, 1.0, 4000), rng.normal(-0.5, 1.0, 4000)):
            gaps.append(SeenGap(source, np.array([1.0, x, max(x, 0.0) ** 2]), 0.0, False, False))
    found = fit_pixels.fit(gaps)
    assert found.weights == pytest.approx([1.0, -2.0, 0.0], abs=0.15)
    assert found.in_sight == pytest.approx((2000 + 0.2 * 4000) / 6000, abs=0.05)
    page = fit_pixels.report([replace(gap, source=gap.source.replace("drawn", "rgb")) for gap in gaps], found)
    assert "| rgb | 2000 | 6000 |" in page
    assert f"a share q of\n{found.in_sight:.2f} has" in page
    assert found.gain(np.zeros((1, 3))) == pytest.approx([0.0])
    assert found.gain(np.array([[0.0, -50.0, 0.0]])) == pytest.approx([-np.log(1.0 - found.in_sight)], abs=0.01)
