"""Bars of what a planner asks, each with its figure: knots, bends, deviations, the robot, and the hot path.

Run it in the repository with ``python -m benchmarks.answers``; it takes some minutes on an idle machine, and needs
``spherogram``. `benchmarks.topology`, `benchmarks.bends` and `benchmarks.fit_deviation` measure parts of it at length.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from unittest.mock import patch

import cv2
import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline
from scipy.ndimage import distance_transform_edt

from benchmarks import bends, fit_deviation, topology
from benchmarks.docs import arguments, published
from benchmarks.timing import interleaved
from dloftbs import Detection, Frame, FrameResult, PinholeCamera, Pipeline, Track
from dloftbs.data.answers import KINDS, with_answers
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.deviation import WEIGHTS, WEIGHTS_3D, deviation
from dloftbs.data.object_shape import ObjectShape
from dloftbs.robot import RobotModel
from dloftbs.topology import Diagram
from dloftbs_lab.evaluation.suites import missing_for

_SIZE = (360, 480)
_CAMERA = PinholeCamera(500.0, 500.0, 239.5, 179.5)
_FRAMES = 30
_OF_OBJECTS = ("bend_radius", "tightest_bend", "bend_radius_3d", "tightest_bend_3d", "touches")
_DEVIATIONS = ("curve_std", "curve_3d_std")
_OF_CURVES = ("bend_radius", "tightest_bend", "slack", "distance", "poses", "inside")
_ROBOT = """
joints: [{name: rail, type: prismatic, parent: base, child: arm, axis: [1, 0, 0]}]
capsules: [{link: arm, start_m: [0, -0.5, 0.7], end_m: [0.04, 0.5, 0.8], radius_m: 0.04}]
camera_pose: {translation_m: [0, 0, 0], rpy: [0, 0, 0]}
"""

_Mask = npt.NDArray[np.bool_]


def cables(index: int) -> list[npt.NDArray[np.float64]]:
    """Return the points (n, 2) of three cables that sway, one across the others."""
    x = np.linspace(40.0, 440.0, 400)
    sway = 10.0 * np.sin(0.12 * index)
    return [
        np.stack((x, 110.0 + 25.0 * np.sin(x / 60.0) + sway), axis=1),
        np.stack((x, 250.0 + 30.0 * np.cos(x / 70.0) - sway), axis=1),
        np.stack((x + sway, 40.0 + 0.72 * (x - 40.0)), axis=1),
    ]


def scene(index: int) -> _Mask:
    """Return the mask of all cables, nothing hidden."""
    mask = np.zeros(_SIZE, np.uint8)
    for points in cables(index):
        cv2.polylines(mask, [np.rint(16.0 * points).astype(np.int32)], False, (255.0,), 9, cv2.LINE_8, 4)
    return mask > 0


def rendered(place: float) -> _Mask:
    """Return where the capsule of `_ROBOT` is seen, pixel by pixel: where a ray comes within its radius."""
    rows, columns = np.mgrid[: _SIZE[0], : _SIZE[1]]
    rays = np.stack(((columns - _CAMERA.cx) / _CAMERA.fx, (rows - _CAMERA.cy) / _CAMERA.fy, np.ones(_SIZE)), axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    seen = np.zeros(_SIZE, bool)
    for share in np.linspace(0.0, 1.0, 100):
        centre = np.array([place + 0.04 * share, share - 0.5, 0.7 + 0.1 * share])
        away = centre - (rays @ centre)[..., None] * rays
        seen |= (away**2).sum(axis=-1) <= 0.04**2
    return seen


def behind_the_arm() -> None:
    """Print how near rendered capsules are to the arm, and how three cables fare behind it, known in both ways."""
    places = np.linspace(-0.5, 0.5, _FRAMES)  # it comes from outside, and goes
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.yaml"
        path.write_text(_ROBOT, "utf-8")
        robot = RobotModel.from_yaml(path)
    capsules = [robot.occluders({"rail": float(place)}, _CAMERA, _SIZE) for place in places]
    masks = [rendered(place) for place in places]
    # A sliver at the border of the picture says nothing of where the edges are.
    inside = [number for number, place in enumerate(places) if abs(place) < 0.3]
    off = max(_apart(capsules[number], masks[number]) for number in inside)
    print(f"{'occluders of capsules, from a rendered arm, px':<52}{off:8.2f}   bar 2")
    for name, covers in (("mask given", masks), ("capsules", capsules), ("not known", [None] * _FRAMES)):
        right, ids = 0, []
        pipeline = Pipeline()
        for index, cover in enumerate(covers):
            result = pipeline.process(
                Frame(mask=scene(index) & ~masks[index], occluders=cover, index=index, camera=_CAMERA)
            )
            ids.append([_track_on(points, result.tracks) for points in cables(index)])
            right += sum(one is not None and one == first for one, first in zip(ids[index], ids[0], strict=True))
        share = 100.0 * right / (3 * _FRAMES)
        print(f"{'three cables behind the arm: ' + name:<52}{share:8.1f} % of tracks right, with their ids")


def _apart(one: _Mask, other: _Mask) -> float:
    """Return how far a pixel that only one mask has lies from the other mask, px."""
    away = [np.max(distance_transform_edt(~b)[a], initial=0.0) for a, b in ((one, other), (other, one))]
    return float(max(away))


def _track_on(points: npt.NDArray[np.float64], tracks: tuple[Track, ...]) -> int | None:
    """Return the id of the track all along a cable, hidden parts included, within half its width."""
    for track in tracks:
        away = [track.curve.nearest(point)[1:] for point in points[10:-10:20]]
        if max(float(one[-1]) for one in away) < 4.5 and abs(track.curve.length / _length(points) - 1.0) < 0.06:
            return track.id
    return None


def _length(points: npt.NDArray[np.float64]) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def hot_path() -> None:
    """Print that no answer is computed before it is asked, and what answers cost beside `process`."""
    frames = [Frame(mask=scene(index), index=index) for index in range(20)]
    pipeline = Pipeline()
    results = [pipeline.process(frame) for frame in frames]
    ways: dict[str, Callable[[], object]] = {
        "as it is": partial(_process, frames),
        "answers refused": partial(_refused, frames),
        **{kind: partial(_answer, results, kind) for kind in KINDS},
    }
    times = {name: float(np.median(ms)) / len(frames) for name, ms in interleaved(ways, 9).items()}
    print(f"{'process, over one in which each answer would raise':<52}{_ratio(times):8.2f}   bar 1")
    print(f"{'process, three cables that cross':<52}{times['as it is']:8.2f} ms a frame")
    for kind in KINDS:
        print(f"{'  and asked for ' + kind:<52}{times[kind]:8.2f} ms a frame")


def _answer(results: list[FrameResult], kind: str) -> None:
    for result in results:
        with_answers(result, (kind,))


def _ratio(times: dict[str, float]) -> float:
    return times["as it is"] / times["answers refused"]


def _process(frames: list[Frame]) -> None:
    pipeline = Pipeline()
    for frame in frames:
        pipeline.process(frame)


def _refused(frames: list[Frame]) -> None:
    """Process frames while every answer would raise an error."""
    with ExitStack() as stack:
        for kind, names in ((ObjectShape, _OF_OBJECTS), (Detection, _DEVIATIONS), (Track, _DEVIATIONS)):
            for name in names:
                stack.enter_context(patch.object(kind, name, _refuse))
        for name in _OF_CURVES:
            stack.enter_context(patch.object(BSplineCurve, name, _refuse))
        stack.enter_context(patch.object(Diagram, "from_result", _refuse))
        _process(frames)


def _refuse(*_: object) -> None:
    raise AssertionError("an answer was computed that nobody asked for")


def curves() -> None:
    """Print how far bends, slack and poses are from the truth."""
    bends.main()
    angle = np.linspace(0.0, 12.0, 2000)
    radius, rise = 0.05, 0.01
    helix = np.stack((radius * np.cos(angle), radius * np.sin(angle), rise * angle), axis=1)
    spline = make_interp_spline(np.linspace(0.0, 1.0, len(helix)), helix, 3)
    curve = BSplineCurve(spline.t, spline.c, 3, closed=False)
    us = np.linspace(0.0, 1.0, 60)
    frames, angles = curve.poses(us)[:, :3, :3], 12.0 * us
    inwards = np.stack((-np.cos(angles), -np.sin(angles), 0.0 * angles), axis=1)
    upwards, z = np.cross(frames[:, :, 0], inwards), frames[:, :, 2]
    turned = np.unwrap(np.arctan2((z * upwards).sum(axis=1), (z * inwards).sum(axis=1)))
    least = -rise / (radius**2 + rise**2) * np.hypot(radius, rise) * angles
    off = float(np.abs(turned - turned[0] - least).max())
    print(f"{'poses of a helix turn more than they must, rad':<52}{off:8.0e}   bar 1e-6")


def deviations(count: int) -> None:
    """Print the shares of points within one and two deviations, of `count` sequences of each source, other seeds."""
    fit_deviation._SEQUENCES = count
    print(f"{'points within one and two deviations, %':<52}{'image':>16}{'space':>16}")
    held, asked = [0, 0], [0, 0]
    for source in (one for one in fit_deviation.SOURCES if missing_for(one.partition(",")[0]) is None):
        cells = []
        for number, found in enumerate(fit_deviation.measure(source, fit_deviation.TEST_SEED)):
            if found is None:
                continue
            std = deviation(found[0], (WEIGHTS, WEIGHTS_3D)[number])
            one, two = (100.0 * float((found[1] <= times * std).mean()) for times in (1.0, 2.0))
            held[number] += 60.0 <= one <= 76.0 and 90.0 <= two <= 98.0
            asked[number] += 1
            cells.append(f"{one:.0f}, {two:.0f}")
        print(f"{'  ' + source:<52}" + "".join(f"{cell:>16}" for cell in cells))
    print(
        f"{'  sources that hold, bar 60 to 76 and 90 to 98':<52}"
        + "".join(f"{f'{one} of {n}':>16}" for one, n in zip(held, asked, strict=True))
    )


def main() -> None:
    """Print all bars."""
    parser = arguments(__doc__, "a quarter of everything")
    options = parser.parse_args()
    share = 4 if options.quick else 1
    with published("answers", options.docs):
        curves()
        hot_path()
        behind_the_arm()
        topology.against_spherogram(400 // share)
        topology.drawn_ropes("knots of up to 7 crossings, named", topology.named(112 // share), topology._is_named)
        for apart in (4.0, 3.2, 2.8):
            title = f"random ropes, strands {apart:g} widths apart"
            topology.drawn_ropes(title, topology.tangled(80 // share, apart), topology._is_told)
        deviations(12 // share)


if __name__ == "__main__":
    main()
