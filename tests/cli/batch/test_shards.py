"""Shards, and SLURM's variables."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.cli.batch.shards import Shard, read_shard
from dloftbs.errors import InputError


def slurm(task, first=0, count=4, step=1):
    names = {"ID": task, "MIN": first, "COUNT": count, "STEP": step, "MAX": first + step * (count - 1)}
    return {f"SLURM_ARRAY_TASK_{name}": str(value) for name, value in names.items()}


@given(st.lists(st.integers()), st.integers(1, 20))
def test_shards_have_each_item_once_and_about_as_many_each(items, count):
    shares = [Shard(number, count).of(items) for number in range(1, count + 1)]
    assert sorted(item for share in shares for item in share) == sorted(items)
    assert max(map(len, shares)) - min(map(len, shares)) <= 1


def test_a_shard_is_read():
    assert read_shard("2/8", {}) == Shard(2, 8)
    assert read_shard("1/1", {}).of("abc") == ["a", "b", "c"]


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "1/", "/2", "-1/2", "a/b", "1/2/3", "", "1/0", "Auto"])
def test_anything_else_is_an_error(text):
    with pytest.raises(InputError, match="I/N"):
        read_shard(text, {})


@pytest.mark.parametrize(("first", "step"), [(0, 1), (1, 1), (10, 1), (0, 2), (5, 3)])
def test_tasks_of_an_array_are_shards(first, step):
    tasks = range(first, first + 4 * step, step)
    found = [read_shard("auto", slurm(task, first, 4, step)) for task in tasks]
    assert found == [Shard(number, 4) for number in (1, 2, 3, 4)]


def test_without_a_step_it_is_one():
    environment = slurm(3, 1)
    del environment["SLURM_ARRAY_TASK_STEP"]
    assert read_shard("auto", environment) == Shard(3, 4)


@pytest.mark.parametrize(
    "environment",
    [{}, {"SLURM_ARRAY_TASK_ID": "1"}, slurm("one"), slurm(7, 1, 3), slurm(2, 0, 4, 3), slurm(0, 1), slurm(1, step=0)],
)
def test_auto_needs_an_array_without_gaps(environment):
    with pytest.raises(InputError, match="--shard auto"):
        read_shard("auto", environment)
