"""Who may import whom: the layers of the package point one way, and importing it costs next to nothing."""

from __future__ import annotations

import ast
import functools
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest

import dloftbs
import dloftbs_lab

PACKAGE = Path(dloftbs.__file__).parent
LAB = Path(dloftbs_lab.__file__).parent

GROUND = {"errors", "config", "kernels", "support", "_version"}
TYPES = {"data", "camera", "evidence"}
"""`evidence` is a type that others ask, in a room of its own because it has kernels."""
ROOMS = {"segmentation", "cleaning", "skeleton", "linking", "fitting", "lifting", "pipeline.published", "tracking"}
"""Those of the stages."""
OUTSIDE = {"errors", "config", "support", "_version", "data", "camera"}
OPEN_BY_NAME = ("sources", "sinks")
"""Doors that open recordings of ROS, too: only there, and when a name asks for it, the room above is imported."""

MAY_IMPORT = {
    "errors": set(),
    "_version": set(),
    "kernels": set(),
    "support": {"errors"},
    "config": {"errors", "support"},
    "camera": GROUND,
    "data": GROUND | {"camera"},
    "evidence": GROUND | TYPES,
    **dict.fromkeys(ROOMS, GROUND | TYPES),
    "pipeline": GROUND | TYPES | ROOMS,
    "stereo": GROUND | TYPES | {"pipeline", "segmentation", "sources"},
    "api": OUTSIDE | {"pipeline", "segmentation"} | {"sources"},
    "sources": OUTSIDE | {"ros"},
    "robot": OUTSIDE | {"sources"},
    "sinks": OUTSIDE | {"viz", "ros"},
    "ros": OUTSIDE | {"sources", "sinks", "viz", "robot"},
    "topology": OUTSIDE,
    "viz": OUTSIDE,
    "ui": OUTSIDE | {"pipeline", "segmentation", "sinks", "sources", "viz"},
    "cli": OUTSIDE | {"api", "pipeline", "segmentation", "sources", "sinks", "stereo", "viz", "ros", "ui", "robot", ""},
    "__main__": {"cli"},
    "lab.truth": OUTSIDE,
    "lab.known_sequence": OUTSIDE | {"sources", "lab.truth"},
    "lab.synthetic": OUTSIDE | {"kernels", "lab.truth", "lab.known_sequence"},
    "lab.recorded": OUTSIDE | {"sources", "sinks", "lab.truth", "lab.known_sequence"},
    "lab.evaluation": OUTSIDE | {"kernels", "viz", "lab.truth", "lab.known_sequence", "lab.synthetic", "lab.recorded"},
    "lab.commands": OUTSIDE
    | {
        "cli",
        "pipeline",
        "segmentation",
        "stereo",
        "sources",
        "sinks",
        "viz",
        "lab.truth",
        "lab.synthetic",
        "lab.evaluation",
    },
}
"""From a room to those that it may import, itself aside; the package is "", rooms of the laboratory are "lab.X".

The published method is a room within the pipeline: it knows as little as the stages do.
"""

BEHIND_DOORS = ROOMS | {"camera", "config", "evidence", "stereo"}
KNOWN_TO_KERNELS = ("kernels.compiler", "kernels.shared")
SAME_NAME_ON_PURPOSE = {"__init__", "config", "demo", "view"}  # the commands are named as they are typed
ENDS_KNOWN_TO = {"data", "skeleton", "linking", "evidence", "tracking"}
HEAVY = ("numpy", "numba", "scipy", "cv2", "aiohttp")


def module_name(path: Path) -> str:
    """Return the name below the package, as in ``linking.loops``; a package's own is its folder's."""
    top = LAB if path.is_relative_to(LAB) else PACKAGE
    parts = ("lab",) * (top is LAB) + path.relative_to(top).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for top in (PACKAGE, LAB) for path in sorted(top.rglob("*.py"))}
LIBRARY = [name for name in MODULES if name not in ("", "lab")]


def room_of(name: str) -> str:
    """Return the folder, or the file, at the top of its package, or the room within it."""
    parts = name.split(".")
    inner = ".".join(parts[:2])
    return inner if parts[0] == "lab" or inner in MAY_IMPORT else parts[0]


