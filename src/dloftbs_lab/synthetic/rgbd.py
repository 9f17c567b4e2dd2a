"""Generated sequences of a cable in space: its mask and its depth, with the true axis beside them."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs_lab.synthetic.depth_noise import PERFECT_DEPTH, DepthNoise
from dloftbs_lab.synthetic.generated import GeneratedSequence
from dloftbs_lab.synthetic.signals import Moment
from dloftbs_lab.synthetic.space_axis import axis_curve, image_curve
from dloftbs_lab.synthetic.space_paint import paint
from dloftbs_lab.synthetic.space_scene import Rendering, SpaceScene, View, hd_camera, render
from dloftbs_lab.truth import Truth


class RgbdSequence(GeneratedSequence):
    """A round cable in space, seen by an RGB-D camera.

    Every frame is a function of the arguments and its index alone, bit for bit. A frame's `mask`, bool, is the cable as
    far as it is visible; its `depth`, float32, is metres along z to the nearest surface, 0 where it was not measured.
    What happens once in a scene is spread over the frames, whatever their number; what swings keeps its speed. The true
    curve in the image is the projection of the one in space, each with a ``u`` of its own: the normalised arc length
    there, in px or metres.

    Parameters
    ----------
    scene : SpaceScene
        Scene to render; `rgbd_artificial` and `rgbd_manipulation` make such.
    frames : int, optional
        As many as the scene says, if not given.
    size : (int, int)
        ``(H, W)`` px. The camera's field of view is that of an HD image with 900 px of focal length.
    seed : int
        Of the depth's noise, not negative.
    noise : DepthNoise
        Errors of depth; perfect by default.
    with_image : bool
        Whether frames have a shaded colour image too.
    fps : float
        Gives the stamps ``index / fps``.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    def __init__(
        self,
        scene: SpaceScene,
        frames: int | None = None,
        size: tuple[int, int] = (720, 1280),
        seed: int = 0,
        noise: DepthNoise = PERFECT_DEPTH,
        *,
        with_image: bool = False,
        fps: float = 30.0,
    ) -> None:
        super().__init__(scene.name, scene.frames if frames is None else frames, size, seed, fps)
        self.scene = scene
        self.radius_m = scene.radius_m
        self.camera: PinholeCamera = hd_camera(size)
        self.noise = noise
        self._seconds = 1.0 / fps
        self._with_image = with_image

    def _make_frame(self, index: int) -> Frame:
        """Render one frame."""
        seen = self._render(index)
        mask = seen.mask
        rng = np.random.default_rng([self.seed, 1, index])
        return Frame(
            image=paint(seen, self.camera, self.seed) if self._with_image else None,
            mask=mask,
            depth=self.noise.apply(seen.depth, mask, rng),
            camera=self.camera,
            **self._labels(index),
        )

    def _make_truth(self, index: int) -> Truth:
        seen = self._render(index)
        axis = seen.centers[: seen.cable]
        return Truth((image_curve(axis, self.camera),), (seen.mask,), (0,), (axis_curve(axis),))

    def _render(self, index: int) -> Rendering:
        moment = Moment(index / max(1, self._frames - 1), index * self._seconds)
        return render(self.scene, self._view, self.camera, moment, self._background)

    @cached_property
    def _view(self) -> View:
        return self.scene.fitted_view(self.size, 1.0 / self._seconds)

    @cached_property
    def _background(self) -> npt.NDArray[np.float32]:
        return self._view.background(self.camera, self.size)
