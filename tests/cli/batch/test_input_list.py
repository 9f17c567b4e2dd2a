"""What is an input, what its result is called, and where results may lie."""

import os
import random
from pathlib import Path

import pytest

from dloftbs.cli.batch.input_list import list_inputs
from dloftbs.errors import InputError, SinkError, SourceError

FILES = (
    "rec/day1/a.npy",
    "rec/day1/a10.npy",
    "rec/day1/a2.npy",
    "rec/day2/a.npy",
    "rec/day2/frames/0.png",
    "rec/x.mp4",
)


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in FILES:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_bytes(b"")
    return tmp_path


def names(*where, out="results", suffix=".jsonl"):
    return [each.name for each in list_inputs(where, Path(out), suffix)]


@pytest.mark.parametrize(
    ("where", "expected"),
    [
        (["rec/**/*.npy"], ["day1/a2.npy", "day1/a10.npy", "day1/a.npy", "day2/a.npy"]),
        (["rec/day?/a.npy"], ["day1/a.npy", "day2/a.npy"]),
        (["rec/day2/*/"], ["frames"]),
        (["rec/day2/frames"], ["frames"]),
        (["rec/day2/frames", "rec/x.mp4"], ["day2/frames", "x.mp4"]),
        (["rec/x.mp4", "./rec/../rec/x.mp4", "rec/*.mp4"], ["x.mp4"]),
        (["rec/day1/a[0-9].npy"], ["a2.npy"]),
        (["*/x.mp4"], ["rec/x.mp4"]),
    ],
)
def test_each_match_file_and_folder_is_one_input_with_its_path_as_name(where, expected):
    assert names(*where) == expected


def test_results_mirror_the_folders_of_the_inputs(place):
    (item,) = list_inputs(["rec/day2/fr*"], Path("results"), ".npz")
    assert item.path == place / "rec/day2/frames"
    assert item.result == place / "results/frames.npz"
    assert item.status == place / "results/frames.status.json"


def test_another_match_changes_no_other_name():
    before = names("rec/*/a.npy")
    Path("rec/day3").mkdir()
    Path("rec/day3/a.npy").write_bytes(b"")
    assert names("rec/*/a.npy") == [*before, "day3/a.npy"]
    assert names("rec/day3/*.npy") == ["a.npy"]


@pytest.mark.parametrize("pattern", ["bags/**/*.mcap", "bags/*/run_*.mcap"])
def test_files_of_a_rosbag2_stand_for_their_folder_once(pattern):
    for name in ("bags/a/run_0.mcap", "bags/a/run_1.mcap", "bags/a/metadata.yaml", "bags/b/run_0.mcap"):
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_bytes(b"")
    assert names(pattern) == ["a", "b/run_0.mcap"]
    assert names("bags/a/*.mcap") == ["a"]  # the folder that the glob begins from
    assert names("bags/a/run_0.mcap") == ["run_0.mcap"]  # which is asked for by name


def test_a_file_whose_name_has_brackets_is_itself():
    Path("rec/a[1].npy").write_bytes(b"")
    assert names("rec/a[1].npy") == ["a[1].npy"]


def test_the_current_folder_may_have_brackets_in_its_name(place, monkeypatch):
    Path("[x]*/rec").mkdir(parents=True)
    monkeypatch.chdir("[x]*")
    Path("rec/a.npy").write_bytes(b"")
    assert names("rec/*.npy") == ["a.npy"]
    with pytest.raises(SinkError):
        names("rec/*", out="rec")


def test_hidden_files_are_no_matches():
    Path("rec/.a.npy").write_bytes(b"")
    assert ".a.npy" not in names("rec/*.*")


@pytest.mark.parametrize(
    ("where", "error", "said"),
    [
        (["rec/*.avi"], SourceError, "nothing matches"),
        (["nowhere"], SourceError, "no file or folder 'nowhere'"),
        (["-"], InputError, "use dloftbs track"),
        (["rtsp://x/y"], InputError, "use dloftbs track"),
        (["/dev/null"], SourceError, "neither a file nor a folder"),
        (["rec/**"], InputError, "lies in would both be inputs"),
        (["rec/day1", "rec/day1/a.npy"], InputError, "lies in would both be inputs"),
        (["/"], InputError, "no name of its own"),
    ],
)
def test_what_is_no_input_is_an_error(where, error, said):
    with pytest.raises(error, match=said):
        names(*where)


