"""What all sinks share: opening by name, failing to open or to write, several at once."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
import sinks.sink_examples as examples

from dloftbs import sinks
from dloftbs.errors import InputError, SinkError

FILES = {
    "a.jsonl": sinks.JsonLinesSink,
    "a.ndjson": sinks.JsonLinesSink,
    "a.npz": sinks.NpzSink,
    "a.CSV": sinks.CsvSink,
    "a.ply": sinks.GeometrySink,
    "a.obj": sinks.GeometrySink,
    "a.usda": sinks.UsdSink,
    "a.xml": sinks.MujocoSink,
    "a.json": sinks.CocoSink,
    "a.mp4": sinks.OverlayVideoSink,
    "a.mov": sinks.OverlayVideoSink,
}


@pytest.mark.parametrize("name", FILES)
def test_a_suffix_says_which_sink(tmp_path, name):
    with sinks.open(tmp_path / name) as sink:
        assert type(sink) is FILES[name]
        assert sink.path == tmp_path / name


def test_folders_get_pictures(tmp_path):
    (tmp_path / "run.1").mkdir()
    for name in (tmp_path / "new", f"{tmp_path}/v1.2/", tmp_path / "run.1"):
        with sinks.open(name, suffix=".jpg") as sink:
            assert type(sink) is sinks.OverlayImagesSink
            assert sink.path.is_dir()


def test_a_picture_is_for_a_single_frame(tmp_path):
    with sinks.open(tmp_path / "new" / "a.PNG", draw=examples.draw) as sink:
        assert type(sink) is sinks.OverlayPictureSink
        sink.write(examples.frame(name="other.png"), examples.nothing())
        picture = sink.path.read_bytes()
        with pytest.raises(InputError, match=r"a\.PNG.*second frame"):
            sink.write(examples.frame(1), examples.nothing())
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.PNG"]
    assert sink.path.read_bytes() == picture
    with pytest.raises(InputError, match="name must end in"):
        sinks.OverlayPictureSink(tmp_path / "a.gif")


def test_a_picture_that_got_no_frame_leaves_what_was_there(tmp_path):
    (tmp_path / "a.png").write_text("precious")
    sinks.open(tmp_path / "a.png").close()
    assert (tmp_path / "a.png").read_text() == "precious"


@pytest.mark.parametrize("name", FILES)
def test_an_empty_file_is_no_older_result(tmp_path, name):
    for path in (tmp_path / name, tmp_path / "new" / name):
        path.parent.mkdir(exist_ok=True)
        if path.parent == tmp_path:
            path.write_bytes(b"")
        examples.open_sink(f"{path}").close()
    made = [path.read_bytes() if path.exists() else b"" for path in (tmp_path / name, tmp_path / "new" / name)]
    assert made[0] == made[1]


def failing(frame, result):
    raise ZeroDivisionError


@pytest.mark.parametrize("name", ["a.npz", "a.json"])
def test_a_first_frame_that_cannot_be_written_leaves_an_older_file(tmp_path, name, monkeypatch):
    with examples.open_sink(f"{tmp_path / name}") as sink:
        sink.write(examples.frame(), examples.detected(5))
    older = (tmp_path / name).read_bytes()
    sink = examples.open_sink(f"{tmp_path / name}")
    monkeypatch.setattr(sink, "_write", failing)
    with pytest.raises(ZeroDivisionError), sink:
        sink.write(examples.frame(), examples.detected(6))
    assert (tmp_path / name).read_bytes() == older


@pytest.mark.parametrize("name", FILES)
def test_an_older_file_is_replaced_with_the_first_frame_and_not_before(tmp_path, name):
    with examples.open_sink(f"{tmp_path / name}") as sink:
        sink.write(examples.frame(), examples.detected(5, in_space=True))
    older = (tmp_path / name).read_bytes()
    examples.open_sink(f"{tmp_path / name}").close()
    assert (tmp_path / name).read_bytes() == older
    with pytest.raises(ZeroDivisionError), examples.open_sink(f"{tmp_path / name}"):
        raise ZeroDivisionError
    assert (tmp_path / name).read_bytes() == older
    for _ in range(2):
        with examples.open_sink(f"{tmp_path / name}") as sink:
            sink.write(examples.frame(30), examples.detected(7, count=1, in_space=True))
        assert (tmp_path / name).read_bytes() != older
    (tmp_path / name).rename(tmp_path / "again")
    with examples.open_sink(f"{tmp_path / name}") as sink:
        sink.write(examples.frame(30), examples.detected(7, count=1, in_space=True))
    assert (tmp_path / name).read_bytes() == (tmp_path / "again").read_bytes()


def write_frames(name, count):
    with examples.open_sink(str(name)) as sink:
        for i in range(count):
            sink.write(examples.frame(i), examples.detected(i, 1, in_space=True))


@pytest.mark.parametrize(
    ("name", "folder", "left"),
    [("a.ply", "a", 3), ("a.obj", "a", 3), ("a.labelme", "a.labelme", 6), ("pictures", "pictures", 3)],
)
def test_files_of_an_earlier_run_that_stay_in_a_folder_are_counted_in_a_warning(tmp_path, caplog, name, folder, left):
    for count in (5, 5):
        write_frames(tmp_path / name, count)
    (tmp_path / folder / "notes.txt").write_text("mine")
    earlier = {path.name for path in (tmp_path / folder).iterdir()}
    assert not caplog.records
    write_frames(tmp_path / name, 2)
    (warning,) = caplog.records
    assert f"{tmp_path / folder}: files from before stay in this folder, {left} in all" in warning.getMessage()
    assert "such as 000002." in warning.getMessage()
    assert {path.name for path in (tmp_path / folder).iterdir()} == earlier


def test_the_mesh_of_a_single_frame_beside_a_folder_of_an_earlier_run_is_warned_of(tmp_path, caplog):
    write_frames(tmp_path / "a.ply", 2)
    write_frames(tmp_path / "a.ply", 1)
    (warning,) = caplog.records
    assert "files from before stay in this folder, 2 in all" in warning.getMessage()


def test_pictures_with_an_ending_are_no_earlier_ones_of_those_with_another(tmp_path, caplog):
    for ending in (".stages", ".overlay"):
        with sinks.OverlayImagesSink(tmp_path, examples.draw, ending=ending) as sink:
            sink.write(examples.frame(), examples.nothing())
    assert not caplog.records


@pytest.mark.parametrize("kind", [sinks.kind_of(name) for name in (*FILES, "a.png", "folder", "a.labelme")])
def test_an_empty_path_is_not_the_current_folder(tmp_path, monkeypatch, kind):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="empty"):
        kind("")
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_suffix_lists_the_known_ones(tmp_path):
    with pytest.raises(InputError, match=r"\.jsonl, .*\.npz.*folder"):
        sinks.open(tmp_path / "a.xlsx")


@pytest.mark.parametrize("name", FILES)
def test_a_folder_in_the_place_of_the_file(tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(SinkError, match=name):
        sinks.open(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", [*FILES, "pictures", "a.labelme"])
def test_a_file_in_the_place_of_the_folder(tmp_path, name):
    (tmp_path / "folder").write_text("precious")
    with pytest.raises(SinkError, match=name):
        sinks.open(tmp_path / "folder" / name)
    assert (tmp_path / "folder").read_text() == "precious"


@pytest.fixture
def nobody():
    """Take away root's rights for a while, since nothing is forbidden to root."""
    if not hasattr(os, "seteuid"):
        pytest.skip("needs POSIX permissions")
    user = os.geteuid()
    if user == 0:
        os.seteuid(65534)
    yield
    os.seteuid(user)


