"""``dloftbs warmup``: the compiled kernels, made ready before they are needed."""

from __future__ import annotations

from time import perf_counter

import click


@click.command(short_help="Compile the kernels, once for this machine.")
def warmup() -> None:
    """Compile the kernels on all cores, if this machine has not done so yet, and load them.

    They are kept on disk. Without this command, the first run compiles them.
    """
    from dloftbs.pipeline.kernel_loading import load_kernels

    since = perf_counter()
    compiled = load_kernels()
    seconds = perf_counter() - since
    what = f"{compiled} kernels compiled, and saved for the next time," if compiled else "all kernels loaded"
    click.echo(f"{what} in {seconds:.1f} s")
