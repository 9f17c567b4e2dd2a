"""Cables that are partly hidden while they tilt, come nearer or stay: metres keep their length, pixels do not."""

from __future__ import annotations

import numpy as np
import pytest
from builders import curve_through, detection_of

from dloftbs.camera import PinholeCamera
from dloftbs.config import TrackingConfig
from dloftbs.data.detection import Detection
from dloftbs.evidence import OcclusionEvidence
from dloftbs.tracking import Tracker

FRAMES = 60
SIZE = (720, 1280)
CAMERA = PinholeCamera(800.0, 800.0, 640.0, 360.0)
BARS = {"middle": (600, 680), "end": (760, 1280)}
COLUMNS = np.arange(SIZE[1])
BAR = OcclusionEvidence(
    depth=np.tile(np.where((COLUMNS >= 600) & (COLUMNS < 680), 0.3, 1.9), (SIZE[0], 1)), camera=CAMERA
)


def bodies() -> list[np.ndarray]:
    """Return shapes of 0.6 m in the plane, lengthwise along x."""
    t = np.linspace(0.0, 1.0, 401)
    shapes = []
    for turn, waves in ((0.8, 1.0), (0.9, 1.5), (1.2, 0.5), (0.5, 2.0)):
        heading = turn * np.cos(2.0 * np.pi * waves * t)
        steps = 0.6 / 400 * np.stack((np.cos(heading), np.sin(heading), 0.0 * t), axis=1)[1:]
        points = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
        shapes.append(points - points.mean(axis=0))
    return shapes


def posed(body: np.ndarray, motion: str, phase: float) -> np.ndarray:
    """Return a body in front of the camera, m: it starts and ends 1.1 m away, not tilted."""
    swing = np.sin(np.pi * phase) ** 2
    angle = {"stays": 0.0, "nears": 0.0, "tilts": 0.9, "tilts and nears": 0.6}[motion] * swing
    nearer = {"stays": 0.0, "nears": 0.5, "tilts": 0.0, "tilts and nears": 0.3}[motion] * swing
    c, s = np.cos(angle), np.sin(angle)
    return body @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) + np.array([0.0, 0.0, 1.1 - nearer])


def worst_px(motion: str, place: str, body: np.ndarray, *, with_depth: bool) -> float:
    """Return the largest mean distance of a track's points from where they are, over all frames; of one id."""
    tracker, rng, worst = Tracker(), np.random.default_rng(0), 0.0
    depth = np.full(SIZE, 1.9)
    unhidden = OcclusionEvidence(depth=depth.copy(), camera=CAMERA)
    depth[:, slice(*BARS[place])] = 0.3
    hidden = OcclusionEvidence(depth=depth, camera=CAMERA)
    for frame in range(-12, FRAMES):
        points = posed(body, motion, max(frame, 0) / FRAMES)
        seen, width = CAMERA.project(points), 10.0 * 1.1 / points[:, 2].mean()
        left, right = BARS[place] if frame >= 0 else (0, 0)
        visible = (seen[:, 0] < left) | (seen[:, 0] >= right)
        edges = np.flatnonzero(np.diff(np.concatenate(([False], visible, [False]))))
        detections = []
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            noisy = points[first:last:2] + np.array([0.0, 0.0, rng.normal(0.0, 0.0015)])
            one = detection_of(curve_through(seen[first:last:2]), curve_through(noisy), radius=0.5 * width)
            detections.append(one.reversed() if rng.random() < 0.5 else one)
        evidence = (hidden if frame >= 0 else unhidden) if with_depth else None
        (track,) = tracker.update(detections, frame / 30.0, SIZE, occlusion=evidence)
        assert track.id == 1
        if frame >= 0:
            share = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(seen, axis=0), axis=1))))
            u = np.linspace(0.0, 1.0, 101) * share[-1]
            truth = np.stack([np.interp(u, share, column) for column in seen.T], axis=1)
            found = track.curve.sample(101)
            worst = max(worst, min(np.linalg.norm(found[::d] - truth, axis=1).mean() for d in (1, -1)))
    return worst


