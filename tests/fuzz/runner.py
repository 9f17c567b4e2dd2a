"""Has cases run by a worker, and says what was found and how to see it again."""

from __future__ import annotations

import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from fuzz.family import Family

TESTS = Path(__file__).resolve().parents[1]
CASE_WALL_S = 600.0
"""Time that a case may take at most, on however busy a machine; what computes is ended by its CPU time long before."""


@dataclass(frozen=True)
class Outcome:
    """What became of a case.

    Parameters
    ----------
    family : str
    seed, number : int
    error : str or None
        The type of what was raised, ``Killed`` where the process died; None where nothing was found.
    text : str
        The traceback, or the last words of the process.
    cpu_s : float
        CPU time.
    """

    family: str
    seed: int
    number: int
    error: str | None
    text: str
    cpu_s: float

    @property
    def command(self) -> str:
        """The command that runs the case again."""
        return f"make fuzz FAMILY={self.family} SEED={self.seed} CASE={self.number}"

    def __str__(self) -> str:
        return f"{self.command}\n{self.text}"


class Runner:
    """A worker, and a new one whenever it dies.

    Parameters
    ----------
    findings : Path, optional
        A folder, into which what was found is written.
    """

    def __init__(self, findings: Path | None = None) -> None:
        self._findings = findings
        self._scratch = Path(tempfile.mkdtemp(prefix="dloftbs-fuzz-"))
        self._worker: subprocess.Popen[str] | None = None
        self._log: IO[str] | None = None

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()
        shutil.rmtree(self._scratch, ignore_errors=True)

    def run(self, family: Family, seed: int, number: int) -> Outcome:
        """Run a case in an empty folder."""
        folder = self._scratch / f"{family.name}-{seed}-{number}"
        folder.mkdir()
        request = {"family": family.name, "seed": seed, "number": number, "folder": str(folder)}
        outcome = Outcome(family.name, seed, number, **self._ask(request))
        if outcome.error is not None and self._findings is not None:
            self._keep(outcome, folder)
        shutil.rmtree(folder, ignore_errors=True)
        return outcome

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        worker = self._started()
        assert worker.stdin is not None
        assert worker.stdout is not None
        worker.stdin.write(json.dumps(request) + "\n")
        worker.stdin.flush()
        ready, _, _ = select.select([worker.stdout], [], [], CASE_WALL_S)
        if not ready:
            worker.send_signal(signal.SIGABRT)  # faulthandler says where it stands
        line = worker.stdout.readline()
        if line:
            return dict(json.loads(line))
        code, words = worker.wait(), self._last_words()
        self._end()
        why = f"the process ended with {code}" + ("" if ready else f" after {CASE_WALL_S:.0f} s without an answer")
        return {"error": "Killed", "text": f"{why}\n{words}", "cpu_s": 0.0}

    def _started(self) -> subprocess.Popen[str]:
        if self._worker is None:
            # Helpers of the tests and the package are found by the path, as pytest finds them.
            places = [str(TESTS), str(TESTS.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
            environment = {**os.environ, "PYTHONPATH": os.pathsep.join(places)}
            self._log = (self._scratch / "worker.log").open("w+", encoding="utf-8", errors="replace")
            self._worker = subprocess.Popen(
                [sys.executable, "-m", "fuzz.worker"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                text=True,
                env=environment,
            )
        return self._worker

    def _last_words(self) -> str:
        assert self._log is not None
        self._log.seek(0)
        return self._log.read()[-6000:]

    def _end(self) -> None:
        if self._worker is not None:
            assert self._worker.stdin is not None
            assert self._worker.stdout is not None
            with suppress(BrokenPipeError):
                self._worker.stdin.close()
            self._worker.stdout.close()
            self._worker.wait()
        if self._log is not None:
            self._log.close()
        self._worker = self._log = None

    def _keep(self, outcome: Outcome, folder: Path) -> None:
        assert self._findings is not None
        kept = self._findings / folder.name
        shutil.rmtree(kept, ignore_errors=True)
        shutil.copytree(folder, kept, symlinks=True, ignore_dangling_symlinks=True)
        (kept / "finding.txt").write_text(f"{outcome}\n", encoding="utf-8", errors="backslashreplace")
