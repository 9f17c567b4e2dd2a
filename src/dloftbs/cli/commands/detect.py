"""``dloftbs detect``: images in, curves out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.options import STANDARD_OUTPUT, InputOptions, check_folder, config_options, input_options, out_option
from dloftbs.cli.shell import BAD_INPUT, report_error
from dloftbs.errors import InputError, SourceError

if TYPE_CHECKING:
    from dloftbs.config import Config
    from dloftbs.frame import Frame
    from dloftbs.pipeline import Pipeline
    from dloftbs.sinks import Sink


@click.command(short_help="Find the cables in images, each by itself.")
@click.argument("where", metavar="INPUT...", nargs=-1, required=True)
@out_option
@click.option("--overlay", metavar="FOLDER", callback=check_folder, help="Draw the curves over the images.")
@click.option("--stages", metavar="FOLDER", callback=check_folder, help="Draw a figure of all stages of each image.")
@input_options
@config_options
@click.pass_context
def detect(
    context: click.Context,
    where: tuple[str, ...],
    outs: tuple[str, ...],
    overlay: str | None,
    stages: str | None,
    inputs: InputOptions,
    config: Config,
) -> None:
    """Find the cables in images or masks, each by itself.

    INPUT is an image or a mask, a folder, a glob in quotes, or whatever `dloftbs track` takes. Results
    are JSON lines on standard output, one an image, or go to the files of --out. What cannot be read is
    reported, the rest goes on, and the exit code is 1.

    \b
    dloftbs detect photo.jpg --hsv 170:10,80:255,60:255 --overlay overlays
    dloftbs detect masks/ --out curves.jsonl --out curves.csv
    """
    _check_usage(where, overlay, stages, inputs)
    from dloftbs.cli.outputs import open_outputs, write_config_beside
    from dloftbs.pipeline import Pipeline

    pipeline = Pipeline(config)
    batch = _Batch(_images(where, inputs), inputs, config)
    with open_outputs(outs or (STANDARD_OUTPUT,), *_pictures(pipeline, overlay, stages)) as sink:
        write_config_beside((*outs, overlay, stages), config)
        for frame in batch:
            sink.write(frame, pipeline.detect(frame))
    if batch.failures:
        context.exit(BAD_INPUT)


def _check_usage(where: Sequence[str], overlay: str | None, stages: str | None, inputs: InputOptions) -> None:
    if overlay is not None and stages is not None and Path(overlay).resolve() == Path(stages).resolve():
        raise click.UsageError("--overlay and --stages must be two folders: their pictures have the same names")
    if len(where) > 1 and any(path not in inputs.rules for path in (inputs.depth, inputs.masks) if path is not None):
        raise click.UsageError('with several inputs, --depth and --masks must be rules such as "{stem}_mask.png"')


def _pictures(pipeline: Pipeline, overlay: str | None, stages: str | None) -> Iterator[Sink]:
    from dloftbs.sinks import OverlayImagesSink

    if overlay is not None:
        yield OverlayImagesSink(overlay)
    if stages is not None:
        from dloftbs import viz

        yield OverlayImagesSink(stages, draw=lambda frame, result: viz.draw_stages(pipeline.trace(frame)))


def _images(where: Sequence[str], inputs: InputOptions) -> list[str]:
    """Return the inputs without those that go with another by a naming rule: shells put both into one glob."""
    from dloftbs.sources.pairing import without_partners

    files = [Path(text) for text in where if Path(text).is_file()]
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

    def __init__(self, where: Sequence[str], inputs: InputOptions, config: Config) -> None:
        self.failures = 0
        self._where = where
        self._inputs = inputs
        self._config = config

    def __iter__(self) -> Iterator[Frame]:
        first = 0
        for where in self._where:
            last = first
            try:
                for frame in self._frames(where):
                    last = first + frame.index
                    yield replace(frame, index=last)
            except (InputError, SourceError) as error:
                report_error(error)
                self.failures += 1
            first = last + 1

    def _frames(self, where: str) -> Iterator[Frame]:
        from dloftbs.cli.frames import UsableFrames

        with self._inputs.open(where, self._config) as source:
            frames = UsableFrames(source, self._config, self._inputs)
            try:
                yield from frames
            finally:
                self.failures += frames.skipped
