"""What an image shows between two ends decides whether a gap is bridged."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import draw_cable
from linking_examples import graph_of

import dloftbs
from dloftbs import Config, Frame, Pipeline
from dloftbs.config import SegmentationConfig
from dloftbs.errors import InputError
from dloftbs.evidence import EvidenceMap
from dloftbs.linking.kernels.evidence_weights import PIXELS
from dloftbs_lab.synthetic import DemoSequence

SIZE = (240, 400)
WIDTH = 9
LINE = np.array([(30.0, 130.0), (130.0, 112.0), (260.0, 118.0), (370.0, 105.0)])
GROUND, CABLE, OCCLUDER = (150, 160, 165), (40, 60, 190), (90, 140, 40)


def scene(gap: tuple[int, int], cover: str, *, seed: int = 0, drift: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return a mask with a gap between two columns, and an image that shows there what it is called.

    The ground is noisy, and its brightness changes from left to right by `drift`.
    """
    rng = np.random.default_rng(seed)
    whole = draw_cable(LINE, WIDTH, SIZE).astype(bool)
    inside = np.zeros(SIZE, dtype=bool)
    inside[:, slice(*gap)] = True
    mask = whole & ~inside
    image = np.empty((*SIZE, 3))
    image[:] = GROUND
    image += np.linspace(0.0, drift, SIZE[1])[:, None]
    image[whole if cover == "cable" else mask] = CABLE
    if cover == "occluder":
        image[60:180, slice(*gap)] = OCCLUDER
    image = cv2.GaussianBlur(image, (0, 0), 0.8) + rng.normal(0.0, 3.0, image.shape)
    return mask, np.clip(image, 0, 255).astype(np.uint8)


def log_odds(gap: tuple[int, int], cover: str, drift: float = 0.0) -> float:
    """Return the log-odds that the gap is hidden, and not ground in sight."""
    mask, image = scene(gap, cover, drift=drift)
    crop, graph = graph_of(mask)
    inner = np.argsort(np.abs(crop.to_image(graph.end_states[:, :2])[:, 0] - np.mean(gap)))[:2]
    length = np.hypot(*(graph.end_states[inner[0], :2] - graph.end_states[inner[1], :2]))
    hidden, pixels, depths = EvidenceMap(crop, image).at(graph).across(np.sort(inner)[None], np.array([length]))
    assert not hidden.any(), "nothing else is known"
    assert not depths.any()
    return float(pixels[0] @ PIXELS)


@pytest.mark.parametrize(("covered", "share"), [((0, 400), 1.0), ((150, 190), 0.5), ((0, 20), 0.0)])
@pytest.mark.parametrize("gap", [(150, 230), (186, 200)])
def test_occluders_hide_what_they_cover(gap: tuple[int, int], covered: tuple[int, int], share: float) -> None:
    mask, _ = scene(gap, "ground")
    crop, graph = graph_of(mask)
    occluders = np.zeros(SIZE, dtype=bool)
    occluders[:, slice(*covered)] = True
    inner = np.sort(np.argsort(np.abs(crop.to_image(graph.end_states[:, :2])[:, 0] - np.mean(gap)))[:2])
    evidence = EvidenceMap(crop, occluders=occluders).at(graph)
    hidden, _, _ = evidence.across(inner[None], np.array([float(gap[1] - gap[0])]))
    if gap == (150, 230) or share == 1.0:
        assert hidden == pytest.approx(share, abs=0.1 * (share < 1.0))
    assert evidence.knows_covers
    assert not EvidenceMap(crop, np.zeros((*SIZE, 3), np.uint8)).at(graph).knows_covers


@pytest.mark.parametrize("drift", [0.0, 60.0])
@pytest.mark.parametrize(("cover", "is_hidden"), [("ground", False), ("cable", True), ("occluder", True)])
def test_a_gap_looks_like_what_is_there(cover: str, is_hidden: bool, drift: float) -> None:
    found = log_odds((150, 230), cover, drift)
    assert found > 2.0 if is_hidden else found < -2.0


@pytest.mark.parametrize("gap", [(180, 205), (165, 225), (150, 250)])
def test_ends_with_ground_between_them_stay_open(gap: tuple[int, int]) -> None:
    mask, image = scene(gap, "ground")
    assert len(dloftbs.detect(mask, image=image)) == 2


@pytest.mark.parametrize("columns", [12, 40])
def test_a_cable_that_is_seen_through_a_slit_of_an_occluder_goes_on_below(columns: int) -> None:
    mask, image = scene((150, 250), "occluder")
    slit = np.s_[60:180, 190 : 190 + columns]
    image[slit] = np.where(draw_cable(LINE, WIDTH, SIZE)[slit][..., None] > 0, CABLE, GROUND)
    assert len(dloftbs.detect(mask, image=image)) == 1


@pytest.mark.parametrize("columns", [12, 40])
def test_ground_that_is_seen_through_a_slit_of_an_occluder_keeps_a_gap_open(columns: int) -> None:
    # A cable below the occluder would be seen there.
    mask, image = scene((150, 250), "occluder")
    image[60:180, 190 : 190 + columns] = GROUND
    assert len(dloftbs.detect(mask, image=image)) == 2


@pytest.mark.parametrize("cover", ["occluder", "cable"])
@pytest.mark.parametrize("gap", [(180, 205), (165, 225), (150, 250)])
def test_a_gap_that_something_hides_is_bridged(gap: tuple[int, int], cover: str) -> None:
    mask, image = scene(gap, cover)
    (found,) = dloftbs.detect(mask, image=image)
    away = np.abs(found.curve.sample(400)[:, 1] - np.interp(found.curve.sample(400)[:, 0], *LINE.T))
    assert away.max() < 6.0


def test_the_pipeline_asks_the_image_of_a_frame() -> None:
    mask, image = scene((165, 225), "ground")
    assert len(Pipeline().detect(Frame(mask=mask)).detections) == 1
    assert len(Pipeline().detect(Frame(mask=mask, image=image)).detections) == 2


def test_the_result_turns_along_with_the_frame() -> None:
    mask, image = scene((165, 225), "occluder", drift=40.0)
    for k in range(4):
        assert len(dloftbs.detect(np.rot90(mask, k), image=np.rot90(image, k))) == 1


def test_an_image_of_another_size_is_refused() -> None:
    mask, image = scene((165, 225), "ground")
    with pytest.raises(InputError, match="size"):
        dloftbs.detect(mask, image=image[:100])


def test_an_end_at_the_border_of_the_image_takes_part_in_no_gap() -> None:
    mask = draw_cable(np.array([(60.0, 60.0), (399.0, 100.0)]), WIDTH, SIZE)
    mask |= draw_cable(np.array([(60.0, 170.0), (399.0, 128.0)]), WIDTH, SIZE)
    assert len(dloftbs.detect(mask)) == 2
    assert len(dloftbs.detect(mask, image=np.full((*SIZE, 3), 90, dtype=np.uint8))) == 2


def test_a_fingertip_over_the_edge_of_a_mat_is_no_ground() -> None:
    # Wood, mat, shadows and another cable lie beside the ends: all of them together are far from each other.
    demo = DemoSequence(24, (360, 640), 1)
    config = Config(segmentation=SegmentationConfig(hsv=(demo.hsv[1],)))
    for index in (16, 17):
        assert len(Pipeline(config).detect(demo.frame(index)).detections) == 1, index
