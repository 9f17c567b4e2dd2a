"""Frames of a source, with the robot rendered into their occluders."""

from __future__ import annotations

from collections.abc import Iterator

from dloftbs.camera import as_pose
from dloftbs.data.frame import Frame
from dloftbs.robot.joint_states import JointStates
from dloftbs.robot.robot_model import PoseLike, RobotModel
from dloftbs.sources import Source
from dloftbs.sources.source import logger
from dloftbs.support.values import check_type


class RobotSource(Source):
    """Frames of a source, each with the pixels that a robot covers as occluders, and the grippers that hold.

    Occluders that a frame has already stay occluders. A frame at whose time a joint is unknown goes without; the
    first one is named in a warning, and all of them are counted at the end.

    Parameters
    ----------
    source : Source
        Belongs to this one from now on, and is closed with it.
    robot : RobotModel
    joints : JointStates
    pose : array_like, shape (4, 4), or mapping, optional
        Pose of the camera in `RobotModel.camera_link`, in the place of the robot's own.

    Raises
    ------
    InputError
        If an argument is of another type, or nobody knows the camera's pose; while iterating, if a frame has no camera
        or no stamp where joints have times, or a joint has no position.
    """

    def __init__(self, source: Source, robot: RobotModel, joints: JointStates, pose: PoseLike | None = None) -> None:
        check_type("source", source, Source)
        check_type("robot", robot, RobotModel)
        check_type("joints", joints, JointStates)
        self._pose = None if pose is None else as_pose("pose", pose)
        if self._pose is None and not robot.has_camera:
            raise robot._no_camera_pose()
        self._source, self._robot, self._joints = source, robot, joints
        self.name, self.fps, self.length = source.name, source.fps, source.length
        self.length_is_estimate = source.length_is_estimate
        self.has_depth, self.live, self.single_pass = source.has_depth, source.live, source.single_pass

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames."""
        self._begin()
        return self._frames(iter(self._source))

    def close(self) -> None:
        """Close the source."""
        super().close()
        self._source.close()

    def _frames(self, frames: Iterator[Frame]) -> Iterator[Frame]:
        without = 0
        try:
            for frame in frames:
                self.skipped = self._source.skipped
                positions = self._joints.at(frame, self._robot)
                if positions is None:
                    without += 1
                    if without == 1:
                        logger.warning("frame %d goes without the robot: its joints are unknown then", frame.index)
                    yield frame
                else:
                    yield self._robot.seen_in(frame, positions, self._pose)
        finally:
            self.skipped = self._source.skipped
            if without > 1:
                logger.warning("%d frames went without the robot, since its joints are unknown then", without)
