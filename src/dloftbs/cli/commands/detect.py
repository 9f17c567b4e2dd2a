"""``dloftbs detect``: images in, curves out."""

from __future__ import annotations

import os
import threading
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.limits import MAX_JOBS, FilledPath
from dloftbs.cli.options import (
    STANDARD_OUTPUT,
    InputOptions,
    check_pictures,
    config_options,
    input_options,
    out_option,
)
from dloftbs.cli.shell import BAD_INPUT, Failure, report_error
from dloftbs.errors import DloftbsError, InputError, SourceError

if TYPE_CHECKING:
    from dloftbs.cli.places import Outputs
    from dloftbs.config import Config
    from dloftbs.frame import Frame
    from dloftbs.pipeline import Pipeline
    from dloftbs.sinks import Sink


@click.command(short_help="Find the cables in images, each by itself.")
@click.argument("where", metavar="INPUT...", nargs=-1, required=True, type=FilledPath())
@out_option
@click.option(
    "--overlay",
    type=FilledPath(),
    metavar="FOLDER|PNG",
    callback=check_pictures(video=False),
    help="Draw the curves over the images, in a folder, or in a file for a single image.",
)
@click.option(
    "--stages",
    type=FilledPath(),
    metavar="FOLDER|PNG",
    callback=check_pictures(video=False),
    help="Draw a figure of all stages of each image, in the same ways.",
)
@click.option(
    "--jobs", "-j", type=click.IntRange(1, MAX_JOBS), metavar="N", help="Threads; as many as there are cores."
)
@input_options
@config_options
@click.pass_context
def detect(
    context: click.Context,
    where: tuple[str, ...],
    outs: tuple[str, ...],
    overlay: str | None,
    stages: str | None,
    jobs: int | None,
    inputs: InputOptions,
    config: Config,
) -> None:
    """Find the cables in images or masks, each by itself.

    INPUT is an image or a mask, a folder, a glob in quotes, or whatever `dloftbs track` takes. Results
    are JSON lines on standard output, one an image, or go to the files of --out. What cannot be read is
    reported, the rest goes on, and the exit code is 1. No result replaces an input: in a folder of inputs,
    pictures are named photo.overlay.png and photo.stages.png.

    \b
    dloftbs detect photo.jpg --hsv 170:10,80:255,60:255 --overlay overlays
    dloftbs detect masks/ --out curves.jsonl --out curves.csv
    """
    _check_usage(where, inputs)
    from dloftbs.cli.outputs import open_outputs, write_config
    from dloftbs.cli.places import InputFiles, plan_outputs
    from dloftbs.overlap import Ahead, cores, in_order
    from dloftbs.pipeline import Pipeline

    class Own(threading.local):  # a pipeline belongs to one thread
        def __init__(self) -> None:
            self.pipeline = Pipeline(config)

    pictures = {"--overlay": overlay, "--stages": stages}
    outputs = plan_outputs(outs or (STANDARD_OUTPUT,), pictures, InputFiles(where, context.params), config)
    own = Own()
    jobs = jobs or cores()
    batch = _Batch(_images(where, inputs), inputs, config, jobs)
    with (
        Ahead(batch.frames()) as read,
        open_outputs(outputs.data, *_pictures(own.pipeline, outputs)) as sink,
    ):
        write_config(outputs.config_file, config)
        with closing(in_order(lambda frame: (frame, own.pipeline.detect(frame)), read, jobs)) as found:
            for frame, result in found:
                sink.write(frame, result)
    if batch.failures:
        context.exit(BAD_INPUT)


def _check_usage(where: Sequence[str], inputs: InputOptions) -> None:
    if len(where) > 1 and inputs.beside != inputs.rules:
        raise click.UsageError(
            'with several inputs, what goes with them must be rules such as --masks "{stem}_mask.png"'
        )


def _pictures(pipeline: Pipeline, outputs: Outputs) -> Iterator[Sink]:
    from dloftbs.cli.outputs import open_pictures

    for option, (path, ending) in outputs.pictures.items():
        if option == "--stages":
            from dloftbs import viz

            yield open_pictures(path, ending, draw=lambda frame, result: viz.draw_stages(pipeline.trace(frame)))
        else:
            yield open_pictures(path, ending)


def _images(where: Sequence[str], inputs: InputOptions) -> list[str]:
    """Return the inputs without those that go with another by a naming rule: shells put both into one glob."""
    from dloftbs.sources.pairing import without_partners

    files = [Path(text) for text in where if os.path.isfile(text)]
    kept = files
    for rule in inputs.rules:
        kept = without_partners(kept, rule)
    partners = set(files) - set(kept)
    images = [text for text in where if Path(text) not in partners]
    if not images:
        raise SourceError(f"every input is the partner of another under {' and '.join(inputs.rules)}")
    return images


class _Batch:
    """The frames of all inputs, one after the other and counted through; what cannot be read is reported."""

    def __init__(self, where: Sequence[str], inputs: InputOptions, config: Config, jobs: int) -> None:
        self._where = where
        self._inputs = inputs
        self._config = config
        self._jobs = jobs
        self._failures: list[int] = []  # of each input; several threads can append

    @property
    def failures(self) -> int:
        """Inputs that could not be read so far."""
        return sum(self._failures)

    def frames(self) -> Generator[Frame, None, None]:
        """Yield all of them; many inputs of a file each are decoded side by side, as are the files of a folder."""
        first = 0
        from dloftbs.overlap import in_order

        with closing(in_order(self._open, self._where, self._jobs)) as opened:
            for frames in opened:
                last = first
                try:
                    if isinstance(frames, Exception):
                        raise frames
                    for frame in frames:
                        last = first + frame.index
                        yield replace(frame, index=last)
                except (InputError, SourceError) as error:
                    report_error(error)
                    self._failures.append(1)
                first = last + 1

    def _open(self, where: str) -> Iterable[Frame] | Exception:
        """Return the frames of an input: an image file is read at once, all else when its turn comes."""
        from dloftbs.sources.image_files import IMAGE_EXTENSIONS

        frames = self._frames(where)
        if Path(where).suffix.lower() not in IMAGE_EXTENSIONS or not os.path.isfile(where):
            return frames
        try:
            return list(frames)
        except (DloftbsError, Failure) as error:
            return error

    def _frames(self, where: str) -> Iterator[Frame]:
        from dloftbs.cli.frames import UsableFrames

        with self._inputs.open(where, jobs=self._jobs) as source:
            frames = UsableFrames(source, self._config, self._inputs)
            try:
                yield from frames
            finally:
                self._failures.append(frames.skipped)
