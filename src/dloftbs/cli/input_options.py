"""Options that say where frames come from, and what goes with them."""

from __future__ import annotations

import functools
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dloftbs.cli.limits import MAX_DEPTH_UNIT_M, MAX_FRAMES, MIN_DEPTH_UNIT_M, FilledPath

if TYPE_CHECKING:
    from dloftbs.camera import DepthRegistration, PinholeCamera
    from dloftbs.robot import JointStates
    from dloftbs.sources import Source
    from dloftbs.sources.pixels import Kind
    from dloftbs.support.arrays import FloatArray

from dloftbs.cli.config_options import Command

CAMERA_SUFFIXES = (".yaml", ".yml", ".json", ".xml")


def parse_camera(text: str | None) -> PinholeCamera | None:
    """Read the intrinsics of a camera, four numbers or a file; other numbers are bad usage, another file bad input."""
    if text is None:
        return None
    from dloftbs.camera import PinholeCamera

    if Path(text).suffix.lower() in CAMERA_SUFFIXES:
        return PinholeCamera.from_file(text)
    expected = f"four numbers FX,FY,CX,CY in pixels, or a file ({', '.join(CAMERA_SUFFIXES)})"
    numbers = text.split(",")
    if len(numbers) != 4:
        raise click.BadParameter(f"expected {expected}, got {text!r}", param_hint="--camera")
    try:
        fx, fy, cx, cy = map(float, numbers)
        return PinholeCamera(fx, fy, cx, cy)
    except ValueError as error:  # InputError is one
        raise click.BadParameter(f"expected {expected}, got {text!r}: {error}", param_hint="--camera") from error


def parse_registration(text: str | None) -> DepthRegistration | None:
    """Read a registration from a file."""
    if text is None:
        return None
    from dloftbs.camera import DepthRegistration

    return DepthRegistration.from_file(text)


@dataclass(frozen=True)
class RobotOptions:
    """Files of a robot that is rendered into the frames' occluders."""

    robot: str
    joints: str

    def wrap(self, source: Source, where: str | Sequence[str], pose: FloatArray | None) -> Source:
        """Return a source, which `where` named, with the robot in its frames; closing this closes the source.

        Raises
        ------
        InputError, SourceError
            As the readers of the files and `RobotSource`; the source is closed then.
        """
        from dloftbs.robot import RobotModel, RobotSource

        try:
            read = RobotModel.from_urdf if Path(self.robot).suffix.lower() == ".urdf" else RobotModel.from_yaml
            return RobotSource(source, read(self.robot), self._joints_in(where), pose)
        except BaseException:
            source.close()
            raise

    def _joints_in(self, where: str | Sequence[str]) -> JointStates:
        from dloftbs.robot import JointStates
        from dloftbs.sources.recordings import is_recording

        if isinstance(where, str) and is_recording(Path(where)) and not Path(self.joints).is_file():
            from dloftbs.ros.joint_messages import read_joints

            return read_joints(where, self.joints)
        return JointStates.from_csv(self.joints)


def robot_options(command: Command) -> Command:
    """Add the options that name a robot; they go into the `inputs` of the command."""

    @click.option(
        "--robot",
        type=FilledPath(),
        metavar="YAML|URDF",
        help="Robot that may hide cables: capsules, joints and grippers in YAML, or a URDF (extra robot). It is "
        "rendered into the frames' occluders; ends that a gripper holds are `held`. It needs --joints and --camera.",
    )
    @click.option(
        "--joints",
        type=FilledPath(),
        metavar="CSV|TOPIC",
        help="Positions of the robot's joints: a column time (seconds, as the frames' stamps) or frame, then one of "
        "the name of each joint; or a topic of JointState in the recording that is read.",
    )
    @click.option(
        "--camera-pose",
        type=FilledPath(),
        metavar="FILE",
        help="Pose of the camera in the world, or the robot's base or camera_link, YAML: translation_m, and rotation, "
        "quaternion_xyzw or rpy; or a matrix (4, 4). It replaces the camera_pose of the robot's YAML; .usda and .xml "
        "are in the world.",
    )
    @functools.wraps(command)
    def with_robot(
        *args: Any, robot: str | None, joints: str | None, camera_pose: str | None, inputs: InputOptions, **kwargs: Any
    ) -> None:
        if (robot is None) != (joints is None):
            raise click.UsageError("--robot and --joints go together")
        if camera_pose is not None:
            from dloftbs.camera import read_pose

            inputs = replace(inputs, pose=read_pose(camera_pose))
        if robot is not None and joints is not None:
            inputs = replace(inputs, robot=RobotOptions(robot, joints))
        command(*args, inputs=inputs, **kwargs)

    return with_robot


