"""Evidence of the frame as columns of joints: at branches that two cables share."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import pytest

from dloftbs.data.frame import Frame
from dloftbs.data.graph import FREE, TANGENT
from dloftbs.linking.joint_evidence import add_evidence
from dloftbs.linking.kernels.evidence_weights import DEPTHS, PIXELS
from dloftbs.linking.kernels.joint_features import DEPTH_SWERVE
from dloftbs.linking.kernels.weights import JOINT
from dloftbs.pipeline import Pipeline


@dataclass(frozen=True)
class Depths:
    """Evidence that knows depth alone: of each end of the graph, m."""

    known: tuple[float, ...]
    tells_swerves: bool = True

    def swerves(self, pairs: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        return np.abs(np.subtract(*np.array(self.known)[pairs].T))

    def differ_in_colour(self, pairs: np.ndarray) -> np.ndarray:
        return np.zeros(len(pairs), dtype=bool)

    def across(self, pairs: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return np.zeros(len(pairs)), np.zeros((len(pairs), len(PIXELS))), np.zeros((len(pairs), len(DEPTHS)))


def swerve_of(depth: float, shared_depth: float, shared: bool, turn: float = 0.0) -> float:
    """Return the column of a joint from a cable, branch 0, into branch 1, which turns, rad, and branch 2 may double."""
    nodes = [FREE, 0, 0, FREE] + [0, FREE] * shared
    ids = np.array([0, 1, 2, 3] + [2, 3] * shared)
    joints = np.zeros((1, len(JOINT)))
    states, roundness = np.zeros((len(ids), 6)), np.ones(len(ids))
    states[1, TANGENT], states[2, TANGENT] = (1.0, 0.0), (-np.cos(turn), np.sin(turn))
    evidence = Depths((depth, depth, shared_depth, shared_depth))
    add_evidence(evidence, ids, np.array(nodes), states, roundness, np.array([(1, 2)]), joints)  # type: ignore[arg-type]
    return float(joints[0, DEPTH_SWERVE])


@pytest.mark.parametrize("depth", [0.8, 0.9])
def test_a_step_in_depth_is_one_of_the_cable(depth: float) -> None:
    assert swerve_of(depth, 0.85, shared=False) > 0.0


@pytest.mark.parametrize(("turn", "shows"), [(1.5, True), (-1.5, True), (1.7, False), (-3.0, False)])
def test_a_cable_that_folds_back_may_step_in_depth(turn: float, shows: bool) -> None:
    assert (swerve_of(0.8, 0.85, shared=False, turn=turn) > 0.0) == shows


@pytest.mark.parametrize("depth", [0.8, 0.9])
def test_where_two_cables_share_a_branch_its_depth_is_either_ones(depth: float) -> None:
    assert swerve_of(depth, 0.85, shared=True) == 0.0


BLUE, GREEN, GROUND = (170, 90, 30), (70, 150, 40), (190, 195, 200)


def facing(left: tuple[int, int, int], right: tuple[int, int, int], light: float = 1.0) -> Frame:
    """Return a frame of two straight cables that end before each other, behind a hand."""
    mask, image = np.zeros((120, 400), np.uint8), np.full((120, 400, 3), GROUND, np.uint8)
    for first, last, colour in ((20, 170, left), (215, 380, right)):
        mask[56:64, first:last], image[56:64, first:last] = 255, colour
    image[20:120, 165:220] = (150, 175, 220)
    noisy = light * image + np.random.default_rng(1).normal(0.0, 4.0, image.shape)
    return Frame(mask=mask, image=np.clip(noisy, 0.0, 255.0).astype(np.uint8))


def count_found(frame: Frame) -> int:
    return len(Pipeline().process(frame).detections)


@pytest.mark.parametrize("light", [1.0, 0.6])
def test_ends_of_two_colours_are_not_joined_across_a_gap(light: float) -> None:
    frame = facing(BLUE, GREEN, light)
    assert count_found(frame) == 2
    assert count_found(Frame(mask=frame.mask)) == 1
    grey = cv2.cvtColor(cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    assert count_found(Frame(mask=frame.mask, image=grey)) == 1


@pytest.mark.parametrize(
    ("left", "right"),
    [(BLUE, BLUE), (BLUE, (100, 54, 18)), ((28, 29, 37), (34, 25, 18)), ((40, 40, 40), (75, 70, 70))],
    ids=["same", "shade", "black in coded video", "sheen"],
)
def test_ends_of_one_colour_in_another_light_are_joined(left: tuple[int, ...], right: tuple[int, ...]) -> None:
    assert count_found(facing(left, right)) == 1


def test_at_a_crossing_branches_of_one_colour_go_together() -> None:
    """Two cables that turn away from each other in one place look like two that cross."""
    mask, image = np.zeros((240, 400), np.uint8), np.full((240, 400, 3), GROUND, np.uint8)
    ends = (((20, 40), (380, 40)), ((20, 200), (380, 200)))
    for (start, stop), colour in zip(ends, (BLUE, GREEN), strict=True):
        for pixels, value in ((mask, 255), (image, colour)):
            cv2.polylines(pixels, [np.array([start, (200, 120), stop])], False, value, 8)
    found = Pipeline().process(Frame(mask=mask, image=image)).detections
    assert sorted(sorted(round(float(one.curve(u)[1]), -2) for u in (0, 1)) for one in found) == [[0, 0], [200, 200]]
    blind = Pipeline().process(Frame(mask=mask)).detections
    assert sorted(sorted(round(float(one.curve(u)[1]), -2) for u in (0, 1)) for one in blind) == [[0, 200]] * 2
