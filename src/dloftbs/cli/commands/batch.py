"""``dloftbs batch``: many inputs, each by itself, in processes or on a cluster."""

from __future__ import annotations

import logging
import os
from collections import Counter
from collections.abc import Generator, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import click

from dloftbs.cli.config_options import config_options
from dloftbs.cli.help_sections import SectionedCommand
from dloftbs.cli.input_options import InputOptions, every_option, fps_option, input_options, limit_option
from dloftbs.cli.limits import MAX_JOBS, FilledPath, file_path
from dloftbs.cli.shell import BAD_INPUT, interrupted
from dloftbs.errors import InputError, SinkError

if TYPE_CHECKING:
    from dloftbs.cli.batch.batch_report import BatchReport
    from dloftbs.cli.batch.input_list import BatchInput
    from dloftbs.cli.batch.settings import BatchSettings
    from dloftbs.cli.batch.shards import Shard
    from dloftbs.cli.batch.status_file import Event, Status
    from dloftbs.config import Config

FORMATS = ("jsonl", "npz", "csv")
"""Forms of results that are one file an input, whatever is in it."""

_log = logging.getLogger("dloftbs.cli")


def parse_shard(context: click.Context, parameter: click.Parameter, text: str | None) -> Shard:
    """Read a share such as ``2/8``, or that of SLURM's task; anything else is bad usage."""
    from dloftbs.cli.batch.shards import Shard, read_shard

    try:
        return Shard() if text is None else read_shard(text, os.environ)
    except InputError as error:
        raise click.BadParameter(str(error), context, parameter) from error


@click.command(cls=SectionedCommand, short_help="Follow the cables through many streams, each by itself.")
@click.argument("where", metavar="INPUT...", nargs=-1, required=True, type=FilledPath())
@click.option(
    "--out",
    "-o",
    type=file_path(file_okay=False),
    required=True,
    metavar="FOLDER",
    help="Folder of the results: for each input a file of curves and a NAME.status.json.",
)
@click.option(
    "--format", "form", type=click.Choice(FORMATS), default="jsonl", show_default=True, help="Format of the curves."
)
@click.option(
    "--jobs", "-j", type=click.IntRange(1, MAX_JOBS), metavar="N", help="Number of processes. Default: one per core."
)
@click.option(
    "--shard",
    metavar="I/N|auto",
    callback=parse_shard,
    help="Process only the I-th of N equal shares of the inputs. auto: the share of this task of a SLURM array.",
)
@click.option(
    "--scheduler",
    type=FilledPath(),
    metavar="ADDRESS",
    help="Work on a dask cluster, such as tcp://10.0.0.1:8786. Its workers must see the same files (extra cluster).",
)
@click.option(
    "--retry-failed", is_flag=True, help="Repeat inputs that failed, or were read only in part, in an earlier run."
)
@limit_option
@every_option
@fps_option
@input_options
@config_options
@click.pass_context
def batch(
    context: click.Context,
    where: tuple[str, ...],
    out: Path,
    form: str,
    jobs: int | None,
    shard: Shard,
    scheduler: str | None,
    retry_failed: bool,
    limit: int | None,
    every: int,
    fps: float | None,
    inputs: InputOptions,
    config: Config,
) -> None:
    """Follow the cables through many streams, each by itself, with the results of `dloftbs track`.

    INPUT is a file, a folder, or a glob in quotes. Each file, folder or match is one stream, as for `dloftbs track`.
    Results have the names and folders of the inputs, below their common folder. Each process works on one input,
    with one thread. If an input cannot be read, or its process dies, it is reported, the others
    continue, and the exit code is 1.

    The same command resumes after any stop. Finished inputs are skipped, unless the input, a setting or the version
    has changed. Failed inputs are repeated with --retry-failed. Results are put in place as a whole, and are the
    same, byte for byte, however often the command was stopped. Ctrl-C ends it with exit code 130.

    \b
    dloftbs batch 'recordings/**/*.mp4' --config cable.yaml --out results --jobs 4
    dloftbs batch 'recordings/*/' --hsv 170:10 --out results --shard auto
    """
    from dloftbs.cli.batch.batch_report import BatchReport
    from dloftbs.cli.batch.input_list import list_inputs
    from dloftbs.cli.batch.settings import BatchSettings
    from dloftbs.cli.followed_stream import StreamOptions
    from dloftbs.cli.places import READING

    if inputs.beside != inputs.rules:
        raise click.UsageError('in a batch, what goes with frames must be rules such as --masks "{stem}_mask.png"')
    if scheduler is not None and jobs is not None:
        raise click.UsageError("--jobs goes with the processes of this machine, not with --scheduler")
    settings = BatchSettings(StreamOptions(inputs, config, fps, every, limit), f".{form}", retry_failed)
    read = [Path(str(context.params[name])) for name in READING if context.params.get(name) is not None]
    items = shard.of(list_inputs(where, out, settings.suffix, read))
    known, left = _what_is_left(items, settings)
    _write_config(out, config)
    report = BatchReport(len(items), known)
    try:
        if left:
            _run(left, settings, report, jobs, scheduler)
    finally:
        report.print_table()
        click.echo(report.summary(), err=True)
    if not report.is_good:
        context.exit(BAD_INPUT)


def _write_config(out: Path, config: Config) -> None:
    """Write the configuration into the folder of the results; other shards may be about to do the same."""
    from dloftbs.cli.outputs import config_beside, write_config
    from dloftbs.support.claims import Claim
    from dloftbs.support.safe_files import sink_errors

    target = config_beside([str(out / "batch")], config)
    if target is None:
        return
    with sink_errors(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            claim = Claim(target)
        except SinkError:  # another shard writes it at this very moment
            return
        with claim:
            write_config(target, config)


def _what_is_left(items: Sequence[BatchInput], settings: BatchSettings) -> tuple[list[Status], list[BatchInput]]:
    """Return what became of the inputs that are done, and those that are to be done; say why some are again."""
    from dloftbs.cli.batch.status_file import read_status, reason_to_run

    known, left = [], []
    reasons: Counter[str] = Counter()
    for item in items:
        status = read_status(item)
        why = reason_to_run(item, settings, status)
        if status is not None and why is None:
            known.append(status)
        else:
            left.append(item)
            reasons[why or ""] += status is not None
    for why, count in sorted((+reasons).items()):
        click.echo(f"{count} of {len(items)} inputs are done again: {why}", err=True)
    return known, left


def _run(
    items: Sequence[BatchInput], settings: BatchSettings, report: BatchReport, jobs: int | None, scheduler: str | None
) -> None:
    from dloftbs.cli.batch.batch_report import reason
    from dloftbs.cli.batch.status_file import State
    from dloftbs.cli.progress import open_progress

    with (
        open_progress(shares_terminal=False) as progress,
        interrupted() as stop,
        closing(_events(items, settings, jobs, scheduler)) as events,
    ):
        for event in events:
            report.add(event)
            if event.status is not None and event.status.state is not State.DONE:
                _log.warning("%s: %s: %s", event.status.state.value, event.status.input, reason(event.status))
            progress.tick(report)
            if stop():
                raise KeyboardInterrupt


def _events(
    items: Sequence[BatchInput], settings: BatchSettings, jobs: int | None, scheduler: str | None
) -> Generator[Event, None, None]:
    if scheduler is not None:
        from dloftbs.cli.batch.dask_cluster import in_cluster

        return in_cluster(items, settings, scheduler)
    from dloftbs.cli.batch.worker_pool import in_processes
    from dloftbs.support.overlap import cores

    return in_processes(items, settings, jobs or cores())
