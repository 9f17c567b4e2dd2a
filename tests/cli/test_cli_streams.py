"""Whatever the standard streams, the locale and the names of files are, the command ends clearly."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import sinks.sink_examples as examples
from cli.cli_inputs import COMMAND, mask, save

from dloftbs import sinks

POSIX = {"LC_ALL": "C", "PYTHONUTF8": "0"}
UTF8 = {"LC_ALL": "C.UTF-8", "PYTHONUTF8": "1"}

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="redirections of a POSIX shell")


def shell(line, folder, environment=UTF8):
    """Run a line of a shell, in which ``dloftbs`` is the command, in a folder."""
    known = {name: value for name, value in os.environ.items() if name != "PYTHONIOENCODING"}
    path = f"{COMMAND.parent}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        ["bash", "-c", line],
        cwd=folder,
        env=known | environment | {"PATH": path},
        capture_output=True,
        timeout=120,
        check=False,
    )


@pytest.fixture
def folder(tmp_path):
    save(tmp_path / "mask.png", mask())
    (tmp_path / "settings.yaml").write_text("{}")
    return tmp_path


LOUD = ["--help", "--version", "demo -h", "config print", "config check settings.yaml", "track mask.png --kind mask"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("arguments", LOUD)
def test_a_full_standard_output_is_an_error_in_a_line(folder, arguments):
    done = shell(f"dloftbs {arguments} > /dev/full", folder)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == b"error: cannot write to standard output: No space left on device"
    assert b"Traceback" not in done.stderr
    assert b"ignored" not in done.stderr


@pytest.mark.parametrize("arguments", LOUD)
def test_a_closed_standard_output_is_an_error_in_a_line(folder, arguments):
    done = shell(f"dloftbs {arguments} >&-", folder)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == b"error: cannot write to standard output: Bad file descriptor"
    assert b"Traceback" not in done.stderr


@pytest.mark.parametrize("arguments", LOUD)
def test_a_closed_pipe_ends_quietly_as_a_signal_would(folder, arguments):
    # The reader has gone before the command starts to write.
    done = shell(f"(sleep 0.3; exec dloftbs {arguments}) | true; exit ${{PIPESTATUS[0]}}", folder)
    assert done.returncode == 141
    assert b"Traceback" not in done.stderr
    assert b"rror" not in done.stderr


@pytest.mark.parametrize("streams", ["<&- >&- 2>&-", "2>/dev/full"])
def test_streams_that_nobody_needs_may_be_closed(folder, streams):
    done = shell(f"dloftbs track mask.png --kind mask --out a.jsonl --overlay a.mp4 {streams}", folder)
    assert done.returncode == 0
    assert b"Traceback" not in done.stderr
    (record,) = sinks.read_json_lines(folder / "a.jsonl")
    assert len(record["tracks"]) == 1


def test_a_lost_standard_output_costs_the_files_nothing(folder):
    done = shell("dloftbs track mask.png --kind mask --out - --out a.jsonl > /dev/full", folder)
    assert done.returncode == 1
    assert len(list(sinks.read_json_lines(folder / "a.jsonl"))) == 1


@pytest.fixture
def names(folder):
    """Return two names, of which there are masks in a folder of their own: one is no UTF-8, one is not ASCII."""
    found = [os.fsdecode(b"a\xff.png"), os.fsdecode("kä.png".encode())]
    for name in found:
        plain = save(folder / "masks" / "plain.png", mask())
        try:
            plain.rename(folder / "masks" / name)
        except OSError:
            pytest.skip("a file system that takes UTF-8 alone")
    return found


@pytest.mark.parametrize("environment", [UTF8, POSIX], ids=["utf-8", "posix"])
def test_any_name_is_written(folder, names, environment):
    name = names[0]
    outs = " ".join(f'--out "{name}.{suffix}"' for suffix in ("jsonl", "csv", "npz"))
    overlays = f'--overlay "over{name}/" --stages stages'
    done = shell(f"dloftbs detect masks --out - {outs} {overlays}", folder, environment)
    assert done.returncode == 0, done.stderr
    assert [json.loads(line)["name"] for line in done.stdout.splitlines()] == [r"a\xff.png", "kä.png"]
    assert (folder / f"{name}.jsonl").read_bytes() == done.stdout
    assert r"for a\xff.png" in (folder / f"{name}.config.yaml").read_text("utf-8").splitlines()[0]
    assert len(list((folder / f"over{name}").iterdir())) == 2


@pytest.mark.parametrize("environment", [UTF8, POSIX], ids=["utf-8", "posix"])
def test_any_name_is_said(folder, names, environment):
    for name in names:
        (folder / name).write_text("{}")
        for line, code in [(f'config check "{name}"', 0), (f'config check "masks/{name}"', 1), (f'"{name}"', 2)]:
            done = shell(f"dloftbs {line}", folder, environment)
            assert done.returncode == code
            said = (done.stdout + done.stderr).decode("utf-8")
            assert "Traceback" not in said
            assert re.search(r"(a\\udcff|kä|k\\udcc3\\udca4)\.png", said)


def test_videos_of_any_name_are_read_and_written(folder, names):
    with sinks.OverlayVideoSink(folder / "plain.mp4", draw=examples.draw) as video:
        for i in range(3):
            video.write(examples.frame(i), examples.nothing(i))
    for name in names:
        shutil.copy(folder / "plain.mp4", folder / f"{name}.mp4")
        line = f'dloftbs track "{name}.mp4" --kind mask --overlay "over{name}.mp4"'
        done = shell(line, folder, POSIX)
        assert done.returncode == 0, done.stderr
        assert (folder / f"over{name}.mp4").stat().st_size > 1000


def test_an_address_that_is_no_text_is_refused(folder):
    done = shell('dloftbs track "http://127.0.0.1:9/\udcff"', folder)
    assert done.returncode == 1
    assert b"no UTF-8" in done.stderr


def test_a_second_process_is_refused(folder):
    with sinks.open(folder / "a.csv"):
        done = shell("dloftbs track mask.png --kind mask --out a.csv", folder)
    assert done.returncode == 1
    assert done.stderr.startswith(b"error: cannot write 'a.csv': somebody else is writing it; wait")
    assert sorted(path.name for path in folder.iterdir()) == ["a.csv", "mask.png", "settings.yaml"]


@pytest.mark.parametrize("command", ["demo --quick", "evaluate kinds --quick"])
def test_a_folder_that_somebody_else_writes_is_refused(folder, command):
    from dloftbs.support.claims import Claim

    (folder / "out").mkdir()
    with Claim(folder / "out"):
        done = shell(f"dloftbs {command} --out out", folder)
    assert done.returncode == 1
    assert done.stderr.startswith(b"error: cannot write 'out': somebody else is writing it")
    assert list((folder / "out").iterdir()) == []
