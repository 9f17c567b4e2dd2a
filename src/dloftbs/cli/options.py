"""Options that several commands share, and what they turn into."""

from __future__ import annotations

import functools
import os
import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dloftbs.cli.limits import MAX_DEPTH_UNIT_M, MAX_FRAMES, MAX_OBJECTS, MIN_DEPTH_UNIT_M, FilledPath, file_path
from dloftbs.errors import ConfigError, InputError

if TYPE_CHECKING:
    from dloftbs.camera import DepthRegistration, PinholeCamera
    from dloftbs.config import Config, HsvRange, Roi
    from dloftbs.robot import JointStates
    from dloftbs.sources import Source
    from dloftbs.sources.pixels import Kind
    from dloftbs.support.arrays import FloatArray

Command = Callable[..., None]

DATA_SUFFIXES = (
    *(".jsonl", ".ndjson", ".npz", ".csv", ".ply", ".obj", ".usda", ".xml", ".json", ".labelme", ".mcap", ".rrd"),
)
CAMERA_SUFFIXES = (".yaml", ".yml", ".json", ".xml")
STANDARD_OUTPUT = "-"


def parse_hsv(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> tuple[HsvRange, ...]:
    """Read colours as `HsvRange.parse` does; a text that it refuses is bad usage."""
    if not texts:
        return ()
    from dloftbs.config import read_colour

    try:
        return read_colour(texts)
    except ConfigError as error:
        raise click.BadParameter(str(error), context, parameter) from error


def parse_roi(context: click.Context, parameter: click.Parameter, text: str | None) -> Roi | None:
    """Read a region of interest as `RegionConfig` does; a text that it refuses is bad usage."""
    if text is None:
        return None
    from dloftbs.config import read_roi

    try:
        return read_roi(text)
    except ConfigError as error:
        raise click.BadParameter(str(error), context, parameter) from error


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


roi_option = click.option(
    "--roi",
    metavar="X,Y,W,H|X,Y:X,Y:X,Y...",
    callback=parse_roi,
    help="Region of interest, in pixels: a rectangle, or the corners of a polygon. The rest of the image is left out, "
    "and a cable ends at its edge as at the image's border; curves stay in pixels of the whole image.",
)


def config_options(command: Command) -> Command:
    """Add the options that choose the configuration; the command gets the `Config` as `config`.

    What comes later in ``--paper``, ``--config``, ``--set``, ``--hsv``, ``--local``, ``--background``, ``--objects``,
    ``--min-confidence``, ``--mask-is``, ``--roi`` overrides what comes before.
    """

    @click.option("--paper", is_flag=True, help="Start from the published method instead of the default.")
    @click.option(
        "--config",
        "config_file",
        type=file_path(),
        metavar="FILE",
        help="Read settings from a YAML file, as `dloftbs config print` writes it; what it leaves out stays as it is.",
    )
    @click.option(
        "--set",
        "changes",
        multiple=True,
        metavar="SECTION.KEY=VALUE",
        callback=parse_changes,
        help="Change one setting, e.g. linking.objects=1; the value is YAML. Repeatable.",
    )
    @click.option(
        "--hsv",
        multiple=True,
        metavar="COLOUR|H0:H1[,S0:S1[,V0:V1]]",
        callback=parse_hsv,
        help="Colour of a cable: a word (red, orange, yellow, green, cyan, blue, purple, magenta, pink, white, grey, "
        "black) or ranges of hue 0..179, saturation and value 0..255, as OpenCV has them. "
        "Hue wraps: 170:10 is red; saturation and value are from 40 on where none are given. Repeatable; "
        "a pixel in any of them is cable.",
    )
    @click.option(
        "--local",
        type=click.Choice(("darker", "brighter")),
        help="Cables are darker, or brighter, than the ground beside them; with a colour as well, a pixel must be "
        "both (--set segmentation.local.join=or: one of them).",
    )
    @click.option(
        "--background",
        type=file_path(),
        metavar="FILE",
        help="Picture of the same place without cables, for a camera that stands still, as `dloftbs background` makes "
        "it: what differs is cable; with a colour as for --local (segmentation.background.join).",
    )
    @click.option(
        "--objects",
        type=click.IntRange(1, MAX_OBJECTS),
        metavar="N",
        help="Number of cables, if it is known: pieces are joined to N objects, and the rest is dropped.",
    )
    @click.option(
        "--branched",
        is_flag=True,
        help="Objects may branch, as wiring harnesses do: where three or more ends meet, they may be one branch point.",
    )
    @click.option(
        "--min-confidence",
        type=click.FloatRange(0.0, 1.0),
        metavar="P",
        help="Least probability of a gap that is bridged, 0.5 where nothing else is stated: pieces with less between "
        "them stay apart, each with the other in its near_joints. 0 bridges all that bend little.",
    )
    @click.option(
        "--mask-is",
        type=click.Choice(("auto", "binary", "probability", "labels")),
        help="Meaning of the values of masks: cable wherever they are not 0 (binary), numbers of objects (labels), or "
        "a probability, as networks give it; auto takes many grey values, nearly all of them sure, for one.",
    )
    @roi_option
    @functools.wraps(command)
    def with_config(
        *args: Any,
        paper: bool,
        config_file: Path | None,
        changes: dict[str, Any],
        hsv: tuple[HsvRange, ...],
        local: str | None,
        background: Path | None,
        objects: int | None,
        branched: bool,
        min_confidence: float | None,
        mask_is: str | None,
        roi: Roi | None,
        **kwargs: Any,
    ) -> None:
        if hsv and click.get_current_context().params.get("kind") == "mask":
            raise click.UsageError(
                "--hsv finds a colour in images, and --kind mask says that there are none: leave out one"
            )
        file = None if background is None else str(background)
        given = {
            "segmentation.local.tone": local,
            "segmentation.background.file": file,
            "linking.objects": objects,
            "linking.branched": branched or None,
            "linking.min_gap_confidence": min_confidence,
            "segmentation.mask_is": mask_is,
            "region.roi": roi,
        }
        changes = {**changes, **{key: value for key, value in given.items() if value is not None}}
        command(*args, config=read_config(paper, config_file, changes, hsv), **kwargs)

    return with_config


def read_config(paper: bool, file: Path | None, changes: dict[str, Any], hsv: tuple[HsvRange, ...]) -> Config:
    """Return the configuration that the options ask for, the later ones overriding the earlier.

    Raises
    ------
    ConfigError
        If the file cannot be read, or a key or a value is wrong.
    """
    import msgspec

    from dloftbs.config import Config

    stated = {} if file is None else stated_in(file)
    # The published method has a form of its own for one cable: without a threshold, unless one is stated, too.
    one = {**stated, **changes}.get("linking.objects") == 1
    config = (Config.paper(objects=1 if one else None) if paper else Config()).replace(stated).replace(changes)
    return msgspec.structs.replace(config, segmentation=config.segmentation.with_hsv(hsv)) if hsv else config


def stated_in(file: Path) -> dict[str, Any]:
    """Return what a file states, by dotted path: what it leaves out is not the default but what came before."""
    from dloftbs.config import Config
    from dloftbs.support.documents import parse_yaml, read_text

    Config.from_file(file)  # whose messages name the file
    (sections,) = parse_yaml(read_text(file)) or ({},)
    return {f"{section}.{key}": value for section, values in sections.items() for key, value in values.items()}


def parse_changes(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, Any]:
    """Read settings as ``SECTION.KEY=VALUE``, the value being YAML; what cannot be read is bad usage."""
    if not texts:
        return {}
    from dloftbs.errors import InputError
    from dloftbs.support.documents import parse_yaml

    changes = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise click.BadParameter(f"expected SECTION.KEY=VALUE, got {text!r}", context, parameter)
        try:
            documents = parse_yaml(value)
        except InputError as error:
            raise click.BadParameter(f"{value!r} is no YAML value: {error}", context, parameter) from error
        if len(documents) > 1:
            raise click.BadParameter(f"expected one value, got {value!r}", context, parameter)
        changes[key.strip()] = documents[0] if documents else None
    return changes


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
        help="Pose of the camera in the world, or the robot's base, YAML: translation_m, and rotation, quaternion_xyzw "
        "or rpy; or a matrix (4, 4). It replaces the camera_pose of the robot's YAML; .usda and .xml are in the world.",
    )
    @functools.wraps(command)
    def with_robot(
        *args: Any,
        robot: str | None,
        joints: str | None,
        camera_pose: str | None,
        inputs: InputOptions,
        **kwargs: Any,
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
        jobs: int = 1,
        keep_messages: bool = False,
    ) -> Source:
        """Open an input with these options; `jobs` and `keep_messages` are those of `sources.open`.

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
            depth=self.depth,
            masks=self.masks,
            occluders=self.occluders,
            instances=self.instances,
            camera=self.camera,
            registration=self.registration,
            depth_unit_m=self.depth_unit_m,
            fps=fps,
            jobs=jobs,
            topic=self.topic,
            depth_topic=self.depth_topic,
            info_topic=self.info_topic,
            mask_topic=self.mask_topic,
            keep_messages=keep_messages,
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
            "--topic", metavar="NAME", help="Topic of the images in a recording of ROS; needed where there are several."
        ),
        click.option("--depth-topic", metavar="NAME", help="Topic of depth in a recording, registered to the images."),
        click.option("--info-topic", metavar="NAME", help="Topic of the images' camera (CameraInfo) in a recording."),
    )
    for option in reversed(options):
        command = option(command)
    return command


def input_options(command: Command) -> Command:
    """Add the options that say how frames are read; the command gets them as `inputs`, an `InputOptions`."""

    @click.option(
        "--kind",
        type=click.Choice(("auto", "image", "mask")),
        default="auto",
        show_default=True,
        help="Kind of the frames. auto: grey image files, and labels in indexed colour, are masks, in which any "
        "non-zero is cable, unless there is a colour to find in them.",
    )
    @click.option(
        "--depth",
        type=FilledPath(),
        metavar="PATH|RULE",
        help='Depth registered to the frames: a file or folder, or a naming rule such as "{stem}_depth.png".',
    )
    @click.option(
        "--masks",
        type=FilledPath(),
        metavar="PATH|RULE",
        help="Masks for the frames, in the same ways, in place of a colour.",
    )
    @click.option(
        "--occluders",
        type=FilledPath(),
        metavar="PATH|RULE",
        help="Masks of what may hide cables (a robot, a hand), in the same ways.",
    )
    @click.option(
        "--instances",
        type=FilledPath(),
        metavar="PATH|RULE",
        help='A mask per object, which says who is who: label images, or "{stem}_mask_*.png" for a file an object, '
        '"{stem}.json" (labelme), "{stem}.txt" (YOLO), coco.json for all frames. In place of a colour.',
    )
    @click.option(
        "--camera",
        type=FilledPath(),
        metavar="FX,FY,CX,CY|FILE",
        help="Intrinsics in pixels, or a calibration (YAML, JSON, XML), lens distortion included; with depth, curves "
        "are in metres too.",
    )
    @click.option(
        "--registration",
        type=FilledPath(),
        metavar="FILE",
        help="Depth is of a camera of its own: YAML or JSON with depth_camera, colour_camera, rotation, translation_m.",
    )
    @click.option(
        "--depth-unit",
        type=click.FloatRange(MIN_DEPTH_UNIT_M, MAX_DEPTH_UNIT_M),
        metavar="METRES",
        help="Metres per unit of integer depth images; default 0.001, millimetres. Floating-point depth is in metres.",
    )
    @topic_options
    @click.option(
        "--mask-topic",
        metavar="NAME",
        help="Topic of the images' masks in a recording, in place of a colour; images without a mask are left out.",
    )
    @functools.wraps(command)
    def with_inputs(
        *args: Any,
        kind: Kind,
        depth: str | None,
        masks: str | None,
        occluders: str | None,
        instances: str | None,
        camera: str | None,
        registration: str | None,
        depth_unit: float | None,
        topic: str | None,
        depth_topic: str | None,
        info_topic: str | None,
        mask_topic: str | None,
        **kwargs: Any,
    ) -> None:
        for option, given in (("--masks", masks), ("--mask-topic", mask_topic)):
            if given is not None and kind == "mask":
                raise click.UsageError(
                    f"{option} goes with images: --kind mask says that the frames are masks themselves"
                )
        if masks is not None and mask_topic is not None:
            raise click.UsageError("--masks and --mask-topic are two sources of masks; leave out one")
        cameras = parse_camera(camera), parse_registration(registration)
        topics = topic, depth_topic, info_topic
        inputs = InputOptions(kind, depth, masks, occluders, *cameras, depth_unit, *topics, instances, mask_topic)
        command(*args, inputs=inputs, **kwargs)

    return with_inputs


def check_data_paths(context: click.Context, parameter: click.Parameter, paths: tuple[str, ...]) -> tuple[str, ...]:
    """Let only names pass that say in which form data are to be written.

    Raises
    ------
    click.BadParameter
        On any other.
    """
    for path in paths:
        if path != STANDARD_OUTPUT and not path.endswith("/") and Path(path).suffix.lower() not in DATA_SUFFIXES:
            expected = f"must end in {', '.join(DATA_SUFFIXES)}, or in / for the folder of a rosbag2"
            raise click.BadParameter(f"{expected}, got {path!r}", context, parameter)
    return paths


def check_pictures(*, video: bool) -> Callable[[click.Context, click.Parameter, str | None], str | None]:
    """Return what lets only the name of a folder or a picture pass, and where `video` says so that of a video."""

    def check(context: click.Context, parameter: click.Parameter, path: str | None) -> str | None:
        if path is None:
            return None
        from dloftbs import sinks

        wanted = (sinks.OverlayImagesSink, sinks.OverlayPictureSink) + (sinks.OverlayVideoSink,) * video
        try:
            kind = sinks.kind_of(path)
        except InputError as error:
            raise click.BadParameter(str(error), context, parameter) from error
        if kind not in wanted or (kind is sinks.OverlayImagesSink and os.path.isfile(path)):
            what = f"a folder, a picture (.png, ...){' or a video (.mp4, .mov)' * video}"
            raise click.BadParameter(f"must be {what}, got {path!r}", context, parameter)
        return path

    return check


def prints_to_terminal(outs: Sequence[str]) -> bool:
    """Return True if results are printed where a person reads them."""
    return STANDARD_OUTPUT in outs and sys.stdout.isatty()


stages_option = click.option(
    "--stages",
    type=FilledPath(),
    metavar="FOLDER|PNG",
    callback=check_pictures(video=False),
    help="Draw a figure of all stages of each frame by itself, in a folder, or in a file for a single one: it shows "
    "where a mask or a curve goes wrong.",
)
with_input_option = click.option(
    "--with-input",
    is_flag=True,
    help="Write the input into recordings of ROS, too, so that one file shows all: the messages of all topics of a "
    "recording of ROS 2 as they are, else images, depth and camera.",
)
limit_option = click.option(
    "--limit", type=click.IntRange(1, MAX_FRAMES), metavar="N", help="Stop after N frames that were used."
)
every_option = click.option(
    "--every",
    type=click.IntRange(1, MAX_FRAMES),
    default=1,
    metavar="N",
    help="Use every Nth frame alone: a quick look at a long video.",
)
fps_option = click.option(
    "--fps",
    type=click.FloatRange(0.01, 1000.0),
    metavar="RATE",
    help="Frames per second of the input, for its stamps; a video of overlays has 30 if nobody says.",
)
out_option = click.option(
    "--out",
    "-o",
    "outs",
    multiple=True,
    type=FilledPath(),
    metavar="FILE",
    callback=check_data_paths,
    help="Write curves to a file: .jsonl, .npz or .csv; in space .ply or .obj, and for simulators .usda (USD) or .xml "
    "(MuJoCo). Write labels for training to .json (COCO: masks) or a folder .labelme (lines). .rrd is for the "
    "viewer of Rerun. A file .mcap, or another folder that ends in /, is a recording of ROS. - is JSON lines on "
    "standard output. Repeatable. The configuration used is written beside the first file, as NAME.config.yaml.",
)
