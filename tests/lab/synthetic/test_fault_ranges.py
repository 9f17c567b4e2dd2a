"""The ranges of faults: what passes, and what an error says of what does not."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from dloftbs.errors import InputError
from dloftbs_lab.synthetic.fault_ranges import check_amounts, check_lengths, check_ranges


@pytest.mark.parametrize("value", [0.0, 0.4, 1])
def test_amounts_up_to_the_most_pass(value):
    check_amounts(SimpleNamespace(share=value), ("share",), 1.0)


@pytest.mark.parametrize("value", [-1e-9, 1.1, math.nan, math.inf])
def test_other_amounts_are_refused(value):
    with pytest.raises(InputError, match=rf"share must be a number in 0\.\.1, got {value}"):
        check_amounts(SimpleNamespace(share=value), ("share",), 1.0)


@pytest.mark.parametrize("value", [-1, math.nan, math.inf])
def test_an_amount_without_a_limit_is_finite_all_the_same(value):
    with pytest.raises(InputError, match="discs must be a number that is not negative"):
        check_amounts(SimpleNamespace(discs=value), ("discs",))


@pytest.mark.parametrize("value", [0.0, -2.0, math.nan, 1e3])
def test_lengths_are_positive_and_below_the_limit(value):
    check_lengths(SimpleNamespace(blur_px=999.0), ("blur_px",), 1e3)
    with pytest.raises(InputError, match="blur_px must be positive and below 1000"):
        check_lengths(SimpleNamespace(blur_px=value), ("blur_px",), 1e3)


@pytest.mark.parametrize("value", [(0.0, 1.0), (3.0, 2.0), (1.0, 1e3), (math.nan, 2.0)])
def test_ranges_are_positive_and_in_order(value):
    check_ranges(SimpleNamespace(lost_px=(2.0, 2.0)), ("lost_px",), 1e3)
    with pytest.raises(InputError, match="lost_px must be a positive range below 1000, low before high"):
        check_ranges(SimpleNamespace(lost_px=value), ("lost_px",), 1e3)
