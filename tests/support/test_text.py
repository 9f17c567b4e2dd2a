from pathlib import Path

import numpy as np
import pytest

from dloftbs import viz
from dloftbs.data.frame_result import FrameResult
from dloftbs.support.text import readable


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("cable.png", "cable.png"),
        ("kä🚡", "kä🚡"),
        ("a\udcff.png", r"a\xff.png"),
        ("k\udcc3\udca4", "kä"),  # as a POSIX locale reads the UTF-8 of a name
        ("\ud83d", r"\ud83d"),
        ("\ud83d\udcff", r"\ud83d\udcff"),
        ("", ""),
    ],
)
def test_what_no_encoding_has_becomes_an_escape(text, expected):
    assert readable(text) == expected
    assert readable(expected) == expected


def test_a_result_has_a_name_that_json_takes():
    result = FrameResult((), (), None, (4, 4), name="a\udcff.png")
    assert result.to_dict()["name"] == r"a\xff.png"


def test_titles_of_pictures_take_any_text():
    picture = np.zeros((40, 60, 3), np.uint8)
    assert np.array_equal(viz.contact_sheet([picture], ["a\udcff"]), viz.contact_sheet([picture], [r"a\xff"]))


def test_the_name_of_a_file_is_one_that_is_no_utf8(tmp_path):
    name = tmp_path / "a\udcff"
    try:
        name.touch()
    except (OSError, UnicodeEncodeError):
        pytest.skip("a file system that takes text alone")
    assert readable(Path(next(tmp_path.iterdir())).name) == r"a\xff"
