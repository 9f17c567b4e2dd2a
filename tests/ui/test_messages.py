import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.errors import InputError
from dloftbs.ui.messages import MAX_POINTS, Draw, Save, Seek, read

STROKE = {"type": "draw", "frame": 0, "points": [[1, 2.5]], "cable": True, "radius_px": 3, "done": True}


def test_messages_are_types():
    assert read(json.dumps(STROKE)) == Draw(0, ((1.0, 2.5),), True, 3.0, True)
    assert read(b'{"type": "save"}') == Save()
    assert read('{"type": "seek", "index": null}') == Seek(None)


@pytest.mark.parametrize(
    "change",
    [
        {"type": "read"},
        {"type": None},
        {"points": []},
        {"points": [[1]]},
        {"points": [[1, 2, 3]]},
        {"points": [[1e6, 0]]},
        {"points": [["a", 0]]},
        {"points": [[0, 0]] * (MAX_POINTS + 1)},
        {"radius_px": 0},
        {"radius_px": -1},
        {"frame": -1},
        {"frame": 1.5},
        {"cable": "yes"},
        {"file": "/etc/passwd"},
    ],
    ids=lambda change: str(change)[:40],
)
def test_what_is_wrong_is_refused_in_words(change):
    with pytest.raises(InputError, match="a message that the page may not send: "):
        read(json.dumps({**STROKE, **change}))


@pytest.mark.parametrize(
    "text", ["", "[]", "null", "{", "1", '{"type": "draw"}', b"\xff\xfe", "NaN", '{"type": 1e999}']
)
def test_what_is_no_message_is_refused(text):
    with pytest.raises(InputError):
        read(text)


@pytest.mark.parametrize("ranges", [[[0, 180, 0, 255, 0, 255]], [[0, 1, 0, 256, 0, 255]], [[0, 1]], [[0] * 6] * 17])
def test_ranges_out_of_bounds_are_refused(ranges):
    with pytest.raises(InputError):
        read(json.dumps({"type": "ranges", "ranges": ranges, "done": True}))


@given(st.binary(max_size=60) | st.text(max_size=60))
def test_nothing_but_an_input_error_is_raised(data):
    with pytest.raises(InputError):
        read(data)
