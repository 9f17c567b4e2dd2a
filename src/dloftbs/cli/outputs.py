"""Outputs that the options name, with the configuration written beside them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from dloftbs import sinks
from dloftbs._version import __version__
from dloftbs.cli.answer_options import NO_ANSWERS, Answers
from dloftbs.cli.output_options import STANDARD_OUTPUT
from dloftbs.config import Config, LinkingConfig
from dloftbs.data.answers import with_answers
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import ConfigError, SinkError
from dloftbs.pipeline import Pipeline
from dloftbs.sinks import MultiSink, Sink
from dloftbs.support.arrays import FloatArray
from dloftbs.support.json_text import encode_line
from dloftbs.support.safe_files import sink_errors, write_whole
from dloftbs.support.text import readable

_SIGNATURE = "# The configuration of dloftbs"


class StandardOutput(Sink):
    """Prints `FrameResult.to_dict` of each frame, with the answers asked for, as one line of JSON."""

    def __init__(self, kinds: Sequence[str] = ()) -> None:
        self._kinds = kinds

    def write(self, frame: Frame, result: FrameResult) -> None:
        """Print a frame's line."""
        click.echo(encode_line(with_answers(result, self._kinds)), nl=False)

    def close(self) -> None:
        """Every line is out already."""


class _ConfigSink(Sink):
    """Writes the configuration with the first frame, as the results: what lies there belongs to older ones."""

    def __init__(self, target: Path, config: Config) -> None:
        self._target: Path | None = target
        self._config = config

    def write(self, frame: Frame, result: FrameResult) -> None:
        """Write the configuration, once."""
        write_config(self._target, self._config)
        self._target = None

    def close(self) -> None:
        """There is nothing to close."""


def open_outputs(
    paths: Sequence[str],
    *more: Sink,
    with_input: bool = False,
    pose: FloatArray | None = None,
    answers: Answers = NO_ANSWERS,
    config: Config | None = None,
    config_file: Path | None = None,
) -> MultiSink:
    """Open a sink for each path, ``"-"`` being standard output, and gather them with those that are open already.

    Recordings of ROS hold the input, too, where `with_input` says so. Scenes for simulators are in the world in which
    the camera has a `pose`. Tables have columns for branches where objects branch by the `config`, which is written to
    `config_file`, as `config_beside` gave it, with the first frame.

    Raises
    ------
    InputError, SinkError
        As `dloftbs.sinks.open` and `MultiSink`; then all are closed.
    """
    branched = config is not None and isinstance(config.linking, LinkingConfig) and config.linking.branched
    with ExitStack() as stack:
        opened = [stack.enter_context(sink) for sink in more]
        for path in paths:
            opened.append(stack.enter_context(_open_data(path, with_input, pose, answers, branched)))
        if config is not None and config_file is not None:
            opened.append(_ConfigSink(config_file, config))
        together = MultiSink(opened)
        stack.pop_all()
    return together


def is_recording(path: str) -> bool:
    """Return True for an output that is a recording of ROS: a file, or a folder."""
    suffix = Path(path).suffix.lower()
    return suffix == sinks.BAG_SUFFIX or (path.endswith("/") and suffix != sinks.LABELME_SUFFIX)


def _open_data(path: str, with_input: bool, pose: FloatArray | None, answers: Answers, branched: bool) -> Sink:
    if path == STANDARD_OUTPUT:
        return StandardOutput(answers.kinds)
    if not is_recording(path):
        kind = sinks.kind_of(path)
        if kind is sinks.JsonLinesSink:
            return sinks.JsonLinesSink(path, answers.kinds)
        if kind is sinks.CsvSink:
            return sinks.CsvSink(path, bends=answers.limit is not None, branches=branched)
        return sinks.open(path, pose=pose) if kind in (sinks.UsdSink, sinks.MujocoSink) else sinks.open(path)
    from dloftbs.ros import BagSink

    return BagSink(path, with_input=with_input, bend_limit=answers.limit)


def open_pictures(path: str, ending: str, **options: Any) -> Sink:
    """Open a sink for drawn frames: a video, a picture, or a folder in which the names of pictures end in `ending`.

    Raises
    ------
    InputError, SinkError
        As `dloftbs.sinks.open`.
    """
    kind = sinks.kind_of(path)
    if kind is sinks.OverlayImagesSink:
        options["ending"] = ending
    if kind is not sinks.OverlayVideoSink:
        options.pop("fps", None)
    return sinks.open(path, **options)


def open_all_pictures(
    pictures: Mapping[str, tuple[str, str]],
    pipeline: Pipeline,
    *,
    fps: float | None = 30.0,
    answers: Answers = NO_ANSWERS,
) -> Iterator[Sink]:
    """Open the sinks for drawn frames one after the other, as `Outputs.pictures` has them.

    Parameters
    ----------
    pictures : mapping of str to (str, str)
    pipeline : Pipeline
        Draws the stages; used by whoever writes to the sinks, and nobody else.
    fps : float or None
        Of a video, as `OverlayVideoSink` has it.
    answers : Answers
        Answers that overlays show.

    Raises
    ------
    InputError, SinkError
        As `dloftbs.sinks.open`.
    """
    drawn = {} if answers.draw is None else {"draw": answers.draw}
    for option, (path, ending) in pictures.items():
        if option == "--stages":
            from dloftbs import viz

            yield open_pictures(path, ending, draw=lambda frame, _: viz.draw_stages(pipeline.trace(frame)))
        else:
            yield open_pictures(path, ending, fps=fps, **drawn)


def config_beside(paths: Sequence[str | None], config: Config) -> Path | None:
    """Return the file for the configuration beside the first path that is a file or a folder: ``NAME.config.yaml``.

    None where there is no such path, or the file says the same already.

    Raises
    ------
    SinkError
        If there is a file that `write_config` did not write, or the path has no name.
    """
    first = next((path for path in paths if path not in (None, STANDARD_OUTPUT)), None)
    if first is None:
        return None
    beside = Path(os.path.realpath(first))
    if not beside.name:
        raise SinkError(f"cannot write {str(first)!r}: it is the root of all folders; name a file or a folder in it")
    target = beside.with_name(f"{beside.stem}.config.yaml")
    if _says(target, config):
        return None
    with sink_errors(target):
        if target.exists() and not target.read_text("utf-8", "replace").startswith(_SIGNATURE):
            raise SinkError(
                f"{target} is not by dloftbs and says something else than the configuration used: "
                "it is not replaced; choose another name for the results"
            )
    return target


def write_config(target: Path | None, config: Config) -> None:
    """Write the configuration to the file that `config_beside` gave.

    Raises
    ------
    SinkError
        If it cannot be written.
    """
    if target is None:
        return
    results = readable(target.name.removesuffix(".config.yaml"))
    write_whole(target, f"{_SIGNATURE} {__version__} for {results}\n{config.to_yaml()}".encode())


def _says(file: Path, config: Config) -> bool:
    try:
        return Config.from_file(file) == config
    except ConfigError:  # missing, or no configuration
        return False