def imports_of(name: str, source: str, *, is_package: bool = False) -> set[str]:
    """Return what of these packages a module imports anywhere in it, by names below them."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            origin = _origin(node, name, is_package)
            found |= {_resolve(origin, alias.name) for alias in node.names}
    known = (_below(full) for full in found)
    return {name for name in known if name is not None}


def _below(full: str) -> str | None:
    """Return the name below the package, or None for a package of others."""
    top, _, below = full.partition(".")
    if top == "dloftbs_lab":
        return f"lab.{below}".rstrip(".")
    return below if top == "dloftbs" else None


def _origin(node: ast.ImportFrom, name: str, is_package: bool) -> str:
    """Return the absolute name of the module that names are imported from."""
    if not node.level:
        return node.module or ""
    here = ["dloftbs_lab", *name.split(".")[1:]] if name.startswith("lab") else ["dloftbs", *name.split(".")]
    parents = here[: len(here) - node.level + is_package]
    return ".".join([*parents, node.module] if node.module else parents)


def _resolve(origin: str, name: str) -> str:
    """Return the module that a name comes from: a submodule, or what the package loads it from, or the origin."""
    for package in (dloftbs, dloftbs_lab):
        if origin == package.__name__ and name in package._HOME:
            return f"{origin}.{package._HOME[name]}"
    return f"{origin}.{name}" if _below(f"{origin}.{name}") in MODULES else origin


def violations(name: str, imported: Iterable[str]) -> list[str]:
    """Return which of the imported modules a module must not know."""
    return [other for other in sorted(imported) if not may_import(name, other)]


def may_import(name: str, other: str) -> bool:
    """Say whether a module may import another one of the packages."""
    if is_kernel(name):
        same_folder = name.rpartition(".")[0] == other.rpartition(".")[0]
        return other.startswith(KNOWN_TO_KERNELS) or same_folder
    if room_of(name) == room_of(other):
        return True
    if room_of(other) in BEHIND_DOORS and other != room_of(other):
        return False
    return room_of(other) in MAY_IMPORT[room_of(name)]


def is_kernel(name: str) -> bool:
    """Say whether a module is one of compiled loops."""
    return "kernels" in name.split(".")


@functools.cache
def imports_of_file(name: str) -> frozenset[str]:
    return frozenset(imports_of(name, source_of(name), is_package=MODULES[name].name == "__init__.py"))


def source_of(name: str) -> str:
    return MODULES[name].read_text(encoding="utf-8")


def found_in(names: Iterable[str], find: Callable[[str], Iterable[str]]) -> dict[str, list[str]]:
    """Return what is found in modules, by the names of those in which something is."""
    return {name: found for name in names if (found := sorted(find(name)))}


def test_imports_point_the_way_the_design_allows():
    assert found_in(LIBRARY, lambda name: violations(name, imports_of_file(name))) == {}


def test_the_rules_cover_every_part_of_the_package():
    assert {room_of(name) for name in LIBRARY} - MAY_IMPORT.keys() == set()


@pytest.mark.parametrize(
    ("name", "source", "expected"),
    [
        ("data.curve", "from dloftbs.linking import link", ["linking"]),
        ("data.curve", "def f():\n    from dloftbs.kernels import tracing", []),
        ("data.frame", "if TYPE_CHECKING:\n    import dloftbs.pipeline", ["pipeline"]),
        ("data.frame_result", "from dloftbs import viz", ["viz"]),
        ("viz.overlay", "from dloftbs import Pipeline, BSplineCurve", ["pipeline"]),
        ("viz.overlay", "from dloftbs import sources", ["sources"]),
        ("viz.overlay", "import dloftbs", [""]),
        ("viz.overlay", "from dloftbs.viz import shapes", []),
        ("linking.loops", "from dloftbs.cleaning import clean", ["cleaning"]),
        ("linking.loops", "from . import end_matching", []),
        ("linking.loops", "from ..tracking import Tracker", ["tracking"]),
        ("linking.loops", "from dloftbs.evidence import EvidenceMap", []),
        ("linking.loops", "from dloftbs.evidence.kernels import gap_pixels", ["evidence.kernels.gap_pixels"]),
        ("linking.loops", "from dloftbs.skeleton.kernels import junctions", ["skeleton.kernels.junctions"]),
        ("linking.kernels.pair_costs", "from dloftbs.kernels import compiler, tracing", ["kernels.tracing"]),
        ("linking.kernels.pair_costs", "from dloftbs.errors import InputError", ["errors"]),
        ("linking.kernels.pair_costs", "from dloftbs.linking.kernels import end_matching", []),
        (
            "linking.kernels.pair_costs",
            "from dloftbs.skeleton.kernels import junctions",
            ["skeleton.kernels.junctions"],
        ),
        ("tracking", "from dloftbs.linking import link", ["linking"]),
        ("pipeline.published.walks", "from dloftbs.linking import link", ["linking"]),
        ("sinks.npz_curves", "from dloftbs import viz, sources", ["sources"]),
        ("sources.video", "from dloftbs.tracking import Tracker\nimport numpy, os.path", ["tracking"]),
        ("pipeline", "from dloftbs.cli import main", ["cli"]),
        ("pipeline.stages", "from dloftbs.linking import link", []),
        ("pipeline.stages", "from dloftbs.linking.loops import open_loops", ["linking.loops"]),
        ("cli.shell", "from dloftbs_lab.evaluation import l1", ["lab.evaluation"]),
        ("cli.shell", "from dloftbs_lab import open_labelled", ["lab.recorded"]),
        ("lab.commands.demo_run", "from dloftbs.fitting import find_crossings", ["fitting"]),
        ("lab.synthetic.rgb", "from dloftbs.pipeline import Pipeline", ["pipeline"]),
        ("fitting", "from dloftbs.config.fitting import FittingConfig", ["config.fitting"]),
    ],
)
def test_an_import_that_points_the_wrong_way_is_found(name, source, expected):
    assert violations(name, imports_of(name, source)) == expected


def test_a_relative_import_of_a_package_is_resolved_from_within():
    assert imports_of("viz", "from .overlay import draw\nfrom . import shapes", is_package=True) == {
        "viz.overlay",
        "viz.shapes",
    }


def others(source: str) -> set[str]:
    """Return the first names of what a module imports from anywhere."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found.add((node.module or "").partition(".")[0])
    return found


