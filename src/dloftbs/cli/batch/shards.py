"""Shares of a batch for several machines, by number or as SLURM counts them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from dloftbs.errors import InputError

T = TypeVar("T")

AUTO = "auto"
_TASK, _FIRST, _COUNT, _STEP = (f"SLURM_ARRAY_TASK_{name}" for name in ("ID", "MIN", "COUNT", "STEP"))


@dataclass(frozen=True)
class Shard:
    """One of several equal shares.

    Parameters
    ----------
    number : int
        From 1 on.
    count : int

    Examples
    --------
    >>> [Shard(i, 3).of("abcde") for i in (1, 2, 3)]
    [['a', 'd'], ['b', 'e'], ['c']]
    """

    number: int = 1
    count: int = 1

    def of(self, items: Sequence[T]) -> list[T]:
        """Return the share: all shards together have each item once."""
        return list(items[self.number - 1 :: self.count])


def read_shard(text: str, environment: Mapping[str, str]) -> Shard:
    """Read ``"2/8"``, or ``"auto"`` for the number of the task in an array of SLURM's.

    Raises
    ------
    InputError
        If it is neither, or SLURM's variables are missing or are those of an array with gaps.
    """
    if text == AUTO:
        return _of_slurm(environment)
    match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    number, count = (int(match[1]), int(match[2])) if match else (0, 0)
    if not 1 <= number <= count:
        raise InputError(f"a shard must be I/N with I from 1 to N, or {AUTO}, got {text!r}")
    return Shard(number, count)


def _of_slurm(environment: Mapping[str, str]) -> Shard:
    try:
        task, first, count = (int(environment[name]) for name in (_TASK, _FIRST, _COUNT))
        step = int(environment.get(_STEP, "1"))
    except KeyError as error:
        raise InputError(
            f"--shard {AUTO} needs {error.args[0]}, which sbatch --array sets; or say --shard I/N"
        ) from error
    except ValueError as error:
        raise InputError(f"--shard {AUTO}: a variable of SLURM is no whole number: {error}") from error
    number, rest = divmod(task - first, step) if step > 0 else (-1, 0)
    if rest or not 0 <= number < count:
        raise InputError(
            f"--shard {AUTO} needs an array without gaps, such as --array=0-15, and this is task {task} of {count} "
            f"from {first} on in steps of {step}; say --shard I/N"
        )
    return Shard(number + 1, count)
