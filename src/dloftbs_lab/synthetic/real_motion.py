"""Sequences of real cables' recorded motion before a pinhole camera: nobody drew what they do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.depth_noise import TYPICAL_NOISE
from dloftbs_lab.synthetic.generated import (
    HD_WIDTH_PX,
    NumberedSequence,
    check_choice,
    numbers_at,
    proportion,
    truth_of,
)
from dloftbs_lab.synthetic.motion import smoothstep, window
from dloftbs_lab.synthetic.motion_capture import FILES, Recording, recordings_in
from dloftbs_lab.synthetic.space_axis import axis_curve, image_curve
from dloftbs_lab.synthetic.space_paint import CABLE_BGR, COLOURS_BGR, SKIN_BGR, paint_spheres
from dloftbs_lab.synthetic.space_scene import Rendering, draw_spheres, hd_camera
from dloftbs_lab.truth import Truth

_FPS = 30.0
MAX_CABLES = 4
_SHIFT_M = 0.15
_DISTANCE_M = (0.8, 1.5)
"""From the camera to the middle of the cables."""
_RADIUS_M = (0.005, 0.008)
_NEAREST_M = 0.3
_IN_VIEW = 0.98
"""Share of the markers of all frames that are inside of the image; four of five views that are drawn have it."""
_MAX_VIEWS = 50
"""Views drawn until one has as much in the image; if none of them has, the best of them."""
_DENSITY = 8.0
"""Spheres a radius; see `dloftbs_lab.synthetic.space_scene`."""
_BEHIND_M = 0.3
"""From the farthest place of a cable to the ground."""
_DISCS = 2
_DISC_PX = (30.0, 60.0)
"""Radius of an occluder in an image of 1280 x 720."""
_DISC_NEARNESS = 0.7
"""Depth of the occluders, as a share of the depth of the nearest place of a cable."""


@dataclass(frozen=True)
class _Variant:
    """Contents of the frames besides the mask of the cables, and the numbers of cables that the suite takes."""

    cables: tuple[int, ...]
    occluders: bool = False
    depth: bool = False
    image: bool = False
    colours: bool = False


_VARIANTS: Mapping[str, _Variant] = {
    "mask": _Variant((1, 2, 3, 4)),
    "occluders": _Variant((3,), occluders=True),
    "depth": _Variant((3,), depth=True),
    "occluders and depth": _Variant((3,), occluders=True, depth=True),
    "occluders and image": _Variant((3,), occluders=True, image=True),
    "coloured image": _Variant((), image=True, colours=True),
}
REAL_MOTION_VARIANTS = tuple(_VARIANTS)
"""Variants of the sequences: the mask alone; with discs that move over the cables; with depth as a camera measures it;
with both; with the discs and an image; with an image in which cables differ in colour, which the suite leaves out."""


class _Disc(NamedTuple):
    """An occluder that comes from a side, moves along a cable and leaves: a ball nearer than all cables."""

    cable: int
    along: tuple[float, float]
    direction: float
    radius_px: float


class _View(NamedTuple):
    """Placement of the cables before the camera: for each its turn (3, 3) and shift (3,) m, in the camera's frame."""

    turns: list[FloatArray]
    shifts: list[FloatArray]
    distance_m: float
    nearest_m: float
    farthest_m: float
    in_view: float