def test_two_results_of_one_name_are_an_error():
    Path("rec/X.mp4").write_bytes(b"")
    if len(os.listdir("rec")) == 3:
        pytest.skip("the file system knows no case")
    with pytest.raises(InputError, match="rename one of the two"):
        names("rec/*.mp4")


def test_a_result_in_place_of_a_folder_of_results_is_an_error():
    Path("rec/x.mp4.jsonl").mkdir()
    Path("rec/x.mp4.jsonl/y.mp4").write_bytes(b"")
    with pytest.raises(InputError, match="name of the folder"):
        names("rec/**/*.mp4")


def test_a_name_that_is_too_long_for_its_result_is_an_error():
    Path(f"rec/{'n' * 245}.mp4").write_bytes(b"")
    with pytest.raises(InputError, match="too long"):
        names("rec/*.mp4")


@pytest.mark.parametrize(
    ("where", "out", "suffix"),
    [
        ("rec/day2/frames", "rec/day2/frames", ".jsonl"),
        ("rec/day2/frames", "rec/day2/frames/results", ".jsonl"),
        ("rec/day2/*", "rec/day2/results", ".jsonl"),
        ("rec/*", "rec", ".jsonl"),
        ("rec/*", "rec/results/all", ".jsonl"),
        ("rec/**/*.npz", "rec/results", ".npz"),
        ("rec/**/*.json", "rec", ".jsonl"),
        ("linked/**/*.npz", "rec/results", ".npz"),
        ("rec/**/*.npz", "linked/results", ".npz"),
        ("rec/**/a.*", "rec/day1", ".jsonl"),
        ("rec/x.mp4", "rec/x.mp4", ".jsonl"),
    ],
)
def test_results_that_would_be_inputs_of_the_next_run_are_refused(where, out, suffix):
    os.symlink("rec", "linked")
    for name in ("rec/a.npz", "rec/a.json"):
        Path(name).write_bytes(b"")
    with pytest.raises(SinkError, match="--out"):
        names(where, out=out, suffix=suffix)


@pytest.mark.parametrize(
    ("where", "out"),
    [
        ("rec/**/*.npy", "rec"),
        ("rec/day2/*/", "rec/day2"),
        ("rec/*.mp4", "rec/.results"),
        ("rec/day*/*.npy", "rec/results"),
    ],
)
def test_results_may_lie_beside_inputs_where_no_pattern_catches_them(where, out):
    before = names(where, out=out)
    for item in list_inputs([where], Path(out), ".jsonl"):
        item.result.parent.mkdir(parents=True, exist_ok=True)
        item.result.write_bytes(b"")
        item.status.write_bytes(b"")
    assert names(where, out=out) == before


def test_a_result_in_the_place_of_a_file_that_is_read_is_refused():
    Path("results").mkdir()
    camera = Path("results/x.mp4.status.json")
    camera.write_text("{}")
    with pytest.raises(SinkError, match="would replace"):
        list_inputs(["rec/x.mp4"], Path("results"), ".jsonl", [camera])
    os.symlink("x.mp4", "rec/y.mp4.jsonl")
    Path("rec/y.mp4").write_bytes(b"")
    with pytest.raises(SinkError, match="would replace"):
        list_inputs(["rec/x.mp4", "rec/y.mp4"], Path("rec"), ".jsonl")


def test_random_globs_never_catch_what_is_allowed():
    """Whatever the pattern and the folder: after a run that is allowed, the inputs are the same."""
    chance = random.Random(1)
    allowed = 0
    for number in range(80):
        pattern = "/".join(["rec", *chance.choices(["*", "**", "day*", "?ay1"], k=chance.randint(0, 2))])
        pattern += chance.choice(["/*", "/*.npy", "/a*", "/**", "/*/", "/*.j*", "/day1"])
        out = chance.choice(["rec", "rec/day1", f"rec/new{number}", f"rec/new{number}/deep", "rec/day2/frames", "out"])
        try:
            before = list_inputs([pattern], Path(out), ".jsonl")
        except (InputError, SinkError, SourceError):
            continue
        allowed += 1
        for item in before:
            item.result.parent.mkdir(parents=True, exist_ok=True)
            item.result.write_bytes(b"")
            item.status.write_bytes(b"")
        assert list_inputs([pattern], Path(out), ".jsonl") == before, (pattern, out)
    assert allowed > 10
