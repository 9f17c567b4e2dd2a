"""Knots that are drawn as masks with shaded pictures, and read by the whole pipeline."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.knot_drawings import draw_knot

import dloftbs
from dloftbs.topology import Diagram

spherogram = pytest.importorskip("spherogram")


@pytest.mark.parametrize("is_open", [False, True])
@pytest.mark.parametrize("name", ["3_1", "4_1", "6_2", "7_4"])
def test_a_drawn_knot_is_named(name: str, is_open: bool) -> None:
    drawing = draw_knot(spherogram.Link(name), np.random.default_rng(5), is_open)
    assert drawing.truth.name == name
    diagram = Diagram.from_result(dloftbs.detect(drawing.frame.mask, image=drawing.frame.image))
    assert (diagram.name, diagram.is_knotted, diagram.is_open) == (name, True, is_open)
    assert diagram.writhe == drawing.truth.writhe
    assert 0.7 < diagram.probability < 1.0
    assert (diagram.next_move is not None) is is_open


def test_a_mask_alone_leaves_the_orders_open() -> None:
    drawing = draw_knot(spherogram.Link("3_1"), np.random.default_rng(5), True)
    diagram = Diagram.from_result(dloftbs.detect(drawing.frame.mask))
    assert diagram.tops == (None,) * 3
    assert diagram.is_knotted is diagram.name is None
    assert diagram.next_move is not None
    assert diagram.next_move.over is None
