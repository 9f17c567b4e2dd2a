"""Corners of sharp bends, and closed folds."""

from __future__ import annotations

import math

import numpy as np
from drawings import draw_cable
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.data.graph import FREE
from dloftbs.skeleton.kernels.corners import find_corners


class Meeting:
    """Branches that meet at a few junctions, most of them two and a stub, in a mask that ends round or is cut off."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.width = width = float(rng.uniform(3.0, 14.0))
        self.centres = np.array([(60.0, 60.0), (180.0, 60.0), (60.0, 180.0)]) + rng.uniform(-3.0, 3.0, (3, 2))
        self.mask = np.zeros((240, 240), dtype=np.uint8)
        branches, nodes, radii = [], [], []
        self.outwards: list[np.ndarray] = []
        for node, centre in enumerate(self.centres):
            middle, half = rng.uniform(-np.pi, np.pi), rng.uniform(0.1, 0.85)
            for k in range(rng.choice([2, 3, 3, 3, 3, 3, 4])):
                is_stub = k == 0
                # Arms lead away from the junction, and point outwards on its other side, as the stub does.
                angle = middle + (rng.normal(0.0, 0.3) if is_stub else np.pi + (half if k % 2 else -half))
                along = np.array([np.cos(angle), np.sin(angle)])
                mitre = 0.5 * width * (1.0 / np.sin(half) - 1.0)
                length = min(mitre + rng.uniform(0.0, 2.0) * width, 45.0) if is_stub else 40.0
                far = np.arange(1.0, max(length, 2.0))[:, None]
                aside = rng.uniform(-1.0, 1.0) if is_stub and rng.random() < 0.3 else 0.0  # some stubs are bent
                points = centre + far * along + aside * far**2 / far[-1] * np.array([-along[1], along[0]])
                drawn = np.concatenate((centre[None], points))
                self.mask |= draw_cable(drawn, round(width), self.mask.shape)
                if is_stub and rng.random() < 0.3:  # what hides a crossing cuts its corner off
                    y, x = np.mgrid[:240, :240]
                    beyond = (x - points[-1, 0]) * along[0] + (y - points[-1, 1]) * along[1]
                    near = np.hypot(x - points[-1, 0], y - points[-1, 1]) < 2.0 * width
                    self.mask[near & (beyond > 0.0)] = 0
                elsewhere = rng.integers(0, 3) if rng.random() < 0.1 else FREE
                backwards = rng.random() < 0.5
                branches.append(points[::-1] if backwards else points)
                nodes.append((elsewhere, node) if backwards else (node, elsewhere))
                wide = (rng.uniform(1.2, 2.0), rng.uniform(0.5, 1.0)) if is_stub else (1.0, 1.0)
                widths = width * np.linspace(*wide, len(points))
                radii.append(0.5 * (widths[::-1] if backwards else widths))
                self.outwards += [along, -along] if backwards else [-along, along]
        self.points, self.radius = np.concatenate(branches), np.concatenate(radii)
        self.offsets = np.cumsum([0, *map(len, branches)])
        self.nodes = np.array(nodes).ravel()
        tips = [branch[end] for branch in branches for end in (0, -1)]
        self.states = np.column_stack((tips, self.outwards, np.zeros((len(tips), 2))))
        self.alive = rng.random(len(branches)) < 0.9
        self.spurs = ~self.alive & (rng.random(len(branches)) < 0.8)

    def find(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the corners, and which branches are alive and which are spurs afterwards."""
        alive, spurs = self.alive.copy(), self.spurs.copy()
        branches = self.points, self.radius, self.offsets
        corners = find_corners(self.nodes, alive, spurs, self.states, self.centres, *branches, self.mask, self.width)
        return corners, alive, spurs

    def reach(self, place: np.ndarray, way: np.ndarray, most: float) -> float:
        """Return how far the mask goes from a place, up to a limit, in quarters of a pixel."""
        t = 0.0
        while t < most:
            x, y = place + t * way + 0.5
            if not (0 <= int(y) < 240 and 0 <= int(x) < 240 and self.mask[int(y), int(x)]):
                break
            t += 0.25
        return t


def turned(way: np.ndarray, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]]) @ way


