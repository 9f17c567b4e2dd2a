"""One input: its result as a whole or not at all, and a status that says what became of it."""

import dataclasses
import json

import numpy as np
import pytest
from cli.batch.batch_inputs import contents, only, settings, stack
from cli.cli_inputs import mask, photo, run, save

from dloftbs.cli.batch import input_run
from dloftbs.cli.batch.input_run import MAX_WARNINGS, record_death, run_input
from dloftbs.cli.batch.status_file import State, read_status
from dloftbs.config import Config
from dloftbs.errors import SinkError
from dloftbs.sinks import read_json_lines, read_npz
from dloftbs.support.claims import Claim


def test_the_result_is_that_of_track_without_times(tmp_path):
    path = stack(tmp_path / "a.npy", 30)
    status = run_input(only(path, tmp_path / "out"), settings())
    assert (status.state, status.frames, status.skipped, status.detections, status.tracks) == (State.DONE, 30, 0, 30, 1)
    run("track", path, "--out", tmp_path / "track.jsonl")
    tracked = list(read_json_lines(tmp_path / "track.jsonl"))
    assert list(read_json_lines(tmp_path / "out" / "a.npy.jsonl")) == [{**row, "stage_ms": {}} for row in tracked]
    assert status.timing is not None
    assert list(status.timing.ms)[-1] == "pipeline"


def test_nothing_but_result_and_status_is_left(tmp_path):
    item = only(stack(tmp_path / "a.npy", 5), tmp_path / "out")
    run_input(item, settings())
    assert sorted(contents(tmp_path / "out")) == ["a.npy.jsonl", "a.npy.status.json"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.npy.jsonl", "a.npy.status.json"]


def test_statuses_of_two_runs_differ_in_times_alone(tmp_path):
    path = stack(tmp_path / "a.npy", 8)
    said = [run_input(only(path, tmp_path / out), settings()) for out in ("one", "two")]
    assert dataclasses.replace(said[0], timing=None) == dataclasses.replace(said[1], timing=None)
    assert (tmp_path / "one/a.npy.jsonl").read_bytes() == (tmp_path / "two/a.npy.jsonl").read_bytes()


@pytest.mark.parametrize("suffix", [".npz", ".csv"])
def test_other_forms(tmp_path, suffix):
    path = stack(tmp_path / "a.npy", 8)
    for out in ("one", "two"):
        assert run_input(only(path, tmp_path / out, suffix), settings(suffix=suffix)).state is State.DONE
    result = tmp_path / "one" / f"a.npy{suffix}"
    assert result.read_bytes() == (tmp_path / "two" / f"a.npy{suffix}").read_bytes()
    assert suffix == ".csv" or len(read_npz(result)) == 8


def test_tables_of_branched_cables_have_their_columns(tmp_path):
    path = stack(tmp_path / "a.npy", 2)
    config = Config().replace({"linking.branched": True})
    run_input(only(path, tmp_path / "out", ".csv"), settings(suffix=".csv", config=config))
    header = (tmp_path / "out" / "a.npy.csv").read_text().splitlines()[0]
    assert header.endswith(",harness,branch")


def test_a_file_that_the_settings_name_counts_with_its_content(tmp_path):
    empty = tmp_path / "empty.png"
    config = Config().replace({"segmentation.background": {"file": str(empty)}})
    digests = {settings(config=config).digest}
    for level in (0, 9):
        save(empty, np.full((60, 90, 3), level, np.uint8))
        digests.add(settings(config=config).digest)
    assert len(digests) == 3


def test_frames_that_cannot_be_read_are_skipped_with_reasons(tmp_path):
    for i in range(4):
        save(tmp_path / "in" / f"{i}.png", mask())
    (tmp_path / "in" / "2.png").write_bytes(b"no picture")
    item = only(tmp_path / "in", tmp_path / "out")
    status = run_input(item, settings())
    assert (status.state, status.frames, status.skipped, status.error) == (State.PARTIAL, 3, 1, None)
    assert len(status.warnings) == 1
    assert status.warnings[0].startswith("skipped frame 2: ")
    assert len(list(read_json_lines(item.result))) == 3


def test_of_many_warnings_the_first_are_kept(tmp_path):
    for i in range(MAX_WARNINGS + 20):
        (tmp_path / "in").mkdir(exist_ok=True)
        (tmp_path / "in" / f"{i}.png").write_bytes(b"no picture")
    save(tmp_path / "in" / "x.png", mask())
    status = run_input(only(tmp_path / "in", tmp_path / "out"), settings())
    assert (len(status.warnings), status.skipped, status.frames) == (MAX_WARNINGS, MAX_WARNINGS + 20, 1)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.npy", b"nothing", "cannot be read as a .npy file"),
        ("a.mp4", b"nothing", "cannot be opened as a video"),
        ("a.txt", b"nothing", "cannot be opened as a video"),
        ("a.npz", b"", "a.npz"),
        ("a.png", b"no picture", "a.png"),
    ],
)
def test_what_cannot_be_read_failed(tmp_path, name, data, said):
    (tmp_path / name).write_bytes(data)
    item = only(tmp_path / name, tmp_path / "out")
    status = run_input(item, settings())
    assert (status.state, status.frames, status.result) == (State.FAILED, 0, None)
    assert said in status.error
    assert not item.result.exists()
    assert read_status(item) == status


