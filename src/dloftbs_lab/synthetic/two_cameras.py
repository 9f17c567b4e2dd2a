"""Sequences before two cameras: cables that sway in space, with rigs that are known exactly, wrong, or out of step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.generated import (
    HD_WIDTH_PX,
    NumberedSequence,
    check_choice,
    numbers_at,
    proportion,
    truth_of,
)
from dloftbs_lab.synthetic.space_axis import axis_curve, image_curve
from dloftbs_lab.synthetic.space_scene import Rendering, draw_spheres, hd_camera
from dloftbs_lab.truth import Truth

_FPS, _FRAMES = 30.0, 20
_DENSITY = 8.0
"""Spheres a radius; see `dloftbs_lab.synthetic.space_scene`."""
_POINTS = 6
"""Random points that a cable goes through."""
_ALONG, _ACROSS = 0.35, 0.07
"""Half the length of a cable, and the standard deviation of its points across it, as shares of the distance."""
_SWAY_M, _SWAY_HZ = 0.02, 0.3
_GROUND = 2.0
"""Depth of the ground, as a multiple of that of the cables."""


@dataclass(frozen=True)
class _Variant:
    """A rig, and what is wrong with it: standard deviations, and how much later the second camera looks."""

    baseline_m: float
    distance_m: float
    cables: int = 1
    rotation_std_deg: float = 0.0
    pixel_std: float = 0.0
    late_s: float = 0.0


_VARIANTS: Mapping[str, _Variant] = {
    "50 mm, 0.4 m": _Variant(0.05, 0.4),
    "60 mm, 0.8 m": _Variant(0.06, 0.8),
    "300 mm, 0.8 m": _Variant(0.3, 0.8),
    "300 mm, 1.5 m": _Variant(0.3, 1.5),
    "60 mm, 0.8 m, rig off by 0.1 degree and 0.2 px": _Variant(0.06, 0.8, 1, 0.1, 0.2),
    "60 mm, 0.8 m, 5 ms apart": _Variant(0.06, 0.8, late_s=0.005),
    "60 mm, 0.8 m, two cables": _Variant(0.06, 0.8, 2),
}
TWO_CAMERA_VARIANTS = tuple(_VARIANTS)
"""Variants of the sequences: by baseline and distance; with calibration errors; with shutters that are not
synchronous; with two cables."""


@dataclass(frozen=True, eq=False, repr=False)
class TwoViewFrame(Frame):
    """The frame of the first of two cameras, which has the second one's and the rig with it.

    Parameters
    ----------
    second : Frame, optional
    poses : tuple of numpy.ndarray, each of shape (4, 4)
        Of both cameras, as they are believed to be; see `dloftbs.CameraRig`.
    rotation_std_deg, pixel_std : float
        Standard deviations of what is believed.
    """

    second: Frame | None = None
    poses: tuple[FloatArray, ...] = field(default=())
    rotation_std_deg: float = 0.0
    pixel_std: float = 0.0


class TwoCameraSequence(NumberedSequence):
    """Smooth cables that sway before two cameras beside each other.

    Parameters
    ----------
    variant : str
        One of `TWO_CAMERA_VARIANTS`.
    number : int
        Another one shows other cables, and rigs that are wrong in another way.
    frames, size, seed
        As `GeneratedSequence` has them.

    Attributes
    ----------
    family : str
        The variant.
    cables : int
    radius_m : float

    Raises
    ------
    InputError
        If a value is out of range.
    """

    def __init__(
        self,
        variant: str = "60 mm, 0.8 m",
        number: int = 0,
        frames: int = _FRAMES,
        size: tuple[int, int] = (720, 1280),
        seed: int = 0,
    ) -> None:
        check_choice("variant", variant, TWO_CAMERA_VARIANTS)
        key = (TWO_CAMERA_VARIANTS.index(variant),)
        super().__init__(variant, variant, key, number, frames, size, seed, _FPS)
        self._variant = _VARIANTS[variant]
        self.cables = self._variant.cables
        self.camera: PinholeCamera = hd_camera(size)
        self.radius_m = 0.5 * HD_WIDTH_PX * proportion(size) * self._variant.distance_m / self.camera.fx

    def frame(self, index: int) -> TwoViewFrame:
        """Return one frame.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        self._check(index)
        rng, variant = self._rng(1), self._variant
        cameras = [self._believed(rng) for _ in range(2)]
        second = np.eye(4)
        turn = np.radians(rng.normal(0.0, variant.rotation_std_deg, 3))
        second[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
        second[0, 3] = variant.baseline_m
        left, _ = self._render(index / _FPS, 0.0)
        right, _ = self._render(index / _FPS + variant.late_s, variant.baseline_m)
        labels = self._labels(index)
        return TwoViewFrame(
            mask=left.mask,
            camera=cameras[0],
            second=Frame(mask=right.mask, camera=cameras[1], **{**labels, "stamp": labels["stamp"] + variant.late_s}),
            poses=(np.eye(4), second),
            rotation_std_deg=variant.rotation_std_deg,
            pixel_std=variant.pixel_std,
            **labels,
        )

    def _make_truth(self, index: int) -> Truth:
        axes = self._axes(index / _FPS)
        _, owner = self._render(index / _FPS, 0.0)
        return truth_of((image_curve(axis, self.camera) for axis in axes), owner, map(axis_curve, axes))

    def _believed(self, rng: np.random.Generator) -> PinholeCamera:
        """Return a camera as a calibration found it."""
        off = rng.normal(0.0, self._variant.pixel_std, 2)
        return replace(self.camera, cx=self.camera.cx + float(off[0]), cy=self.camera.cy + float(off[1]))

    def _render(self, second: float, shift_m: float) -> tuple[Rendering, npt.NDArray[np.intp]]:
        """Return what a camera so far to the right sees, and the number of the cable in each pixel (H, W)."""
        axes = [axis - (shift_m, 0.0, 0.0) for axis in self._axes(second)]
        centers = np.concatenate(axes)
        ground = np.full(self.size, _GROUND * self._variant.distance_m, np.float32)
        seen = draw_spheres(centers, np.full(len(centers), self.radius_m), len(centers), self.camera, ground)
        return seen, seen.owner(axes)

    def _axes(self, second: float) -> list[FloatArray]:
        """Return the axes of the cables, in the first camera's frame, each (n, 3) m and evenly spaced."""
        places = np.linspace(0.0, 1.0, _POINTS)
        axes = []
        for points, sway in self._courses:
            spline = CubicSpline(places, points + sway * math.sin(2.0 * math.pi * _SWAY_HZ * second))
            length = float(np.linalg.norm(np.diff(spline(np.linspace(0.0, 1.0, 200)), axis=0), axis=1).sum())
            count = math.ceil(_DENSITY * length / self.radius_m) + 1
            fine = spline(np.linspace(0.0, 1.0, 2 * count))
            arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))))
            even = np.linspace(0.0, arc[-1], count)
            axes.append(np.stack([np.interp(even, arc, values) for values in fine.T], axis=1))
        return axes

    @cached_property
    def _courses(self) -> list[tuple[FloatArray, FloatArray]]:
        """For each cable the points that it goes through, and how far they sway, (n, 3) m."""
        rng, distance = self._rng(0), self._variant.distance_m
        middle = np.array([0.0, 0.0, distance])
        courses = []
        for _ in range(self.cables):
            along = np.linspace(-_ALONG, _ALONG, _POINTS) * distance
            across = rng.normal(0.0, _ACROSS * distance, (_POINTS, 2))
            turn = Rotation.from_rotvec([0.0, 0.0, rng.uniform(0.0, 2.0 * math.pi)]).as_matrix()
            points = np.column_stack((along, across * (0.6, 1.0))) @ turn.T
            courses.append((points + middle, rng.normal(0.0, _SWAY_M, (_POINTS, 3))))
        return courses


def two_cameras(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[TwoCameraSequence]:
    """Return 20 sequences of each of the `TWO_CAMERA_VARIANTS`, by the scale.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    return [
        TwoCameraSequence(variant, number, _FRAMES, size, seed)
        for variant in TWO_CAMERA_VARIANTS
        for number in numbers_at(scale)
    ]