@dataclass(frozen=True)
class InputOptions:
    """Options of reading frames: the arguments of `dloftbs.sources.open`."""

    kind: Kind
    depth: str | None
    masks: str | None
    occluders: str | None
    camera: PinholeCamera | None
    registration: DepthRegistration | None
    depth_unit_m: float | None
    topic: str | None = None
    depth_topic: str | None = None
    info_topic: str | None = None
    instances: str | None = None
    mask_topic: str | None = None
    robot: RobotOptions | None = None
    pose: FloatArray | None = None

    def open(
        self,
        where: str | Sequence[str],
        fps: float | None = None,
        *,
        segmented: bool,
        mask_is: str,
        jobs: int = 1,
        keep_messages: bool = False,
    ) -> Source:
        """Open an input with these options; `mask_is`, `jobs` and `keep_messages` are those of `sources.open`.

        Where frames are `segmented` by a colour, grey ones are images unless --kind says otherwise.

        Raises
        ------
        InputError, SourceError
            As `dloftbs.sources.open`.
        """
        from dloftbs import sources
        from dloftbs.sources.pixels import kind_for

        source = sources.open(
            where,
            kind=kind_for(self.kind, segmented=segmented),
            mask_is=mask_is,
            fps=fps,
            jobs=jobs,
            keep_messages=keep_messages,
            **{name: value for name, value in vars(self).items() if name not in ("kind", "robot", "pose")},
        )
        return source if self.robot is None else self.robot.wrap(source, where, self.pose)

    def tune_command(self, where: str | Sequence[str]) -> str:
        """Return the command that makes a configuration for an input, as a shell takes it."""
        from importlib.util import find_spec

        words = ["dloftbs", "tune", *([where] if isinstance(where, str) else where)]
        for option, value in (("--topic", self.topic), ("--depth", self.depth), ("--depth-topic", self.depth_topic)):
            words += [] if value is None else [option, value]
        install = "" if find_spec("aiohttp") else "pip install 'dloftbs[ui]' && "
        return f"{install}{shlex.join([*words, '--out', 'cable.yaml'])}"

    @property
    def rules(self) -> list[str]:
        """The naming rules among the paths."""
        return [where for where in self.beside if "{stem}" in where]

    @property
    def beside(self) -> list[str]:
        """The paths and naming rules of what goes with the frames."""
        given = (self.depth, self.masks, self.occluders, self.instances)
        return [where for where in given if where is not None]


