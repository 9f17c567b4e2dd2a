"""Goes round the families until the time is over: ``make fuzz MINUTES=60 SEED=7``.

One case again: ``make fuzz FAMILY=combs SEED=7 CASE=12``. What is found goes to ``build/fuzz``, each with the command
that shows it again. The exit code is 1 where something was found.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from fuzz.families import FAMILIES
from fuzz.family import Family
from fuzz.runner import Outcome, Runner

FINDINGS = Path("build") / "fuzz"
ROUND = 5
"""Cases of a family in a row, before its next turn."""
PROGRESS_S = 60.0


def main() -> int:
    """Run, and return the exit code."""
    arguments = _arguments()
    families = [FAMILIES[arguments.family]] if arguments.family else list(FAMILIES.values())
    end = time.monotonic() + 60.0 * arguments.minutes
    with Runner(FINDINGS) as runner:
        if arguments.case is not None:
            outcomes = iter([runner.run(families[0], arguments.seed, arguments.case)])
        else:
            outcomes = (runner.run(family, arguments.seed, number) for family, number in _rounds(families, end))
        found = _report(outcomes)
    return 1 if found else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="make fuzz", description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--family", choices=FAMILIES)
    parser.add_argument("--case", type=int, help="this one alone; it needs a family")
    arguments = parser.parse_args()
    if arguments.case is not None and arguments.family is None:
        parser.error("CASE needs FAMILY")
    return arguments


def _rounds(families: list[Family], end: float) -> Iterator[tuple[Family, int]]:
    """Yield cases until the time is over, some of each family in turn."""
    for first in itertools.count(0, ROUND):
        for family in families:
            for number in range(first, first + ROUND):
                if time.monotonic() > end:
                    return
                yield family, number


def _report(outcomes: Iterator[Outcome]) -> list[Outcome]:
    """Print what is found as it is found, a line of progress now and then, and a summary; return the findings."""
    found, cases, said = [], 0, time.monotonic()
    for cases, outcome in enumerate(outcomes, start=1):
        if outcome.error is not None:
            found.append(outcome)
            _say(f"FOUND {outcome.error}: {outcome}")
        if time.monotonic() - said > PROGRESS_S:
            said = time.monotonic()
            _say(f"{cases} cases, {len(found)} found; at {outcome.family} {outcome.number}")
    for outcome in found:
        _say(f"{outcome.error}: {outcome.command}")
    _say(f"{cases} cases, {len(found)} found" + (f", kept in {FINDINGS}" if found else ""))
    return found


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
