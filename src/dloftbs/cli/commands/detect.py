"""``dloftbs detect``: images in, curves out."""

from __future__ import annotations

import os
import threading
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.answer_options import Answers, answer_options
from dloftbs.cli.config_options import config_options
from dloftbs.cli.help_sections import SectionedCommand
from dloftbs.cli.input_options import InputOptions, every_option, input_options, limit_option
from dloftbs.cli.limits import MAX_JOBS, FilledPath
from dloftbs.cli.output_options import STANDARD_OUTPUT, check_pictures, out_option, prints_to_terminal, stages_option
from dloftbs.cli.shell import BAD_INPUT, Failure, report_error
from dloftbs.errors import DloftbsError, InputError, SourceError

if TYPE_CHECKING:
    from dloftbs.config import Config
    from dloftbs.data.frame import Frame


@click.command(cls=SectionedCommand, short_help="Find the cables in images, each by itself.")
@click.argument("where", metavar="INPUT...", nargs=-1, required=True, type=FilledPath())
@out_option
@click.option(
    "--overlay",
    type=FilledPath(),
    metavar="FOLDER|PNG",
    callback=check_pictures(video=False),
    help="Draw the curves over the images: into a folder, or into a file for a single image.",
)
@stages_option
@limit_option
@every_option
@click.option(
    "--jobs", "-j", type=click.IntRange(1, MAX_JOBS), metavar="N", help="Number of threads. Default: one per core."
)
@answer_options
@input_options
@config_options
@click.pass_context
def detect(
    context: click.Context,
    where: tuple[str, ...],
    outs: tuple[str, ...],
    overlay: str | None,
    stages: str | None,
    limit: int | None,
    every: int,
    jobs: int | None,
    answers: Answers,
    inputs: InputOptions,
    config: Config,
) -> None:
    """Find the cables in images or masks, each by itself.

    INPUT is an image, a mask, a folder, a glob, - for standard input, or any input of `dloftbs track`.

    Without --out, --overlay and --stages, results are JSON lines on standard output, one per image; --out - prints
    them beside other outputs. Progress and a summary go to standard error. Images that cannot be read are
    reported and skipped, and the exit code is 1. No result replaces an input: in a folder of inputs, pictures are
    named photo.overlay.png and photo.stages.png.

    \b
    dloftbs detect photo.jpg --hsv 170:10,80:255,60:255 --overlay overlays
    dloftbs detect masks/ --out curves.jsonl --out curves.csv
    """
    _check_usage(where, inputs)
    from dloftbs.cli.frames import without_partners
    from dloftbs.cli.outputs import open_all_pictures, open_outputs
    from dloftbs.cli.places import InputFiles, plan_outputs
    from dloftbs.cli.progress import open_progress
    from dloftbs.cli.stream_report import RunReport
    from dloftbs.pipeline import Pipeline
    from dloftbs.support.overlap import Ahead, cores, in_order

    class Own(threading.local):  # a pipeline belongs to one thread
        def __init__(self) -> None:
            self.pipeline = Pipeline(config)

    if not outs and overlay is None and stages is None:
        outs = (STANDARD_OUTPUT,)
    answers.check(outs)
    pictures = {"--overlay": overlay, "--stages": stages}
    outputs = plan_outputs(outs, pictures, InputFiles(where, context.params), config, is_one=limit == 1)
    own = Own()
    jobs = jobs or cores()
    batch = _Batch(without_partners(where, inputs), inputs, config, jobs, every)
    report = RunReport(tracked=False)
    with (
        Ahead(batch.frames(limit)) as read,
        open_outputs(
            outputs.data,
            *open_all_pictures(outputs.pictures, own.pipeline, answers=answers),
            answers=answers,
            config=config,
            config_file=outputs.config_file,
        ) as sink,
        open_progress(shares_terminal=prints_to_terminal(outs)) as progress,
        closing(in_order(lambda frame: (frame, own.pipeline.detect(frame)), read, jobs)) as found,
    ):
        for frame, result in found:
            answers.warn(result)
            sink.write(frame, result)
            report.length, report.skipped = batch.length(limit), batch.failures
            report.add(result)
            progress.tick(report)
    report.skipped = batch.failures
    if report.frames > 1:
        click.echo(report.summary(), err=True)
    elif report.frames:
        for line in report.outcome(printed="-" in outputs.data):
            click.echo(line, err=True)
    answers.check_compared()
    if batch.failures:
        context.exit(BAD_INPUT)