@pytest.mark.parametrize("name", [*FILES, "pictures", "a.labelme"])
def test_no_permission(tmp_path, name, request):
    tmp_path.chmod(0o500)
    request.getfixturevalue("nobody")
    with pytest.raises(SinkError, match="denied"):
        sinks.open(tmp_path / name)


@pytest.mark.parametrize("name", FILES)
def test_what_the_system_forbids_is_a_sink_error_and_the_older_file_stays(tmp_path, name, monkeypatch):
    (tmp_path / name).write_text("precious")

    def refuse(path, *args, **options):
        raise PermissionError(13, "Permission denied", str(path))

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", refuse)
        patch.setattr("os.replace", refuse)
        with pytest.raises(SinkError, match="Permission denied") as caught:
            sinks.open(tmp_path / name)
    assert isinstance(caught.value.__cause__, PermissionError)
    assert (tmp_path / name).read_text() == "precious"
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("name", ["a.jsonl", "a.csv", "a.mp4"])
def test_a_full_disk_is_a_sink_error(tmp_path, name):
    (tmp_path / name).symlink_to("/dev/full")
    options = {"draw": examples.draw} if name == "a.mp4" else {}

    def write():
        with sinks.open(tmp_path / name, **options) as sink:
            sink.write(examples.frame(), examples.detected())

    with pytest.raises(SinkError, match=r"a\..*space"):
        write()