def test_pictures_without_a_colour_failed_with_the_remedy(tmp_path):
    save(tmp_path / "in" / "0.png", photo())
    assert "--hsv" in run_input(only(tmp_path / "in", tmp_path / "out"), settings()).error


def test_an_empty_stack_failed(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((0, 60, 90), np.uint8))
    assert run_input(only(tmp_path / "a.npy", tmp_path / "out"), settings()).state is State.FAILED


def test_an_error_on_the_way_leaves_what_was_read(tmp_path):
    save(tmp_path / "in" / "0.png", mask())
    save(tmp_path / "in" / "1.png", photo())
    item = only(tmp_path / "in", tmp_path / "out")
    status = run_input(item, settings())
    assert (status.state, status.frames) == (State.PARTIAL, 1)
    assert "1.png is a colour image" in status.error
    assert len(list(read_json_lines(item.result))) == 1


def test_a_bug_is_the_fault_of_its_input_alone(tmp_path, monkeypatch):
    def fail(*arguments, **options):
        raise TypeError("a bug")

    monkeypatch.setattr(input_run, "StreamRun", fail)
    status = run_input(only(stack(tmp_path / "a.npy", 3), tmp_path / "out"), settings())
    assert status.state is State.FAILED
    assert status.error.startswith("Traceback")
    assert status.error.endswith("TypeError: a bug")


def test_what_fails_now_leaves_no_older_result(tmp_path):
    item = only(stack(tmp_path / "a.npy", 3), tmp_path / "out")
    run_input(item, settings())
    item.path.write_bytes(b"nothing")
    assert run_input(item, settings()).state is State.FAILED
    assert not item.result.exists()


def test_what_is_done_is_not_done_again(tmp_path):
    item = only(stack(tmp_path / "a.npy", 3), tmp_path / "out")
    first = run_input(item, settings())
    assert run_input(item, settings()) == first  # times too
    assert run_input(item, settings(limit=2)).frames == 2


def test_an_input_that_somebody_else_works_on_is_left_to_him(tmp_path):
    item = only(stack(tmp_path / "a.npy", 3), tmp_path / "out")
    item.result.parent.mkdir()
    with Claim(item.result):
        assert run_input(item, settings()).state is State.BUSY
        assert record_death(item, settings(), "killed").state is State.BUSY
    assert not item.status.exists()


def test_one_that_is_stopped_leaves_nothing(tmp_path):
    item = only(stack(tmp_path / "a.npy", 9), tmp_path / "out")
    frames = []
    with pytest.raises(KeyboardInterrupt):
        run_input(item, settings(), lambda report: frames.append(report.frames), lambda: len(frames) == 4)
    assert frames == [1, 2, 3, 4]
    assert list((tmp_path / "out").iterdir()) == []


def test_what_a_killed_process_left_is_removed(tmp_path):
    item = only(stack(tmp_path / "a.npy", 3), tmp_path / "out")
    part = item.result.with_name(f".{item.result.name}.part")
    part.mkdir(parents=True)
    (part / "rest").write_bytes(b"x")
    assert record_death(item, settings(), "killed").error == "killed"
    assert not part.exists()
    part.mkdir()
    assert run_input(item, settings(retry_failed=True)).state is State.DONE
    assert not part.exists()


def test_a_result_that_cannot_be_written_is_an_error(tmp_path):
    item = only(stack(tmp_path / "a.npy", 3), tmp_path / "out")
    item.result.mkdir(parents=True)
    with pytest.raises(SinkError, match=r"a\.npy"):
        run_input(item, settings())


def test_the_status_is_json_for_everybody(tmp_path):
    path = stack(tmp_path / "a\udcff.npy", 3)
    item = only(path, tmp_path / "out")
    run_input(item, settings())
    said = json.loads(item.status.read_text("utf-8"))
    assert said["input"] == r"a\xff.npy"
    assert (said["state"], said["frames"]) == ("done", 3)