@pytest.mark.parametrize("body", bodies())
@pytest.mark.parametrize("motion", ["stays", "nears", "tilts", "tilts and nears"])
class TestPartlyHidden:
    @pytest.mark.parametrize("place", BARS)
    def test_with_depth_all_of_it_is_where_it_is(self, motion, place, body):
        assert worst_px(motion, place, body, with_depth=True) < 4.0

    def test_from_a_mask_alone_what_is_between_two_ends_follows_them(self, motion, body):
        """How far each of the two parts tilts is not seen: places along the cable are off by some pixels."""
        assert worst_px(motion, "middle", body, with_depth=False) < 16.0


@pytest.mark.parametrize("body", bodies())
def test_a_part_whose_depth_jumps_makes_its_track_no_shorter(body):
    """Beside an occluder a part may have another thing's depth: it is too long in space, with what is between them."""
    tracker, points = seen_whole(body)
    length = tracker.tracks[0].curve.length
    for jump_m in (0.0, 0.25, 0.25, 0.0):
        (track,) = tracker.update(parts_beside_a_bar(points, jump_m), size=SIZE, occlusion=BAR)
        assert track.curve.length == pytest.approx(length, rel=0.02)


@pytest.mark.parametrize("body", bodies())
def test_a_part_whose_depth_jumps_is_in_space_where_it_is_seen(body):
    tracker, points = seen_whole(body)
    for _ in range(8):
        points = points + np.array([0.0, 0.01, 0.0])
        (track,) = tracker.update(parts_beside_a_bar(points, 0.25), size=SIZE, occlusion=BAR)
        projected, on_curve = CAMERA.project(track.curve_3d.sample(201)), track.curve.sample(201)
        ends = np.linalg.norm(projected - on_curve, axis=1)[[0, -1]]
        assert ends.max() < 4.0


@pytest.mark.parametrize("body", bodies())
@pytest.mark.parametrize("dark", [0, 1])
@pytest.mark.parametrize("smoothing_s", [0.0, 0.1])
def test_a_part_without_depth_is_not_measured_in_space(body, dark, smoothing_s):
    tracker, points = seen_whole(body, TrackingConfig(smoothing_s=smoothing_s))
    parts = parts_beside_a_bar(points, 0.0)
    parts[dark] = Detection(parts[dark].centerline, parts[dark].curve)
    (track,) = tracker.update(parts, size=SIZE, occlusion=BAR)
    share = parts[0].curve.length / track.curve.length
    edge = 0.95 * share if dark == 0 else 1.0 - 0.95 * (1.0 - share)
    assert sum(high - low for low, high in track.inferred_3d) > 0.99 * (share if dark == 0 else 1.0 - share)
    assert any(low <= edge <= high for low, high in track.inferred_3d)
    assert not any(low <= 0.5 * (share if dark else 1.0 + share) <= high for low, high in track.inferred_3d)


def seen_whole(body: np.ndarray, config: TrackingConfig | None = None) -> tuple[Tracker, np.ndarray]:
    """Return a tracker that has seen all of a body for some frames, and its points."""
    tracker, points = Tracker(config), posed(body, "stays", 0.0)
    for _ in range(12):
        whole = detection_of(curve_through(CAMERA.project(points)[::2]), curve_through(points[::2]))
        tracker.update([whole], size=SIZE)
    return tracker, points


def parts_beside_a_bar(points: np.ndarray, jump_m: float) -> list[Detection]:
    """Return what a bar leaves of a body; towards it the depth of the first part comes nearer, by so much."""
    seen, wrong = CAMERA.project(points), points.copy()
    visible = np.split(np.arange(len(points)), np.flatnonzero(np.diff((seen[:, 0] < 600) | (seen[:, 0] >= 680))) + 1)
    last = visible[0][-40:]
    wrong[last] *= (1.0 - jump_m * np.linspace(0.0, 1.0, 40) / points[last, 2])[:, None]  # along the rays
    return [detection_of(curve_through(seen[k][::2]), curve_through(wrong[k][::2])) for k in visible[::2]]