@pytest.mark.parametrize("name", ["a.jsonl", "a.npz", "a.CSV", "a.json"])
def test_a_link_stays_and_the_file_that_it_leads_to_is_replaced(tmp_path, name):
    target = tmp_path / "results" / name
    target.parent.mkdir()
    target.write_text("older")
    link = tmp_path / name
    link.symlink_to(Path("results") / name)
    with sinks.open(link) as sink:
        sink.write(examples.frame(), examples.detected())
    assert link.is_symlink()
    assert target.read_bytes() == link.read_bytes() != b"older"
    assert not list(tmp_path.rglob("*.tmp"))


@pytest.mark.parametrize("name", [*FILES, "pictures", "a.labelme"])
def test_closing_twice_is_closing_once_and_then_nothing_is_written(tmp_path, name):
    sink = sinks.open(tmp_path / name)
    sink.close()
    sink.close()
    with pytest.raises(SinkError, match="closed"):
        sink.write(examples.frame(), examples.nothing())


class Recorder(sinks.Sink):
    def __init__(self, error=None):
        self.error, self.written, self.closed = error, 0, 0

    def write(self, frame, result):
        if self.error is not None:
            raise self.error
        self.written += 1

    def close(self):
        self.closed += 1
        if self.error is not None:
            raise self.error


def test_several_sinks_all_get_the_frame_and_all_are_closed(caplog):
    good = Recorder(), Recorder()
    first, second = SinkError("first"), SinkError("second")
    several = sinks.MultiSink([good[0], Recorder(first), Recorder(second), good[1]])
    for action in (lambda: several.write(examples.frame(), examples.nothing()), several.close):
        with pytest.raises(SinkError) as caught:
            action()
        assert caught.value is first
    assert "second" in caplog.text
    several.close()
    assert [(sink.written, sink.closed) for sink in good] == [(1, 1), (1, 1)]
    with pytest.raises(SinkError, match="closed"):
        several.write(examples.frame(), examples.nothing())


@pytest.mark.parametrize("link", [os.link, os.symlink])
def test_two_sinks_in_the_same_place_are_refused(tmp_path, link):
    (tmp_path / "a.csv").touch()
    link(tmp_path / "a.csv", tmp_path / "b.csv")
    with (
        sinks.open(tmp_path / "a.csv") as first,
        sinks.OverlayImagesSink(tmp_path / "c") as folder,
        Appended(tmp_path / "b.csv") as same,
    ):
        sinks.MultiSink([first, folder])
        with pytest.raises(InputError, match=r"same place: .*a\.csv' and .*b\.csv'"):
            sinks.MultiSink([first, folder, same])


class Appended(sinks.PathSink):
    """A sink of somebody else's."""

    def _write(self, frame, result):
        raise NotImplementedError

    def _close(self):
        """There is nothing to close."""


def test_ctrl_c_goes_before_other_errors():
    last = Recorder()
    several = sinks.MultiSink([Recorder(SinkError("disk")), Recorder(KeyboardInterrupt()), last])
    with pytest.raises(KeyboardInterrupt):
        several.close()
    assert last.closed == 1


def test_only_sinks_are_taken():
    with pytest.raises(InputError, match="str"):
        sinks.MultiSink(["a.csv"])


def test_importing_the_sinks_does_not_load_opencv():
    import subprocess

    code = "import sys, dloftbs.sinks; sys.exit('cv2' in sys.modules or 'av' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
