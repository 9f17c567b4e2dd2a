"""The fit of what an image and depth say about gaps."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from benchmarks import fit_evidence
from benchmarks.fit_evidence import SeenGap, list_seen_gaps
from benchmarks.fit_linking.scenes import Scene
from benchmarks.pictured_gaps import ENDS, GROUNDS, KINDS, list_gaps

from dloftbs.linking.kernels.evidence_weights import DEPTHS, PIXELS


@pytest.fixture(scope="module", params=KINDS)
def over_even_ground(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, list[Scene]]:
    """Return a kind of gap, and scenes of it over a photograph of even ground."""
    ground = tmp_path_factory.mktemp("even") / "ground.png"
    cv2.imwrite(str(ground), np.full((60, 90, 3), (120, 170, 180), np.uint8))
    return request.param, [
        Scene("even", gap.frame, gap.cables, off_px=2.0) for gap in list_gaps([ground], request.param, 7, 12)
    ]


@pytest.mark.parametrize("what", ["image", "depth"])
def test_over_even_ground_what_is_shown_is_true(what: str, over_even_ground: tuple[str, list[Scene]]) -> None:
    kind, scenes = over_even_ground
    gaps = list(list_seen_gaps(scenes, what))
    assert len(gaps) >= 8
    assert {gap.joined for gap in gaps} == {kind not in ENDS}
    assert {gap.both_end for gap in gaps} == {kind in ENDS}
    columns = np.array([gap.columns for gap in gaps])
    assert not columns[:, OF_DEPTH if what == "image" else OF_IMAGE].any()
    log_odds = columns @ np.concatenate((PIXELS, DEPTHS))
    if what == "image":
        assert ((log_odds < 0.0) if kind in ENDS else (log_odds > 0.0)).mean() > 0.7, "a cable may look like its ground"
    elif kind in ENDS or kind.startswith("under"):  # a thin cable stands out by less than noise
        assert np.median(log_odds) < 0.0 if kind in ENDS else np.median(log_odds) > -1.0


def test_the_fit_finds_the_numbers_that_made_the_data() -> None:
    rng = np.random.default_rng(0)
    gaps = []
    for what, own in (("image", OF_IMAGE), ("depth", OF_DEPTH)):
        for source in fit_evidence.SOURCES_IN_SIGHT:
            # Of two normal densities that differ in their mean alone, the log-odds are a line.
            for seen, joined, both_end in ((-0.5, True, False), (1.5, False, True)):
                for x in rng.normal(seen, 1.0, 2000):
                    gaps.append(SeenGap(source, what, columns_of(x, own), 0.0, joined, both_end))
            for x in np.where(rng.random(4000) < 0.2, rng.normal(1.5, 1.0, 4000), rng.normal(-0.5, 1.0, 4000)):
                gaps.append(SeenGap(source, what, columns_of(x, own), 0.0, False, False))
    found = fit_evidence.fit(gaps)
    assert found.weights == pytest.approx([1.0, -2.0, 0.0, 1.0, -2.0], abs=0.15)
    assert found.in_sight == pytest.approx((2000 + 0.2 * 4000) / 6000, abs=0.05)
    page = fit_evidence.report([replace(gap, source=gap.source.replace("drawn", "rgb")) for gap in gaps], found)
    assert "| rgb | image | 2000 | 6000 |" in page
    assert f"a share q of\n{found.in_sight:.2f} has" in page
    assert found.gain(np.zeros((1, 5))) == pytest.approx([0.0])
    assert found.gain(np.array([[0.0, -50.0, 0.0, 0.0, -1.0]])) == pytest.approx(
        [-np.log(1.0 - found.in_sight)], abs=0.01
    )


def test_a_source_that_alone_shows_ends_in_sight_is_not_left_out() -> None:
    gaps = []
    for source, joined, both_end in (("hidden", True, False), (GROUNDS[0], True, False), (GROUNDS[0], False, True)):
        for x in np.random.default_rng(len(gaps)).normal(-1.0 if joined else 1.0, 1.0, 50):
            gaps.append(SeenGap(source, "depth", columns_of(x, OF_DEPTH), 0.0, joined, both_end))
            gaps.append(SeenGap(source, "image", columns_of(x, OF_IMAGE), 0.0, joined, both_end))
    page = fit_evidence.report(gaps, fit_evidence.fit(gaps))
    (row,) = (line for line in page.splitlines() if line.startswith(f"| {GROUNDS[0]} | depth "))
    assert row.endswith("| - |")
    (row,) = (line for line in page.splitlines() if line.startswith("| hidden | depth "))
    assert not row.endswith("| - |")


OF_IMAGE, OF_DEPTH = slice(3), slice(3, None)


def columns_of(x: float, own: slice) -> np.ndarray:
    """Return the columns of a gap with one measured value."""
    columns = np.zeros(5)
    columns[own] = [1.0, x, max(x, 0.0) ** 2][: len(columns[own])]
    return columns
