import re
import subprocess
import sys

import click
import pytest
from cli.cli_inputs import COMMAND, mask, run, save, start

import dloftbs
from dloftbs.cli import main
from dloftbs.cli.help_sections import ORDER, SECTIONS
from dloftbs.config.colour_words import COLOUR_WORDS
from dloftbs.pipeline import kernel_loading

HEAVY = {"numpy", "cv2", "numba", "rich", "scipy", "msgspec", "yaml", "matplotlib"}


def loaded_by(*arguments):
    """The modules in memory when the command has ended."""
    code = (
        "import atexit, sys\n"
        f"sys.argv = {['dloftbs', *map(str, arguments)]!r}\n"
        "atexit.register(lambda: print('MODULES', *sys.modules, file=sys.stderr))\n"
        "from dloftbs.cli import main\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    return set(done.stderr.rpartition("MODULES")[2].split())


@pytest.mark.parametrize(
    "arguments",
    [
        ("--help",),
        ("--version",),
        ("detect", "--help"),
        ("track", "-h"),
        ("batch", "-h"),
        ("demo", "--help"),
        ("config", "print", "-h"),
    ],
)
def test_help_loads_nothing_heavy(arguments):
    assert not HEAVY & loaded_by(*arguments)


def test_detect_loads_no_pictures_and_no_progress(tmp_path):
    loaded = loaded_by("detect", save(tmp_path / "mask.png", mask()))
    assert "dloftbs.pipeline" in loaded
    assert {"rich", "matplotlib", "av", "dloftbs.viz", "dloftbs_lab.evaluation"} & loaded == set()


def test_the_console_script_is_installed():
    done = subprocess.run([COMMAND, "--version"], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == f"dloftbs {dloftbs.__version__}\n"


@pytest.mark.parametrize(
    "command", ["", "detect", "track", "batch", "diagnose", "demo", "config", "config print", "config check", "warmup"]
)
def test_every_command_has_help(command):
    assert "Usage:" in run(*command.split(), "--help").output


@pytest.mark.parametrize(
    "arguments",
    [
        ("nonsense",),
        ("detect",),
        ("detect", "x.png", "--kind", "video"),
        ("detect", "x.png", "--hsv", "rosso"),
        ("detect", "x.png", "--hsv", "0:300"),
        ("detect", "x.png", "--set", "linking.objects"),
        ("detect", "x.png", "--set", "linking.objects=[1"),
        ("detect", "x.png", "--camera", "1,2,3"),
        ("detect", "x.png", "--camera", "0,1,2,3"),
        ("detect", "x.png", "--out", "curves.txt"),
        ("detect", "x.png", "--out", "a.csv", "--out", "a.csv"),
        ("detect", "x.png", "--overlay", "overlay.mp4"),
        ("detect", "x.png", "--overlay", "same", "--stages", "./same"),
        ("detect", "x.png", "--masks", "m.png", "--kind", "mask"),
        ("detect", "x.png", "y.png", "--masks", "m.png"),
        ("track", "a.mp4", "b.mp4"),
        ("track", "a.mp4", "--overlay", "curves.jsonl"),
        ("track", "a.mp4", "--limit", "0"),
        ("demo", "--size", "big"),
    ],
)
def test_bad_usage_is_2(arguments):
    result = run(*arguments, code=2)
    assert result.stdout == ""
    assert "Error:" in result.stderr


def test_warmup_loads_every_kernel():
    code = (
        "from dloftbs.pipeline.kernel_loading import load_kernels\n"
        "load_kernels()\n"
        "from dloftbs.kernels import compiler\n"
        "print(sum(bool(one._dispatcher.signatures) for one in compiler._kernels), len(compiler._kernels))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    ready, count = map(int, done.stdout.split())
    assert ready == count > 100


@pytest.mark.parametrize(
    ("compiled", "said"), [(37, "37 kernels compiled, and saved for the next time, in "), (0, "all kernels loaded in ")]
)
def test_warmup_says_what_it_did(monkeypatch, compiled, said):
    monkeypatch.setattr(kernel_loading, "load_kernels", lambda: compiled)
    assert run("warmup").stdout.startswith(said)


def test_compilation_is_announced_once(tmp_path):
    # A cache of its own, empty; one kernel is quick enough for a test.
    code = (
        "from dloftbs.cli.shell import messages_to_stderr\n"
        "with messages_to_stderr():\n"
        "    import dloftbs.segmentation.kernels.colour_table\n"
        "    from dloftbs.kernels import compiler\n"
        "    compiler.make_ready(['segmentation.kernels.colour_table'])\n"
    )
    environment = {"NUMBA_CACHE_DIR": str(tmp_path), "PATH": ""}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env=environment, check=True
    )
    announced, *progress = done.stderr.splitlines()
    assert announced.startswith("compiling kernels, once for this machine and version")
    assert all(re.fullmatch(r"\d kernels compiled in \d+ s", line) for line in progress)


def test_a_closed_pipe_is_no_traceback(tmp_path):
    for i in range(120):  # whose lines, of 1 kB, are more than a pipe holds
        save(tmp_path / f"{i}.png", mask())
    process = start("detect", tmp_path)
    process.stdout.readline()
    process.stdout.close()
    errors = process.stderr.read()
    process.stderr.close()
    assert process.wait(30) == 141
    assert errors == ""


@pytest.mark.parametrize("command", ["detect", "track", "batch"])
def test_help_keeps_its_examples_on_lines_of_their_own(command):
    lines = run(command, "--help").stdout.splitlines()
    assert not any("\\b" in line for line in lines)
    assert sum(line.startswith(f"  dloftbs {command} ") for line in lines) >= 2


def test_help_lists_the_words_for_colours():
    assert f"({', '.join(COLOUR_WORDS)})" in " ".join(run("detect", "--help").stdout.split())


def test_help_lists_commands_in_the_order_of_use_with_three_examples():
    text = run("--help").stdout
    listed = re.findall(r"^  (\w+)  ", text[text.index("Commands:") :], re.MULTILINE)
    assert listed[:4] == ["demo", "tune", "detect", "track"]
    assert sorted(listed) == sorted(ORDER)
    assert len(re.findall(r"^  dloftbs (\w+)", text, re.MULTILINE)) == 3


@pytest.mark.parametrize("command", ["detect", "track", "stereo", "batch"])
def test_help_lists_options_under_six_headings(command):
    text = run(command, "--help").stdout
    assert re.findall(r"^(\w[\w ]*):$", text, re.MULTILINE) == list(SECTIONS)
    options = [parameter for parameter in main.commands[command].params if isinstance(parameter, click.Option)]
    assert all(len(re.findall(rf"^  (?:-\w, )?{option.opts[0]}\b", text, re.MULTILINE)) >= 1 for option in options)


def test_every_option_with_a_heading_is_there():
    there = {parameter.name for command in main.commands.values() for parameter in command.params}
    assert {name for names in SECTIONS.values() for name in names} <= there