def is_fold(meeting: Meeting, node: int, ends: list[int], apex: int, beyond: int) -> bool:
    """Tell whether the mask is wide from a junction to a width before a tip, and the skeleton ends there."""
    widths = []
    for end in ends:
        start, stop = meeting.offsets[end // 2], meeting.offsets[end // 2 + 1]
        behind = min(int(3.0 * meeting.width), (stop - start) // 2)
        widths.append(2.0 * meeting.radius[stop - 1 - behind if end % 2 else start + behind])
    side, start = float(np.mean(widths)), meeting.centres[node]
    way = meeting.points[apex] - start
    length = math.sqrt(way[0] * way[0] + way[1] * way[1])
    if beyond > 0.5 * side or length < side:
        return False
    way = way / length
    across = np.array([-way[1], way[0]])
    return all(
        sum(meeting.reach(start + k * way, sign * across, 2.0 * side) for sign in (1.0, -1.0)) >= 1.15 * side
        for k in range(int(length - side) + 1)
    )


def literal_corners(meeting: Meeting) -> tuple[list[int], list[bool], list[bool]]:
    """Look at one stub after the other, from its junction to its tip."""
    corners, alive, spurs = [-1] * len(meeting.nodes), meeting.alive.tolist(), meeting.spurs.tolist()
    nodes, width = meeting.nodes.tolist(), meeting.width
    for root, node in enumerate(nodes):
        stub = root // 2
        if node < 0 or nodes[root ^ 1] != FREE or not (alive[stub] or spurs[stub]):
            continue
        ends = [end for end, other in enumerate(nodes) if other == node and alive[end // 2] and end != root]
        if len(ends) != 2 or ends[0] // 2 == ends[1] // 2:
            continue
        at = np.arange(meeting.offsets[stub], meeting.offsets[stub + 1])[:: -1 if root % 2 else 1]
        one, two = (meeting.states[end, 2:4] for end in ends)
        way = meeting.points[at[-1]] - meeting.centres[node]
        length = float(np.hypot(*way))
        if one @ two <= -0.5:
            continue
        along = float(way @ ((one + two) / np.hypot(*(one + two)))) / length
        if along < 0.85:
            continue
        wide = [i for i in at if 2.0 * meeting.radius[i] >= 0.9 * width]
        apex = wide[-1] if wide else at[0]
        straight = meeting.points[apex] - meeting.centres[node]
        far = max(math.sqrt(straight[0] * straight[0] + straight[1] * straight[1]), 1e-9)
        if meeting.reach(meeting.centres[node], straight / far, far) < far:
            continue
        tip = meeting.points[apex]
        ahead = meeting.reach(tip, way / length, 2.0 * width)
        angles = (-1.05, -0.79, -0.52, 0.52, 0.79, 1.05)
        aside = [meeting.reach(tip, turned(way / length, angle), 2.0 * width) for angle in angles]
        if width >= 6.0 and max(aside) > 1.15 * ahead + 0.75:
            continue
        half = 0.5 * max(math.acos(min(float(one @ two), 1.0)), 0.1)
        # Where the skeletons meet, a disc touches the inner corner and both outer sides.
        mitre = 0.5 * width * (1.0 - math.sin(half)) / (math.sin(half) * (1.0 + math.sin(half)))
        is_short = length <= 1.25 * mitre + 0.75 * width + 3.0 and 2.0 * np.mean(meeting.radius[at]) >= 1.15 * width
        is_mitre = one @ two > 0.0 and (spurs[stub] or is_short)
        askew = math.acos(min(along, 1.0)) - math.acos(min(float(one @ two), 1.0)) / 4.0
        if not is_mitre and (askew > 0.1 or not is_fold(meeting, node, ends, apex, abs(int(at[-1] - apex)))):
            continue
        if alive[stub]:
            alive[stub], spurs[stub] = False, True
        for end in ends:
            corners[end] = int(apex)
    return corners, alive, spurs


@given(st.integers(0, 2**31))
def test_corners_agree_with_the_literal_twin(seed: int) -> None:
    meeting = Meeting(seed)
    assert tuple(found.tolist() for found in meeting.find()) == literal_corners(meeting)


@given(st.integers(0, 2**31))
def test_a_corner_is_known_to_two_ends_at_one_junction_and_its_run_is_a_spur(seed: int) -> None:
    meeting = Meeting(seed)
    corners, alive, spurs = meeting.find()
    for corner in np.unique(corners[corners >= 0]):
        one, two = np.flatnonzero(corners == corner)
        assert meeting.nodes[one] == meeting.nodes[two] >= 0
        stub = np.searchsorted(meeting.offsets, corner, side="right") - 1
        assert spurs[stub]
        assert not alive[stub]
    np.testing.assert_array_equal(alive | spurs, meeting.alive | meeting.spurs)
    assert not (alive & ~meeting.alive).any()