def topic_options(command: Command) -> Command:
    """Add the options that name the topics of a recording: `topic`, `depth_topic`, `info_topic`."""
    options = (
        click.option(
            "--topic", metavar="NAME", help="Topic of the images in a ROS recording; needed if there are several."
        ),
        click.option(
            "--depth-topic",
            metavar="NAME",
            help="Topic of the depth images in a ROS recording, registered to the images.",
        ),
        click.option(
            "--info-topic", metavar="NAME", help="Topic of the camera's intrinsics (CameraInfo) in a ROS recording."
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


_AS_GIVEN = ("depth", "occluders", "instances", "topic", "depth_topic", "info_topic")
"""Options that `InputOptions` has as the command line gives them."""


def input_options(command: Command) -> Command:
    """Add the options that say how frames are read; the command gets them as `inputs`, an `InputOptions`."""

    @click.option(
        "--kind",
        type=click.Choice(("auto", "image", "mask")),
        default="auto",
        show_default=True,
        help="Read the frames as images or as masks, whose values --mask-is explains. auto: grey files and label "
        "images are masks, unless a colour is given.",
    )
    @click.option(
        "--depth",
        type=FilledPath(),
        metavar="PATH|RULE",
        help='Depth registered to the frames: a file, a folder, or a naming rule such as "{stem}_depth.png".',
    )
    @click.option(
        "--masks",
        type=FilledPath(),
        metavar="PATH|RULE",
        help='Masks of the frames, in place of a colour: a file, a folder, or a naming rule such as "{stem}_mask.png".',
    )
    @click.option(
        "--occluders",
        type=FilledPath(),
        metavar="PATH|RULE",
        help="Masks of objects that may hide cables, such as a robot or a hand: a file, a folder or a naming rule.",
    )
    @click.option(
        "--instances",
        type=FilledPath(),
        metavar="PATH|RULE",
        help='One mask per object, in place of a colour: label images, "{stem}_mask_*.png" for one file per object, '
        '"{stem}.json" (labelme), "{stem}.txt" (YOLO), or a COCO file for all frames.',
    )
    @click.option(
        "--camera",
        type=FilledPath(),
        metavar="FX,FY,CX,CY|FILE",
        help="Intrinsics in pixels, or a calibration file (YAML, JSON, XML) with lens distortion. With depth, curves "
        "are in metres, too.",
    )
    @click.option(
        "--registration",
        type=FilledPath(),
        metavar="FILE",
        help="Registration of a separate depth camera: YAML or JSON with depth_camera, colour_camera, rotation and "
        "translation_m.",
    )
    @click.option(
        "--depth-unit",
        type=click.FloatRange(MIN_DEPTH_UNIT_M, MAX_DEPTH_UNIT_M),
        metavar="METRES",
        help="Metres per unit of integer depth. Default: 0.001 (millimetres). Floating-point depth is in metres.",
    )
    @topic_options
    @click.option(
        "--mask-topic",
        metavar="NAME",
        help="Topic of the masks in a ROS recording, in place of a colour. Images without a mask are skipped.",
    )
    @functools.wraps(command)
    def with_inputs(
        *args: Any,
        kind: Kind,
        masks: str | None,
        mask_topic: str | None,
        camera: str | None,
        registration: str | None,
        depth_unit: float | None,
        **kwargs: Any,
    ) -> None:
        for option, given in (("--masks", masks), ("--mask-topic", mask_topic)):
            if given is not None and kind == "mask":
                raise click.UsageError(
                    f"{option} goes with images: --kind mask says that the frames are masks themselves"
                )
        if masks is not None and mask_topic is not None:
            raise click.UsageError("--masks and --mask-topic are two sources of masks; leave out one")
        inputs = InputOptions(
            kind,
            masks=masks,
            camera=parse_camera(camera),
            registration=parse_registration(registration),
            depth_unit_m=depth_unit,
            mask_topic=mask_topic,
            **{name: kwargs.pop(name) for name in _AS_GIVEN},
        )
        command(*args, inputs=inputs, **kwargs)

    return with_inputs


limit_option = click.option(
    "--limit", type=click.IntRange(1, MAX_FRAMES), metavar="N", help="Stop after N used frames."
)
every_option = click.option(
    "--every",
    type=click.IntRange(1, MAX_FRAMES),
    default=1,
    metavar="N",
    help="Use every Nth frame only, for a quick look at a long video.",
)
fps_option = click.option(
    "--fps",
    type=click.FloatRange(0.01, 1000.0),
    metavar="RATE",
    help="Frame rate of the input. It replaces all stamps. Overlay videos of recordings without a rate have 30.",
)