class RealMotionSequence(NumberedSequence):
    """Real motion of one to four cables, recorded one by one, before a pinhole camera that looks from any side.

    Each cable is turned about the vertical and shifted by up to 15 cm, and drawn as a round tube of 5 to 8 mm radius,
    about 12 px wide in an image of 1280 x 720. The motion has its own speed, at 30 frames a second.

    Parameters
    ----------
    folder : Path
        Recordings: see `dloftbs_lab.synthetic.motion_capture.recordings_in`.
    cables : int
        From 1 to 4.
    variant : str
        One of `REAL_MOTION_VARIANTS`.
    number : int
        Number within the variant: another one shows other recordings from elsewhere.
    frames : int, optional
        At most as many as the recordings last, and that where it is left out.
    size, seed
        As `GeneratedSequence` has them; another seed gives other scenes.

    Attributes
    ----------
    family : str
        The variant.
    cables : int

    Raises
    ------
    InputError
        If a value is out of range, or the recordings are too short or too few.
    SourceError
        If the recordings cannot be read.
    """

    def __init__(
        self,
        folder: Path,
        cables: int = 1,
        variant: str = "mask",
        number: int = 0,
        frames: int | None = None,
        size: tuple[int, int] = (720, 1280),
        seed: int = 0,
    ) -> None:
        check_choice("variant", variant, REAL_MOTION_VARIANTS)
        self._folder = folder
        if not 1 <= cables <= min(MAX_CABLES, len(self._recordings)):
            raise InputError(
                f"cables must be in 1..{MAX_CABLES}, with a recording each, got {cables} and {len(self._recordings)} "
                "recordings"
            )
        most = 1 + math.floor(_FPS * min(recording.seconds for recording in self._recordings))
        if frames is not None and frames > most:
            raise InputError(f"these recordings last {most} frames at {_FPS:g} a second, got {frames}")
        name = f"{variant}, {cables} cable{'' if cables == 1 else 's'}"
        key = (REAL_MOTION_VARIANTS.index(variant), cables)
        super().__init__(name, variant, key, number, most if frames is None else frames, size, seed, _FPS)
        self.cables = cables
        self.camera: PinholeCamera = hd_camera(size)
        self._variant = _VARIANTS[variant]

    def _make_frame(self, index: int) -> Frame:
        """Return one frame with the mask of all cables, shape (H, W) bool, and what the variant has."""
        frame = super()._make_frame(index)
        if not (self._variant.depth or self._variant.image):
            return frame
        seen, _ = self._render(index)
        key = [self.seed, self.cables, self.number, index]
        if self._variant.depth:
            depth = TYPICAL_NOISE.apply(seen.depth, seen.mask, np.random.default_rng(key))
            frame = replace(frame, depth=depth, camera=self.camera)
        if self._variant.image:
            frame = replace(frame, image=paint_spheres(seen, self._colours_of(index, seen), self.camera, key))
        return frame

    def _colours_of(self, index: int, seen: Rendering) -> FloatArray:
        """Return the colours (n, 3), BGR, of the spheres of cables and discs."""
        colours = np.tile(np.asarray(SKIN_BGR, dtype=np.float64), (len(seen.radius), 1))
        colours[: seen.cable] = CABLE_BGR
        if self._variant.colours:
            numbers = np.repeat(np.arange(self.cables), [len(axis) for axis in self._axes(index)])
            colours[: seen.cable] = COLOURS_BGR[numbers % len(COLOURS_BGR)]
        return colours

    def _make_truth(self, index: int) -> Truth:
        axes = self._axes(index)
        _, owner = self._render(index)
        return truth_of((image_curve(axis, self.camera) for axis in axes), owner, map(axis_curve, axes))

    @cached_property
    def _recordings(self) -> tuple[Recording, ...]:
        return recordings_in(self._folder)

    def _render(self, index: int) -> tuple[Rendering, npt.NDArray[np.intp]]:
        """Return what the camera sees, and the number of the cable in each pixel (H, W), -1 where there is none."""
        axes, discs = self._axes(index), self._discs(index)
        centers = np.concatenate((*axes, discs[:, :3]))
        cable = len(centers) - len(discs)
        radius = np.concatenate((np.full(cable, self._radius_m), discs[:, 3]))
        background = np.full(self.size, self._view.farthest_m + _BEHIND_M, np.float32)
        seen = draw_spheres(centers, radius, cable, self.camera, background)
        return seen, seen.owner(axes)

    def _axes(self, index: int) -> list[FloatArray]:
        """Return the axes of the cables in a frame, in the camera's frame, each (n, 3) m."""
        view, second = self._view, index / _FPS
        axes = []
        for number, turn, shift in zip(self._chosen, view.turns, view.shifts, strict=True):
            recording = self._recordings[number]
            count = math.ceil(_DENSITY * recording.length_m / self._radius_m) + 1
            axes.append(recording.axis(second, count) @ turn.T + shift)
        return axes

    def _discs(self, index: int) -> FloatArray:
        """Return the occluders in a frame as balls: x, y, z and radius in the camera's frame, shape (n, 4) m."""
        phase = index / self._frames
        centre_m = _DISC_NEARNESS * self._view.nearest_m
        balls = np.empty((len(self._covers), 4))
        for i, disc in enumerate(self._covers):
            share = disc.along[0] + (disc.along[1] - disc.along[0]) * float(smoothstep(np.array(phase)))
            line = self.camera.project(self._axes(index)[disc.cable])
            away = np.array([math.cos(disc.direction), math.sin(disc.direction)]) * max(self.size)
            place = line[round(share * (len(line) - 1))] + (1.0 - window(phase, (0.0, 0.25), (0.75, 1.0))) * away
            balls[i, :3] = self.camera.deproject(place[None], np.array([centre_m]))[0]
            balls[i, 3] = disc.radius_px / self.camera.fx * centre_m
        return balls

    @property
    def _radius_m(self) -> float:
        """Radius at which a cable in the middle is as wide as in all suites, as far as cables come so thick."""
        half_px = 0.5 * HD_WIDTH_PX * proportion(self.size)
        return float(np.clip(half_px * self._view.distance_m / self.camera.fx, *_RADIUS_M))

    @cached_property
    def _chosen(self) -> list[int]:
        return self._rng(0).choice(len(self._recordings), self.cables, replace=False).tolist()

    @cached_property
    def _view(self) -> _View:
        """The first of the views that are drawn which has enough in the image, or the best of them."""
        rng = self._rng(1)
        best = self._draw_view(rng)
        for _ in range(_MAX_VIEWS - 1):
            if best.in_view >= _IN_VIEW:
                break
            best = max(best, self._draw_view(rng), key=lambda view: view.in_view)
        return best

    def _draw_view(self, rng: np.random.Generator) -> _View:
        looking = Rotation.from_quat(rng.normal(size=4)).as_matrix()
        distance = float(rng.uniform(*_DISTANCE_M))
        turns, shifts, places = [], [], []
        for number in self._chosen:
            markers = self._recordings[number].markers.reshape(-1, 3)
            turn = looking @ Rotation.from_rotvec([0.0, 0.0, rng.uniform(0.0, 2.0 * math.pi)]).as_matrix()
            way = rng.normal(size=3)
            shift = rng.uniform(0.0, _SHIFT_M) * way / np.linalg.norm(way)
            turns.append(turn)
            shifts.append(shift - turn @ markers.mean(axis=0) + (0.0, 0.0, distance))
            places.append(markers @ turn.T + shifts[-1])
        points = np.concatenate(places)
        before = points[points[:, 2] >= _NEAREST_M]
        seen = self.camera.project(before)
        inside = ((seen >= 0.0) & (seen <= np.array(self.size[::-1]) - 1.0)).all(axis=1).sum() / len(points)
        nearest, farthest = float(points[:, 2].min()), float(points[:, 2].max())
        return _View(turns, shifts, distance, nearest, farthest, float(inside) if len(before) == len(points) else 0.0)

    @cached_property
    def _covers(self) -> list[_Disc]:
        if not self._variant.occluders:
            return []
        rng, scale = self._rng(2), proportion(self.size)
        return [
            _Disc(
                int(rng.integers(self.cables)),
                (float(rng.uniform(0.1, 0.5)), float(rng.uniform(0.5, 0.9))),
                float(rng.uniform(0.0, 2.0 * math.pi)),
                scale * float(rng.uniform(*_DISC_PX)),
            )
            for _ in range(_DISCS)
        ]


def missing_recordings(folder: Path) -> str | None:
    """Return what is missing where a folder has no recordings, in words, or None."""
    if any(folder.glob(FILES)):
        return None
    return f"recorded motion is needed, {FILES} in {folder}: name another folder by real-motion:FOLDER"


def real_motion(
    folder: Path, scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)
) -> list[RealMotionSequence]:
    """Return 20 sequences of each variant that the suite takes, with each of its numbers of cables, by the scale.

    They are as long as the recordings of a folder.

    Raises
    ------
    InputError
        If a value is out of range, or the recordings are too few.
    SourceError
        If the recordings cannot be read.
    """
    return [
        RealMotionSequence(folder, cables, name, number, None, size, seed)
        for name, variant in _VARIANTS.items()
        for cables in variant.cables
        for number in numbers_at(scale)
    ]
