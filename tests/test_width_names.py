"""The width of a cable has one name in everything that users meet: ``width_px``."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from enum import Enum

import numpy as np
import pytest

import dloftbs
from dloftbs.linking.temporal_prior import TemporalPrior
from dloftbs.ui.payload import describe
from dloftbs.viz.items import Item

SIZES = {dloftbs.PinholeCamera, dloftbs.DepthRegistration}
"""Types whose width is that of an image."""
DRAWN = {dloftbs.Route}
"""Types whose width is what a curve is drawn with, whatever the unit of the picture."""
PUBLIC = [
    *(getattr(dloftbs, name) for name in dloftbs.__all__ if inspect.isclass(getattr(dloftbs, name))),
    TemporalPrior,
    Item,
]


def parameters_of(kind: type) -> Iterator[str]:
    for name, member in inspect.getmembers(kind, callable):
        if name == "__init__" or not name.startswith("_"):
            try:
                yield from inspect.signature(member).parameters
            except ValueError:  # of C
                continue


@pytest.mark.parametrize(
    "kind",
    [kind for kind in PUBLIC if not (kind in SIZES | DRAWN or issubclass(kind, Enum))],
    ids=lambda kind: kind.__name__,
)
def test_no_public_type_has_another_name_for_it(kind: type) -> None:
    assert "width" not in {*getattr(kind, "__annotations__", {}), *vars(kind), *parameters_of(kind)}


def test_the_page_has_it() -> None:
    mask = np.zeros((60, 120), bool)
    mask[27:33, 10:110] = True
    (curve,) = describe(dloftbs.detect(mask))["curves"]
    assert curve["width_px"] == pytest.approx(6.0, abs=0.5)
    assert "width" not in curve
