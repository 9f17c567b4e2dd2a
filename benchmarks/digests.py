"""Digests of all results, to the last bit: whether a change that must not change any result does.

Run it in the repository with ``python -m benchmarks.digests [KIND ...]`` to print, as JSON, a digest for every kind of
generated frames and for every method, over more than 10,000 frames in all; with ``--against COMMIT`` to make them of
that commit, too, print where the working tree's differ, and end with 1 if they do. Names may change between the two,
values may not: curves, confidences, widths, joints, what is inferred, crossings, tracks, what is dropped, and why
nothing is found. The frames are each commit's own, with a digest of their own.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import Any

from benchmarks.compare import ROOT, git

RUNNER = Path(__file__).with_name("digests_run.py")

Digests = dict[str, dict[str, Any]]


def main() -> None:
    """Print the digests, or where two commits differ."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", metavar="KIND", nargs="*")
    parser.add_argument("--against", metavar="COMMIT")
    parser.add_argument("--quick", action="store_true", help="few frames, to see that it runs")
    given = parser.parse_args()
    if given.against is None:
        print(json.dumps(dict(digests(ROOT, given.kinds, given.quick)), indent=2))
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "old"
        git("worktree", "add", "--quiet", "--detach", str(folder), given.against)
        try:
            old = dict(digests(folder, given.kinds, given.quick, cache=Path(name) / "cache"))
        finally:
            git("worktree", "remove", "--force", str(folder))
    different = False
    for kind, new in digests(ROOT, given.kinds, given.quick):
        apart = [what for what in new if new[what] != old.get(kind, {}).get(what)]
        different |= bool(apart)
        print(
            f"{kind:<18}{new['frames']:>7} frames  {'differ: ' + '; '.join(apart) if apart else 'the same'}", flush=True
        )
    sys.exit(different)


def digests(
    source: Path, kinds: Sequence[str], quick: bool, *, cache: Path | None = None
) -> Generator[tuple[str, dict[str, Any]], None, None]:
    """Yield the kinds and their digests, as the commit that is checked out in a folder makes them."""
    environment = dict(os.environ, PYTHONPATH=str(source / "src"))
    if cache is not None:
        environment["NUMBA_CACHE_DIR"] = str(cache)
    command = [sys.executable, str(RUNNER), str(source / "src"), "quick" if quick else "all", *kinds]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment, cwd=source) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                found = json.loads(line)
                yield found.pop("kind"), found
        except GeneratorExit:
            process.kill()
            raise
    if process.returncode:
        raise RuntimeError(f"{source}: ended with {process.returncode}")


if __name__ == "__main__":
    main()
