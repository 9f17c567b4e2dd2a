import io
import logging
import subprocess
import sys
from contextlib import contextmanager

import pytest
from cli.cli_inputs import COMMAND, mask, run, save, start

import dloftbs
from dloftbs.cli import commands, progress, shell
from dloftbs.config.colour_words import COLOUR_WORDS

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
    assert {"rich", "matplotlib", "av", "dloftbs.viz", "dloftbs.evaluation"} & loaded == set()


def test_the_console_script_is_installed():
    done = subprocess.run([COMMAND, "--version"], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == f"dloftbs {dloftbs.__version__}\n"


@pytest.mark.parametrize(
    "command", ["", "detect", "track", "batch", "demo", "config", "config print", "config check", "warmup"]
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


def test_warmup_says_what_it_did():
    assert run("warmup").stdout.startswith("kernels ")


def test_warmup_loads_every_kernel():
    code = (
        "from dloftbs.kernel_loading import load_kernels\n"
        "load_kernels()\n"
        "from dloftbs.kernels import compiler\n"
        "print(compiler._count._ready, compiler.kernel_count())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    ready, count = map(int, done.stdout.split())
    assert ready == count > 0


def test_warmup_shows_the_kernels_that_it_compiles(monkeypatch):
    def load():
        logger = logging.getLogger("dloftbs.kernels")
        logger.warning("compiling up to %d kernels", 115)
        logger.info("kernels ready: %d of %d", 37, 115)

    monkeypatch.setattr(commands.warmup, "load_kernels", load)
    monkeypatch.setattr(shell, "KERNEL_LINE_S", 0.0)
    result = run("warmup")
    assert result.stdout.startswith("kernels compiled, and saved for the next time, in ")
    assert result.stderr == "warning: compiling up to 115 kernels\nkernels ready: 37 of 115\n"


def test_warmup_shows_a_bar_on_a_terminal(monkeypatch, capsys):
    shown = []

    @contextmanager
    def bar(what):
        yield lambda ready, count: shown.append((what, ready, count))

    def load():
        logging.getLogger("dloftbs.kernels").info("kernels ready: %d of %d", 37, 115)

    monkeypatch.setattr(commands.warmup, "load_kernels", load)
    monkeypatch.setattr(progress, "open_count", bar)
    terminal = io.StringIO()
    terminal.isatty = lambda: True
    monkeypatch.setattr(sys, "stderr", terminal)
    commands.warmup.warmup.callback()
    assert shown == [("compiling kernels", 37, 115)]
    assert capsys.readouterr().out.startswith("kernels compiled")


def test_compilation_is_announced_once(tmp_path):
    # A cache of its own, empty, of which the kernels of segmentation alone are quick enough for a test.
    code = (
        "import click, logging\n"
        "from dloftbs.cli.shell import messages_to_stderr\n"
        "with messages_to_stderr():\n"
        "    import dloftbs.segmentation.kernels.colour_table\n"
        "    logging.getLogger('dloftbs.x').info('not shown')\n"
    )
    environment = {"NUMBA_CACHE_DIR": str(tmp_path), "PATH": ""}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env=environment, check=True
    )
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("warning: compiling up to ")


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
