"""Curves in axes of matplotlib."""

import sys

import numpy as np
import pytest
from drawings import draw_cable, wave

import dloftbs
from dloftbs.errors import InputError

SIZE = (120, 160)


def result_with_a_gap():
    mask = draw_cable(wave(SIZE, 1.0, 0.0), 7, SIZE)
    mask[:, 78:86] = 0
    return dloftbs.detect(mask, objects=1)


def test_seen_and_inferred_parts_ends_and_legend_are_drawn():
    figure = pytest.importorskip("matplotlib.figure").Figure()
    ax = figure.subplots()
    result = result_with_a_gap()
    assert result.plot(ax) is ax
    styles = [line.get_linestyle() for line in ax.lines]
    assert (styles.count("-"), styles.count("--")) == (2, 1)
    assert [line.get_fillstyle() for line in ax.lines[-2:]] == ["full", "none"]
    assert np.array(ax.lines[-1].get_xydata())[0] == pytest.approx(result[0].curve.end)
    assert ax.get_ylim() == (SIZE[0] - 0.5, -0.5)
    assert ax.get_legend().get_texts()[0].get_text().endswith("px")
    assert len(ax.images) == 1


def test_nothing_found_is_an_empty_picture():
    ax = pytest.importorskip("matplotlib.figure").Figure().subplots()
    dloftbs.FrameResult((), (), None, SIZE).plot(ax)
    assert not ax.lines
    assert ax.get_xlim() == (-0.5, SIZE[1] - 0.5)


def test_what_is_no_axes_is_refused():
    with pytest.raises(InputError, match="axes of matplotlib, got 3"):
        result_with_a_gap().plot(3)


def test_without_matplotlib_an_error_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    with pytest.raises(InputError, match=r"pip install 'dloftbs\[plot\]'"):
        result_with_a_gap().plot()
