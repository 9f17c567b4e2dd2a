import msgspec
import pytest

from dloftbs.errors import InputError
from dloftbs.ui import messages as m
from dloftbs.ui.tune_document import MAX_STROKES, DrawnStroke, History, TuneDocument, edited

LINE = DrawnStroke(2, ((10.0, 10.0), (50.0, 10.0)), True, 3.0)


def draw(frame=0, points=((1.0, 2.0),), cable=True):
    return m.Draw(frame, points, cable, 3.0, True)


def test_an_eraser_cuts_a_stroke_in_two():
    left = TuneDocument(strokes=(LINE,)).without(2, ((30.0, 0.0), (30.0, 20.0)), 4.0)
    first, second = left.strokes
    assert first.points[0] == (10.0, 10.0)
    assert second.points[-1] == (50.0, 10.0)
    assert first.points[-1][0] == pytest.approx(22.0, abs=2.0)
    assert second.points[0][0] == pytest.approx(38.0, abs=2.0)
    assert {stroke.radius_px for stroke in left.strokes} == {3.0}


@pytest.mark.parametrize(
    ("frame", "path"), [(1, ((30.0, 10.0),)), (2, ((30.0, 40.0),)), (2, ((80.0, 10.0), (90.0, 0.0)))]
)
def test_an_eraser_leaves_what_it_does_not_touch(frame, path):
    document = TuneDocument(strokes=(LINE,))
    assert document.without(frame, path, 4.0) == document


def test_a_click_is_erased_as_a_whole():
    dot = msgspec.structs.replace(LINE, points=((10.0, 10.0),))
    assert TuneDocument(strokes=(dot, LINE)).without(2, ((0.0, 10.0), (60.0, 10.0)), 1.0).strokes == ()


def test_edits_are_new_documents():
    document = edited(TuneDocument(), draw())
    assert not document.is_empty
    document = edited(document, m.SetRanges(((1, 2, 3, 4, 5, 6),), True))
    assert (document.method, len(document.strokes), document.ranges) == ("ranges", 1, ((1, 2, 3, 4, 5, 6),))
    document = edited(document, m.SetMethod("strokes"))
    assert edited(document, m.AcceptStrokes(True)).accept_strokes
    assert edited(document, m.SetHeight(0.004, "or", True)).join == "or"
    assert edited(document, m.Clear()).is_empty
    with pytest.raises(InputError, match="a method must be one of strokes, ranges, got 'magic'"):
        edited(document, m.SetMethod("magic"))


@pytest.mark.parametrize(
    ("document", "empty"),
    [
        (TuneDocument(), True),
        (TuneDocument(strokes=(msgspec.structs.replace(LINE, cable=False),)), True),
        (TuneDocument(strokes=(LINE,)), False),
        (TuneDocument(strokes=(LINE,), method="ranges"), True),
        (TuneDocument(height_m=0.003), False),
        (TuneDocument(kept=True), False),
    ],
)
def test_a_document_is_empty_while_nothing_says_what_is_cable(document, empty):
    assert document.is_empty == empty


def test_too_many_strokes_are_refused():
    with pytest.raises(InputError, match="erase some"):
        edited(TuneDocument(strokes=(LINE,) * MAX_STROKES), draw())


def test_history_goes_back_and_forth():
    history = History(TuneDocument())
    states = [history.document]
    for x in range(3):
        states.append(edited(history.document, draw(points=((float(x), 0.0),))))
        history.change(states[-1])
    assert (history.can_undo, history.can_redo) == (True, False)
    for expected in (*states[2::-1], states[0]):
        history.undo()
        assert history.document is expected
    history.redo()
    history.change(states[3])
    assert not history.can_redo
    history.redo()
    assert history.document is states[3]
    history.change(states[3])
    history.undo()
    assert history.document is states[1]
