"""``dloftbs batch``: many recordings, each by itself, in processes."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from dloftbs.cli.limits import MAX_JOBS, FilledPath
from dloftbs.cli.options import InputOptions, config_options, input_options
from dloftbs.cli.shell import BAD_INPUT

if TYPE_CHECKING:
    from dloftbs.cli.batch_job import Job, Outcome
    from dloftbs.config import Config

FORMATS = ("jsonl", "npz", "csv")


@click.command(short_help="Follow the cables through many recordings.")
@click.argument("patterns", metavar="INPUT...", nargs=-1, required=True, type=FilledPath())
@click.option("--out", "-o", required=True, type=FilledPath(), metavar="FOLDER", help="Folder of the results.")
@click.option(
    "--format", "form", type=click.Choice(FORMATS), default="jsonl", show_default=True, help="Form of the results."
)
@click.option("--jobs", type=click.IntRange(1, MAX_JOBS), metavar="N", help="Processes; as many as there are cores.")
@click.option(
    "--shard",
    metavar="I/N",
    help="Work on every Nth input from the Ith on alone: one of N machines; auto takes both from SLURM's variables.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Work on a cluster of dask instead (extra cluster), by its scheduler such as tcp://host:8786.",
)
@input_options
@config_options
@click.pass_context
def batch(
    context: click.Context,
    patterns: tuple[str, ...],
    out: str,
    form: str,
    jobs: int | None,
    shard: str | None,
    scheduler: str | None,
    inputs: InputOptions,
    config: Config,
) -> None:
    """Follow the cables through many recordings, each by itself, in processes of one thread.

    INPUT is a file, a folder or a pattern in quotes, such as 'recordings/**/*.mcap'. Each input has a
    result and a status in the folder of the results. Both appear as a whole: a run that was stopped,
    however, goes on where it was when it is started again, with results that are the same byte for byte.
    What is done already, from the same input with the same settings, is left as it is; what failed is
    tried again. A broken input stops nothing; the exit code is then 1.

    \b
    dloftbs batch 'recordings/**/*.mcap' --config cable.yaml --out results/
    dloftbs batch 'recordings/**/*.mcap' --hsv 170:10 --out results/ --shard auto
    """
    from dloftbs.cli.batch_inputs import list_inputs, of_shard, read_shard
    from dloftbs.cli.batch_job import FAILED, Job, died, finished, run_job
    from dloftbs.cli.batch_report import table
    from dloftbs.cli.cluster import run_on_cluster
    from dloftbs.cli.commands.warmup import load_kernels
    from dloftbs.cli.outputs import config_beside, write_config
    from dloftbs.cli.progress import open_count
    from dloftbs.cli.worker_processes import run_in_processes
    from dloftbs.overlap import cores

    if scheduler is not None and jobs is not None:
        raise click.UsageError("--jobs is a number of processes here; on a cluster its workers are as many as it has")
    if [path for path in inputs.beside if path not in inputs.rules]:
        raise click.UsageError("a batch takes depth, masks and occluders by a rule such as {stem}_depth.png alone")
    given = of_shard(list_inputs(patterns), read_shard(shard, os.environ))
    todo = [Job(one, out, f".{form}", config, inputs) for one in given]
    _check_places(todo)
    write_config(config_beside((out,), config), config)
    outcomes: dict[str, Outcome] = {}
    for job in todo:
        done = finished(job)
        if done is not None:
            outcomes[job.given.path] = replace(done, input=job.given.path)
    kept = len(outcomes)
    left = [job for job in todo if job.given.path not in outcomes]
    if left:
        if scheduler is not None:
            running = run_on_cluster(run_job, died, left, scheduler)
        else:
            load_kernels()  # compiled here, once, and not by each process
            running = run_in_processes(run_job, died, left, min(jobs or cores(), len(left)))
        with open_count("recordings") if sys.stderr.isatty() else _lines() as show:
            for job, outcome in running:
                outcomes[job.given.path] = outcome
                show(len(outcomes), len(todo))
    click.echo(table([outcomes[job.given.path] for job in todo], kept), err=True)
    if any(outcome.state == FAILED or outcome.skipped for outcome in outcomes.values()):
        context.exit(BAD_INPUT)


def _check_places(jobs: Sequence[Job]) -> None:
    """Refuse results that would replace inputs.

    Raises
    ------
    click.UsageError
        If there is one.
    """
    from dloftbs.sinks.sink import identity_of

    known = {identity_of(job.given.path) for job in jobs}
    for place in (place for job in jobs for place in (job.result, job.status)):
        if identity_of(place) in known:
            raise click.UsageError(f"the result {place} would replace an input; choose another --out")


@contextmanager
def _lines() -> Iterator[Callable[[int, int], None]]:
    """Open what tells of each input in a line."""
    yield lambda done, count: click.echo(f"{done} of {count} recordings", err=True)