def _check_usage(where: Sequence[str], inputs: InputOptions) -> None:
    if len(where) > 1 and inputs.beside != inputs.rules:
        raise click.UsageError(
            'with several inputs, what goes with them must be rules such as --masks "{stem}_mask.png"'
        )


class _Batch:
    """The frames of all inputs, one after the other and counted through; what cannot be read is reported."""

    def __init__(self, where: Sequence[str], inputs: InputOptions, config: Config, jobs: int, every: int) -> None:
        self._where = where
        self._inputs = inputs
        self._config = config
        self._jobs = jobs
        self._every = every
        self._names = _names_in(where)
        self._failures: list[int] = []  # of each input; several threads can append
        self._lengths: list[int | None] = []  # of the inputs that were opened, in the same way
        self._counts: dict[int, int] = {}  # of frames, skipped ones included, by the place of the input

    @property
    def failures(self) -> int:
        """Inputs that could not be read so far."""
        return sum(self._failures)

    def length(self, limit: int | None) -> int | None:
        """Return the number of frames to come in all, as far as it is known by now."""
        known = [n for n in self._lengths if n is not None]
        if len(known) < len(self._lengths):
            return limit
        images = sum(known) + len(self._where) - len(known)  # an input that is yet to be opened is one image, mostly
        return min(n for n in (-(-images // self._every), limit) if n is not None)

    def frames(self, limit: int | None) -> Generator[Frame, None, None]:
        """Yield the wanted ones; many inputs of a file each are decoded side by side, as are the files of a folder."""
        with closing(self._all()) as frames:
            yield from islice((frame for frame in frames if frame.index % self._every == 0), limit)

    def _all(self) -> Generator[Frame, None, None]:
        first = 0
        from dloftbs.support.overlap import in_order

        with closing(in_order(self._open, list(enumerate(self._where)), self._jobs)) as opened:
            for place, (where, frames) in enumerate(zip(self._where, opened, strict=True)):
                names = self._names.get(where, {})
                try:
                    if isinstance(frames, Exception):
                        raise frames
                    for frame in frames:
                        yield replace(frame, index=first + frame.index, name=_name_among(names, frame.name))
                except (InputError, SourceError) as error:
                    report_error(error)
                    self._failures.append(1)
                first += max(self._counts.get(place, 0), 1)

    def _open(self, numbered: tuple[int, str]) -> Iterable[Frame] | Exception:
        """Return the frames of an input: an image is read at once, an animation and all else when its turn comes."""
        from dloftbs.sources.image_files import IMAGE_EXTENSIONS

        place, where = numbered
        frames = self._frames(place, where)
        if Path(where).suffix.lower() not in IMAGE_EXTENSIONS or not os.path.isfile(where):
            return frames
        try:
            first = list(islice(frames, 2))
            return first if len(first) < 2 else chain(first, frames)
        except (DloftbsError, Failure) as error:
            return error

    def _frames(self, place: int, where: str) -> Iterator[Frame]:
        from dloftbs.cli.frames import UsableFrames

        cable = self._config.segmentation
        with self._inputs.open(where, segmented=cable.needs_image, mask_is=cable.mask_is, jobs=self._jobs) as source:
            self._lengths.append(source.length)
            frames = UsableFrames(source, self._config, self._inputs, where)
            count = 0
            try:
                for frame in frames:
                    count += 1
                    yield frame
            finally:
                self._failures.append(frames.skipped)
                self._counts[place] = source.exact_length or count + frames.skipped


def _names_in(where: Sequence[str]) -> dict[str, dict[str, str]]:
    """Return for each input by what name each of its files is known among all inputs, where that is another."""
    from dloftbs.sources.image_files import IMAGE_EXTENSIONS, files_of, frame_names
    from dloftbs.sources.standard_input import STANDARD_INPUT

    groups = {text: files_of(text, IMAGE_EXTENSIONS) for text in where if text != STANDARD_INPUT}
    among_all = iter(frame_names([path for group in groups.values() for path in group]))
    return {text: dict(zip(frame_names(group), among_all, strict=False)) for text, group in groups.items()}


def _name_among(names: Mapping[str, str], name: str) -> str:
    """Return the name of a frame among all inputs, also of one of a video or a stack: ``cable.mp4#12``."""
    file, mark, number = name.rpartition("#")
    return names.get(name) or (f"{names[file]}{mark}{number}" if file in names else name)
