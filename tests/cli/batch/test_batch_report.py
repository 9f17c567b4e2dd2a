"""Lines and table of a batch."""

import io
import sys

import click
import pytest
from cli.batch.batch_inputs import only, settings, stack

from dloftbs.cli.batch.batch_report import BatchReport, reason
from dloftbs.cli.batch.status_file import Event, Fingerprint, State, status_of
from dloftbs.cli.stream_report import RunReport


def status(tmp_path, name="a.npy", state=State.FAILED, **told):
    item = only(stack(tmp_path / name, 1), tmp_path / "out")
    return status_of(item, settings(), state, Fingerprint(1, 1, ""), RunReport(), **told)


def test_frames_of_an_input_count_once(tmp_path):
    report = BatchReport(2, [])
    report.add(Event(None, 70))
    assert "  70 frames  " in report.line()
    report.add(Event(status(tmp_path), 0))
    assert report.line().startswith("1/2 inputs  1 failed  0 frames  ")
    assert (report.done, report.length, report.is_good) == (1, 2, False)


def test_what_is_left_is_said(tmp_path):
    report = BatchReport(3, [status(tmp_path, state=State.DONE)])
    assert report.summary().startswith("3 inputs: 1 done, 2 left, 1 of them by an earlier run; 0 frames in ")


@pytest.mark.parametrize(
    ("error", "skipped", "said"),
    [
        ("no such file", 0, "no such file"),
        ("Traceback (most recent call last):\n  a line\nTypeError: a bug", 0, "TypeError: a bug"),
        (None, 3, "3 frames could not be read"),
        ("cut off", 2, "cut off; 2 frames could not be read"),
    ],
)
def test_the_reason_is_one_line(tmp_path, error, skipped, said):
    told = status(tmp_path, error=error)
    assert reason(told.__class__(**{**told.__dict__, "skipped": skipped})) == said


def test_on_a_terminal_it_is_drawn_and_the_reasons_stand_below(tmp_path, monkeypatch):
    screen = io.StringIO()
    screen.isatty = lambda: True
    monkeypatch.setattr(sys, "stdout", screen)
    monkeypatch.setenv("COLUMNS", "80")
    report = BatchReport(2, [status(tmp_path, error="an error"), status(tmp_path, "b[red].npy", State.DONE)])
    report.print_table()
    lines = [click.unstyle(line) for line in screen.getvalue().splitlines()]
    assert len(lines) == 7
    assert lines[4].split()[1:4:2] == ["b[red].npy", "done"]
    assert lines[6] == "failed a.npy: an error"