def test_numba_stands_in_kernels_alone():
    plain = [name for name in LIBRARY if not is_kernel(name)]
    assert found_in(plain, lambda name: {"numba"} & others(source_of(name))) == {}


def test_no_module_imports_itself_by_way_of_others():
    left = {name: imports_of_file(name) - {name, ""} for name in LIBRARY}
    for name in OPEN_BY_NAME:
        left[name] -= {"ros"}
    while free := [name for name, imported in left.items() if not imported & left.keys()]:
        for name in free:
            del left[name]
    assert sorted(left) == []


@pytest.mark.parametrize("room", OPEN_BY_NAME)
def test_recordings_are_opened_at_the_door_alone_and_late(room):
    names = [name for name in MODULES if room_of(name) == room]
    found = found_in(names, lambda name: {"ros"} & {room_of(other) for other in imports_of_file(name)})
    assert found.keys() <= {room}
    at_once = [node for node in ast.parse(source_of(room)).body if not isinstance(node, ast.FunctionDef)]
    assert not any("dloftbs.ros" in ast.unparse(node) for node in at_once)


def test_a_file_name_stands_for_one_thing():
    """The kernels of a file may have its name."""
    places: dict[str, set[str]] = {}
    for name, path in MODULES.items():
        parts = [part for part in name.split(".")[:-1] if part != "kernels"]
        places.setdefault(path.stem if path.stem.startswith("__") else path.stem.lstrip("_"), set()).add(
            ".".join(parts)
        )
    twice = {stem: sorted(found) for stem, found in places.items() if len(found) > 1}
    assert {stem: found for stem, found in twice.items() if stem not in SAME_NAME_ON_PURPOSE} == {}


