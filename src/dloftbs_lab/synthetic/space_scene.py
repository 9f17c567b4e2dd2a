"""Scenes for an RGB-D camera: a cable above a plane, hands, and a camera placed so that all is in view."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.hand import Hand
from dloftbs_lab.synthetic.kernels.splatting import splat_spheres
from dloftbs_lab.synthetic.signals import Moment
from dloftbs_lab.synthetic.space_axis import SpaceMotion

_FOCAL_PX = 900.0
_HD = (720, 1280)
_OFF_CENTRE_PX = (3.2, -2.1)
_MARGIN = 0.05
_FARTHEST_M = 1.5
_FIT_MOMENTS = 61
_FIT_POINTS = 61
# Spheres a radius: the surface is then at most 1/512 of the radius too deep.
_DENSITY = 8.0


@dataclass(frozen=True)
class View:
    """Pose of the camera over the plane above which a cable moves.

    Parameters
    ----------
    distance_m : float
        From the camera to the plane's origin.
    tilt : float
        Radians; 0 looks straight at the plane, above 0 its lower part in the image is nearer.
    ground_m : float
        Depth of the background below the plane.
    shift : (float, float)
        Place of the origin, metres along X and Y off the optical axis.
    """

    distance_m: float
    tilt: float
    ground_m: float
    shift: tuple[float, float] = (0.0, 0.0)

    @property
    def axes(self) -> FloatArray:
        """The axes X, Y and H in the camera's frame, shape (3, 3), one a row."""
        cos, sin = math.cos(self.tilt), math.sin(self.tilt)
        return np.array([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, -sin, -cos]])

    def to_camera(self, points: FloatArray) -> FloatArray:
        """Return points (n, 3) given as X, Y, H in the camera's frame, metres."""
        return (points + np.array([*self.shift, 0.0])) @ self.axes + (0.0, 0.0, self.distance_m)

    def background(self, camera: PinholeCamera, size: tuple[int, int]) -> npt.NDArray[np.float32]:
        """Return the depth of the background, shape (H, W) m."""
        normal = self.axes[2]
        level = normal[2] * self.distance_m - self.ground_m
        vx = (np.arange(size[1]) - camera.cx) / camera.fx
        vy = (np.arange(size[0])[:, None] - camera.cy) / camera.fy
        return (level / (normal[0] * vx + normal[1] * vy + normal[2])).astype(np.float32)


@dataclass(frozen=True)
class SpaceScene:
    """A cable and who handles it.

    Parameters
    ----------
    name : str
    frames : int
        Number of frames that show it in full, at 30 a second.
    radius_m : float
        Of the cable.
    motion : SpaceMotion
    view : View
        The camera goes back, to 1.5 m at most, where it is too close for the cable to stay in the image.
    hands : tuple of Hand
    """

    name: str
    frames: int
    radius_m: float
    motion: SpaceMotion
    view: View
    hands: tuple[Hand, ...] = ()

    def axis(self, moment: Moment) -> FloatArray:
        """Return points (n, 3) as X, Y, H, m, dense enough to draw a tube with."""
        return self.motion.points(moment, math.ceil(_DENSITY * self.motion.length_m / self.radius_m) + 1)

    def fitted_view(self, size: tuple[int, int], fps: float) -> View:
        """Return the view shifted, and if need be moved back, so that the cable stays in an image of this shape."""
        camera = hd_camera(size)
        phases = np.linspace(0.0, 1.0, _FIT_MOMENTS)
        moments = [Moment(phase, phase * self.frames / fps) for phase in phases.tolist()]
        points = np.concatenate([self.motion.points(moment, _FIT_POINTS) for moment in moments])
        room = (1.0 - 2.0 * _MARGIN) * np.array([size[1] - 1, size[0] - 1])
        distance = self.view.distance_m
        while True:
            view = _centred(View(distance, self.view.tilt, self.view.ground_m), points, camera, room)
            seen = camera.project(view.to_camera(points))
            if distance >= _FARTHEST_M or (np.ptp(seen, axis=0) <= room).all():
                return view
            distance = min(1.02 * distance, _FARTHEST_M)


def _centred(view: View, points: FloatArray, camera: PinholeCamera, room: FloatArray) -> View:
    """Shift the plane until the middle of the visible scene is the middle of the image."""
    middle = np.array([camera.cx, camera.cy])
    for _ in range(4):
        seen = camera.project(view.to_camera(points))
        off = (middle - (seen.min(axis=0) + seen.max(axis=0)) / 2.0) * view.distance_m / camera.fx
        shift = (view.shift[0] + float(off[0]), view.shift[1] + float(off[1]))
        view = View(view.distance_m, view.tilt, view.ground_m, shift)
    return view


def hd_camera(size: tuple[int, int]) -> PinholeCamera:
    """Return the camera of an HD sensor, 900 px of focal length, scaled to fit its view into an image (H, W)."""
    scale = min(size[0] / _HD[0], size[1] / _HD[1])
    cx, cy = ((size[1] - 1) / 2.0 + scale * _OFF_CENTRE_PX[0], (size[0] - 1) / 2.0 + scale * _OFF_CENTRE_PX[1])
    return PinholeCamera(scale * _FOCAL_PX, scale * _FOCAL_PX, cx, cy)


@dataclass(frozen=True, eq=False)
class Rendering:
    """A scene as the camera sees it.

    Parameters
    ----------
    depth : numpy.ndarray, shape (H, W), float32
        Metres along z.
    sample : numpy.ndarray, shape (H, W), int32
        Index of the sphere that is seen; -1 is background.
    centers, radius : numpy.ndarray, shape (n, 3) and (n,)
        The spheres, metres; the cable's come first.
    cable : int
        Number of spheres that are the cable's.
    """

    depth: npt.NDArray[np.float32]
    sample: npt.NDArray[np.int32]
    centers: FloatArray
    radius: FloatArray
    cable: int

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """Mask of the visible cable, shape (H, W)."""
        # As unsigned numbers, the background's -1 is the largest.
        return self.sample.view(np.uint32) < self.cable

    def owner(self, axes: Sequence[FloatArray]) -> npt.NDArray[np.intp]:
        """Return the number of the cable in each pixel (H, W), -1 where there is none, by the cables' spheres."""
        ends = np.cumsum([len(axis) for axis in axes])
        return np.where(self.mask, np.searchsorted(ends, self.sample, side="right"), -1)


def render(
    scene: SpaceScene, view: View, camera: PinholeCamera, moment: Moment, background: npt.NDArray[np.float32]
) -> Rendering:
    """Draw a scene before a background (H, W) m."""
    axis = scene.axis(moment)
    hands = [hand.spheres(axis, scene.radius_m, moment) for hand in scene.hands]
    centers = view.to_camera(np.concatenate([axis, *(hand[0] for hand in hands)]))
    radius = np.concatenate([np.full(len(axis), scene.radius_m), *(hand[1] for hand in hands)])
    return draw_spheres(centers, radius, len(axis), camera, background)


def draw_spheres(
    centers: FloatArray, radius: FloatArray, cable: int, camera: PinholeCamera, background: npt.NDArray[np.float32]
) -> Rendering:
    """Draw spheres before a background (H, W) m; the arguments are those of `Rendering`."""
    depth = background.copy()
    sample = np.full(depth.shape, -1, np.int32)
    splat_spheres(centers, radius, camera.fx, camera.fy, camera.cx, camera.cy, depth, sample)
    return Rendering(depth, sample, centers, radius, cable)
