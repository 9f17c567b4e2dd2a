"""Two commits side by side: how long each stage takes, and whether the curves are the same.

Run it in the repository with ``python -m benchmarks.compare OLD [NEW] [--quick]``, commits as git takes them; without
NEW it is the working tree as it is. Both are checked out into a temporary folder and run in processes and with kernel
caches of their own, on the same frames, which the working tree makes. They take turns, a scene at a time, so that a
busy machine slows both alike.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

import msgspec
import numpy as np

from benchmarks.compare_scenes import write_scenes
from benchmarks.timing import Floats

ROOT = Path(__file__).resolve().parents[1]
RUNNER = Path(__file__).with_name("compare_run.py")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old", metavar="OLD")
    parser.add_argument("new", metavar="NEW", nargs="?")
    parser.add_argument("--quick", action="store_true", help="few frames and rounds, to see that it runs")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        scenes = write_scenes(folder / "scenes", quick=given.quick)
        old = stack.enter_context(open_run(given.old, folder / "old", folder / "scenes"))
        new = stack.enter_context(open_run(given.new, folder / "new", folder / "scenes"))
        print(f"old: {old.name}\nnew: {new.name}\n")
        for scene in scenes:  # both compile their kernels, and warm up
            results = [run.ask(f"curves {scene}") for run in (old, new)]
            print(f"{scene:<32}{difference(*results)}", flush=True)
        print()
        compare_times(old, new, scenes, rounds=3 if given.quick else 21)


class Run:
    """A commit in a process of its own, which answers what it is asked."""

    def __init__(self, name: str, source: Path, cache: Path, scenes: Path) -> None:
        self.name = name
        environment = dict(os.environ, PYTHONPATH=str(source / "src"), NUMBA_CACHE_DIR=str(cache))
        command = [sys.executable, str(RUNNER), str(scenes), str(source / "src")]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment, cwd=source
        )

    def ask(self, what: str) -> Any:
        """Ask a question and return the answer."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(what + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise RuntimeError(f"{self.name}: ended with {self._process.wait()} over {what!r}")
        return msgspec.json.decode(answer)

    def __enter__(self) -> Run:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.communicate()


@contextmanager
def open_run(commit: str | None, folder: Path, scenes: Path) -> Iterator[Run]:
    """Check a commit out and start it; the working tree is run where it is."""
    cache = folder.with_name(f"{folder.name}-cache")
    if commit is None:
        with Run("the working tree", ROOT, cache, scenes) as run:
            yield run
        return
    git("worktree", "add", "--quiet", "--detach", str(folder), commit)
    try:
        with Run(git("log", "-1", "--format=%h %s", commit), folder, cache, scenes) as run:
            yield run
    finally:
        git("worktree", "remove", "--force", str(folder))


def git(*arguments: str) -> str:
    """Run git in the repository and return what it prints."""
    done = subprocess.run(["git", "-C", str(ROOT), *arguments], check=True, stdout=subprocess.PIPE, text=True)
    return done.stdout.strip()


def difference(old: dict[str, Any], new: dict[str, Any]) -> str:
    """Say whether two lists of frames with their curves are the same, and how far apart they are if not."""
    if old["digest"] == new["digest"]:
        return f"the same, bit for bit: {len(old['frames'])} frames"
    numbers, ids, apart = 0, 0, 0.0
    for one, other in zip(old["frames"], new["frames"], strict=True):
        if [len(curve) for curve in one["curves"]] != [len(curve) for curve in other["curves"]]:
            numbers += 1
        elif one["curves"]:
            apart = max(apart, float(np.abs(np.array(one["curves"]) - np.array(other["curves"])).max()))
        ids += one["tracks"] != other["tracks"]
    parts = [f"curves differ by {apart:.2g} px at most"] if apart else []
    parts += [f"{numbers} frames have another number of curves"] if numbers else []
    parts += [f"{ids} frames have other tracks"] if ids else []
    return f"of {len(old['frames'])} frames: {', '.join(parts) or 'the curves are the same, other figures are not'}"


def compare_times(old: Run, new: Run, scenes: Sequence[str], rounds: int) -> None:
    """Print the medians of all stages, scene by scene, and the mean ratio of each stage over the scenes."""
    ratios: dict[str, list[float]] = {}
    for scene in scenes:
        times: list[dict[str, list[float]]] = [{}, {}]
        for turn in range(rounds):
            for number, run in ((0, old), (1, new)) if turn % 2 else ((1, new), (0, old)):
                for stage, milliseconds in run.ask(f"times {scene}").items():
                    times[number].setdefault(stage, []).extend(milliseconds)
        before, after = ({stage: np.array(ms) for stage, ms in run.items()} for run in times)
        print(f"{scene:<32}{'old ms':>9}{'new ms':>9}{'new / old':>11}{'old p99':>9}{'new p99':>9}")
        for stage in [*dict.fromkeys([*before, *after])]:
            print(stage_row(stage, before.get(stage), after.get(stage)))
            if stage in before and stage in after:
                ratios.setdefault(stage, []).append(float(np.median(after[stage]) / np.median(before[stage])))
        print(flush=True)
    print(f"{'all scenes, geometric mean':<50}{'new / old':>11}")
    for stage, values in ratios.items():
        print(f"  {stage:<48}{np.exp(np.mean(np.log(values))):>11.3f}")


def stage_row(stage: str, old: Floats | None, new: Floats | None) -> str:
    """Return a row of the table; a stage may be new, or gone."""
    figures = [(np.nan, np.nan) if times is None else np.percentile(times, (50, 99)) for times in (old, new)]
    (old_50, old_99), (new_50, new_99) = figures
    return f"  {stage:<30}{old_50:>9.3f}{new_50:>9.3f}{new_50 / old_50:>11.3f}{old_99:>9.3f}{new_99:>9.3f}"


if __name__ == "__main__":
    main()
