"""Values as messages say them: short, whatever they are, without the numbers of arrays."""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass

import numpy as np
import pytest

from dloftbs.support.values import shown

ARRAY = np.zeros((48, 64), np.uint8)
Pair = namedtuple("Pair", "x y")


@dataclass
class Sample:
    rgb: object
    count: int


class Tensor:
    shape = (48, 64)
    dtype = "torch.float32"


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ({"rgb": ARRAY, "depth": ARRAY}, "a dict with the keys 'rgb', 'depth'"),
        ({"a": {"b": ARRAY}}, "a dict with the keys 'a'"),
        (dict.fromkeys(range(20), ARRAY), "a dict with the keys 0, 1, 2, 3, 4, 5, 6, 7, ... (20 in all)"),
        ({"a": 1, "b": "x"}, "{'a': 1, 'b': 'x'}"),
        (ARRAY, "array (48, 64) of uint8"),
        (Tensor(), "Tensor (48, 64) of torch.float32"),
        ([ARRAY, Tensor()], "[array (48, 64) of uint8, Tensor (48, 64) of torch.float32]"),
        ((ARRAY,), "(array (48, 64) of uint8,)"),
        (Pair(ARRAY, 2), "(array (48, 64) of uint8, 2)"),
        (Sample(ARRAY, 2), "Sample(array (48, 64) of uint8, 2)"),
        ([Sample(ARRAY, 2)], "[Sample(array (48, 64) of uint8, 2)]"),
        (np.array([1, 2]), "array([1, 2])"),
        ([1, 2], "[1, 2]"),
        (list(range(1000)), "[0, 1, 2, 3, 4, 5, 6, 7, ... (1000 in all)]"),
        ([[[[[1]]]]], "[[[[...]]]]"),
        ("x", "'x'"),
        (None, "None"),
        (dict, "<class 'dict'>"),
    ],
)
def test_a_value_is_said_in_short(value: object, expected: str) -> None:
    assert shown(value) == expected


def test_a_list_within_itself_is_said_too() -> None:
    within: list[object] = []
    within.append(within)
    assert shown(within) == "[[[[...]]]]"


def test_long_text_is_cut() -> None:
    assert shown("x" * 500) == f"'{'x' * 199}... (502 characters)"
    assert len(shown([ARRAY] * 8)) < 230
