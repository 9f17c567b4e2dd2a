"""Recorded motion: splines go through the markers, and files that hold something else are refused."""

import numpy as np
import pytest

from dloftbs.errors import SourceError
from dloftbs_lab.synthetic.motion_capture import Recording, recordings_in


def markers(frames=6, count=5):
    """A cable along x that moves along y by 1 cm a frame."""
    made = np.zeros((frames, count, 3))
    made[..., 0] = np.linspace(0.0, 0.8, count)
    made[..., 1] = 0.01 * np.arange(frames)[:, None]
    return made


def test_the_axis_goes_evenly_through_the_markers_and_moves_between_the_frames():
    recording = Recording(markers(), 10.0)
    assert (recording.seconds, recording.length_m) == (pytest.approx(0.5), pytest.approx(0.8))
    axis = recording.axis(0.25, 9)
    np.testing.assert_allclose(axis[:, 0], np.linspace(0.0, 0.8, 9), atol=1e-9)
    np.testing.assert_allclose(axis[:, 1], 0.025, atol=1e-9)


def test_the_recordings_of_all_files_of_a_folder_are_read(tmp_path):
    for number in (1, 2):
        np.savez(tmp_path / f"cable_{number}.npz", markers=np.stack([markers()] * number), rate_hz=30.0)
    assert [one.rate_hz for one in recordings_in(tmp_path)] == [30.0] * 3


@pytest.mark.parametrize(
    ("arrays", "word"),
    [
        ({"markers": markers()[None]}, "rate_hz"),
        ({"markers": markers(), "rate_hz": 30.0}, "shape"),
        ({"markers": markers(count=3)[None], "rate_hz": 30.0}, "markers or more"),
        ({"markers": np.nan * markers()[None], "rate_hz": 30.0}, "finite"),
        ({"markers": markers()[None], "rate_hz": 0.0}, "must be positive"),
    ],
)
def test_what_is_no_recording_is_an_error(tmp_path, arrays, word):
    np.savez(tmp_path / "cable_1.npz", **arrays)
    with pytest.raises(SourceError, match=word):
        recordings_in(tmp_path)


def test_an_empty_folder_is_an_error(tmp_path):
    with pytest.raises(SourceError, match="no file"):
        recordings_in(tmp_path)