def loud_calls(source: str) -> Iterator[str]:
    """Yield what in a module prints to, or ends, the process of somebody else."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Call(func=ast.Name(id="print" | "exit" | "quit" as name)):
                yield name
            case (
                ast.Attribute(value=ast.Name(id="sys"), attr="exit")
                | ast.Attribute(value=ast.Name(id="os"), attr="_exit")
            ):
                yield ast.unparse(node)
            case ast.ImportFrom(module="sys", names=names) if any(alias.name == "exit" for alias in names):
                yield "sys.exit"
            case ast.Raise(exc=ast.Name(id="SystemExit") | ast.Call(func=ast.Name(id="SystemExit"))):
                yield "SystemExit"


def test_library_code_neither_prints_nor_exits():
    quiet = [name for name in MODULES if room_of(name) not in ("cli", "lab.commands")]
    assert found_in(quiet, lambda name: loud_calls(source_of(name))) == {}


@pytest.mark.parametrize(
    "source",
    [
        "print(1)",
        "sys.exit(1)",
        "from sys import exit",
        "os._exit(0)",
        "raise SystemExit",
        "raise SystemExit(2)",
        "exit()",
    ],
)
def test_code_that_prints_or_exits_is_found(source):
    assert len(list(loud_calls(f"def f():\n    {source}"))) == 1


def loaded_by(statement: str) -> set[str]:
    """Return the modules that a fresh interpreter holds after a statement."""
    code = f"import sys; {statement}; print(*sys.modules)"
    return set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())


@pytest.mark.parametrize(
    "statement", ["import dloftbs", "from dloftbs import Config, InputError", "dir(__import__('dloftbs'))"]
)
def test_nothing_heavy_is_loaded_before_it_is_needed(statement):
    loaded = loaded_by(statement)
    assert "dloftbs" in loaded
    assert loaded.isdisjoint(HEAVY)


def test_the_data_types_load_no_compiler_and_no_opencv():
    loaded = loaded_by("from dloftbs import Detection, Frame, Track, PinholeCamera")
    assert "numpy" in loaded
    assert loaded.isdisjoint({"numba", "cv2"})


@pytest.mark.parametrize("room", ["ros", "sinks", "topology", "viz"])
def test_a_room_lists_its_public_names_alone(room):
    """Whoever explores it in a shell sees no modules of ours, and none of others."""
    assert dir(getattr(dloftbs, room)) == sorted(getattr(dloftbs, room).__all__)


def test_every_public_name_is_there():
    assert [name for name in dloftbs.__all__ if getattr(dloftbs, name, None) is None] == []
    assert set(dloftbs.__all__) <= set(dir(dloftbs))


def test_the_public_names_are_sorted_and_their_own():
    assert dloftbs.__all__ == sorted(set(dloftbs.__all__))
    assert {*dloftbs._HOME, *dloftbs._SUBMODULES, "__version__"} == set(dloftbs.__all__)


@pytest.mark.parametrize("name", ["detekt", "np", "Sequence", "__wrapped__"])
def test_a_name_that_is_not_there_is_an_attribute_error(name):
    with pytest.raises(AttributeError, match=f"module 'dloftbs' has no attribute '{name}'"):
        getattr(dloftbs, name)


def test_criteria_know_no_source_and_no_picture():
    foreign = {"sources", "lab.recorded", "lab.synthetic", "viz"}
    criteria = [
        name
        for name in MODULES
        if name.startswith("lab.evaluation.") and name.split(".")[2] not in ("suites", "runner", "report")
    ]
    assert found_in(criteria, lambda name: foreign & {room_of(other) for other in imports_of_file(name)}) == {}


def end_arithmetic(source: str) -> list[str]:
    """Return the expressions of a module that compute with the numbers of branch ends by themselves."""
    found = []
    for node in ast.walk(ast.parse(source)):
        match node:
            case (
                ast.BinOp(op=ast.BitXor(), right=ast.Constant(value=1))
                | ast.BinOp(left=ast.Name(id="end"), op=ast.FloorDiv() | ast.Mod() | ast.RShift() | ast.BitAnd())
            ):
                found.append(ast.unparse(node))
    return found


def test_the_numbers_of_ends_are_read_by_the_functions_of_graph_ends_alone():
    rooms = [name for name in MODULES if room_of(name) in ENDS_KNOWN_TO]
    assert found_in(rooms, lambda name: end_arithmetic(source_of(name))) == {}


@pytest.mark.parametrize("source", ["far = nodes[end ^ 1]", "spurs[end // 2]", "step = 1 if end % 2 == 0 else -1"])
def test_arithmetic_with_the_numbers_of_ends_is_found(source):
    assert len(end_arithmetic(source)) == 1
