"""Results as detections of supervision, and back: with a stand-in for its package, and with the package."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from drawings import draw_cable, wave

import dloftbs
from dloftbs.errors import InputError

SIZE = (120, 160)
MASK = draw_cable(wave(SIZE, 1.0, 0.0), 7, SIZE)


@pytest.fixture
def stand_in(monkeypatch):
    monkeypatch.setitem(sys.modules, "supervision", SimpleNamespace(Detections=SimpleNamespace))


def check(found):
    again = dloftbs.detect(instances=found)
    assert len(again) == 1
    assert again[0].curve.length == pytest.approx(dloftbs.detect(MASK)[0].curve.length, rel=0.03)
    rows, columns = np.nonzero(found.mask[0])
    assert found.xyxy[0].tolist() == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
    assert (found.mask[0] & (MASK > 0)).sum() > 0.9 * (MASK > 0).sum()


def test_a_detection_goes_there_and_back(stand_in):
    found = dloftbs.detect(MASK).to_supervision()
    check(found)
    assert found.tracker_id is None
    assert found.class_id.tolist() == [0]
    assert found.data["class_name"].tolist() == ["cable"]
    assert np.isnan(found.data["length_m"]).all()


def test_tracks_have_their_ids(stand_in):
    (result,) = dloftbs.track([MASK])
    assert result.to_supervision().tracker_id.tolist() == [1]


def test_nothing_found_is_no_row(stand_in):
    found = dloftbs.detect(np.zeros(SIZE, bool)).to_supervision()
    assert (found.mask.shape, found.xyxy.shape) == ((0, *SIZE), (0, 4))


def test_without_the_package_an_error_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "supervision", None)
    with pytest.raises(InputError, match=r"pip install 'dloftbs\[supervision\]'"):
        dloftbs.detect(MASK).to_supervision()


@pytest.mark.filterwarnings("ignore")  # of its imports
def test_the_package_itself_takes_them():
    supervision = pytest.importorskip("supervision")
    found = dloftbs.detect(MASK).to_supervision()
    assert isinstance(found, supervision.Detections)
    check(found)
