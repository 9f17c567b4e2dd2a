"""Who may import whom: the layers of the package point one way, and importing it costs next to nothing."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import dloftbs

PACKAGE = Path(dloftbs.__file__).parent

GROUND = {
    "errors",
    "config",
    "kernels",
    "_array_likes",
    "spline_geometry",
    "_arrays",
    "_documents",
    "_json",
    "_npy",
    "_text",
    "_values",
    "_version",
}
DATA = {
    "curve",
    "centerline",
    "camera",
    "depth",
    "detection",
    "frame",
    "frame_region",
    "frame_result",
    "mask_crop",
    "prior",
    "evidence",
    "graph",
    "observation",
    "stage_trace",
    "tracks",
    "truth",
    "u_mapping",
}
ROOMS = {
    "segmentation",
    "cleaning",
    "skeleton",
    "linking",
    "fitting",
    "crossings",
    "lifting",
    "published",
    "tracking",
}
"""Those of the stages; `evidence` is a type that others ask, in a room of its own because it has kernels."""

KNOWN_OUTSIDE = {
    "errors",
    "config",
    "_array_likes",
    "_arrays",
    "_documents",
    "_json",
    "_npy",
    "_text",
    "_values",
    "_version",
    "curve",
    "centerline",
    "camera",
    "detection",
    "frame",
    "frame_region",
    "frame_result",
    "stage_trace",
    "tracks",
    "truth",
    "u_mapping",
}
BELOW_PIPELINE = GROUND | DATA | ROOMS
SHOW_THEMSELVES = ("frame_result", "stage_trace")
"""In a notebook: only there they import what draws them."""
OPEN_BY_NAME = ("sources", "sinks")
"""Doors that open recordings of ROS, too: only there, and when a name asks for it, the room above is imported."""

MAY_IMPORT = {
    "errors": set(),
    "config": {"errors", "_documents", "_values"},
    "_documents": {"errors"},
    "_npy": set(),
    "_array_likes": {"errors", "_values"},
    "_arrays": {"errors", "_array_likes"},
    "_values": {"errors"},
    "_json": set(),
    "_text": set(),
    "_version": set(),
    "spline_geometry": {"_arrays"},
    "overlap": set(),
    "worker_process": set(),
    "kernels": set(),
    **{name: (GROUND - {"kernels"}) | (DATA - {name}) for name in DATA},
    **{name: GROUND | (DATA - {name}) for name in ("camera", "evidence", "graph", "observation", "prior")},
    **dict.fromkeys(ROOMS, GROUND | DATA),
    **{name: (GROUND - {"kernels"}) | (DATA - {name}) | {"viz"} for name in SHOW_THEMSELVES},
    "frame_result": (GROUND - {"kernels"}) | (DATA - {"frame_result"}) | {"viz", "sinks"},
    "plausibility": {"_arrays", "config"},
    "mask_faults": {"_arrays", "cleaning", "config", "detection"},
    "inspection": (GROUND - {"kernels"}) | DATA,
    "whole_image": (GROUND - {"kernels"}) | DATA,
    "stage_order": (BELOW_PIPELINE - {"tracking"}) | {"plausibility"},
    "pipeline": GROUND
    | DATA
    | {"inspection", "lifting", "plausibility", "published", "segmentation", "stage_order", "tracking", "whole_image"},
    "pipeline_group": GROUND | DATA | {"crossings", "pipeline"},
    "api": KNOWN_OUTSIDE | {"pipeline", "segmentation", "sources"},
    "kernel_loading": {"camera", "config", "frame", "kernels", "pipeline"},
    "sources": KNOWN_OUTSIDE | {"overlap", "ros"},
    "synthetic": KNOWN_OUTSIDE | {"kernels", "sources"},
    "sinks": KNOWN_OUTSIDE | {"viz", "ros"},
    "ros": KNOWN_OUTSIDE | {"sources", "sinks", "viz"},
    "evaluation": KNOWN_OUTSIDE | {"kernels", "sources", "synthetic", "viz", "worker_process"},
    "viz": KNOWN_OUTSIDE,
    "steadiness": {"tracks"},
    "ui": KNOWN_OUTSIDE
    | {"overlap", "pipeline", "plausibility", "segmentation", "sinks", "sources", "steadiness", "viz"},
    "__main__": {"cli"},
    "cli": KNOWN_OUTSIDE
    | {"api", "pipeline", "pipeline_group", "segmentation", "sources", "synthetic", "sinks", "evaluation", "viz"}
    | {"kernel_loading", "mask_faults", "overlap", "ros", "steadiness", "ui", "worker_process", ""},
}
"""From the first name below the package to those that it may import, itself aside; the package itself is ""."""

BEHIND_DOORS = ROOMS | {"camera", "config", "evidence"}
KNOWN_TO_KERNELS = ("kernels.compiler", "kernels.shared")
SAME_NAME_ON_PURPOSE = {"__init__", "config", "demo", "view"}  # the commands are named as they are typed
ENDS_KNOWN_TO = {"graph", "skeleton", "linking", "prior", "evidence", "tracking"}
HEAVY = ("numpy", "numba", "scipy", "cv2", "aiohttp")


def module_name(path: Path) -> str:
    """Return the name below the package, as in ``linking.loops``; a package's own is its folder's."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}
LIBRARY = [name for name in MODULES if name]


def imports_of(name: str, source: str, *, is_package: bool = False) -> set[str]:
    """Return what of this package a module imports anywhere in it, by names below the package."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            origin = _origin(node, name, is_package)
            found |= {_resolve(origin, alias.name) for alias in node.names}
    return {full.partition(".")[2] for full in found if full.partition(".")[0] == "dloftbs"}


def _origin(node: ast.ImportFrom, name: str, is_package: bool) -> str:
    """Return the absolute name of the module that names are imported from."""
    if not node.level:
        return node.module or ""
    here = f"dloftbs.{name}".split(".")
    parents = here[: len(here) - node.level + is_package]
    return ".".join([*parents, node.module] if node.module else parents)


def _resolve(origin: str, name: str) -> str:
    """Return the module that a name comes from: a submodule, or what the package loads it from, or the origin."""
    if origin == "dloftbs" and name in dloftbs._HOME:
        return f"dloftbs.{dloftbs._HOME[name]}"
    below = f"{origin}.{name}".partition(".")[2]
    return f"dloftbs.{below}" if origin.partition(".")[0] == "dloftbs" and below in MODULES else origin


def violations(name: str, imported: set[str]) -> list[str]:
    """Return which of the imported modules a module must not know."""
    return [other for other in sorted(imported) if not may_import(name, other)]


def may_import(name: str, other: str) -> bool:
    """Say whether a module may import another one of the package."""
    top, other_top = name.partition(".")[0], other.partition(".")[0]
    if is_kernel(name):
        same_folder = name.rpartition(".")[0] == other.rpartition(".")[0]
        return other.startswith(KNOWN_TO_KERNELS) or same_folder
    if top == other_top:
        return True
    if other_top in BEHIND_DOORS and other != other_top:
        return False
    return other_top in MAY_IMPORT[top]


def is_kernel(name: str) -> bool:
    """Say whether a module is one of compiled loops."""
    return "kernels" in name.split(".")


def imports_of_file(name: str) -> set[str]:
    path = MODULES[name]
    return imports_of(name, path.read_text(encoding="utf-8"), is_package=path.name == "__init__.py")


@pytest.mark.parametrize("name", LIBRARY)
def test_imports_point_the_way_the_design_allows(name):
    assert violations(name, imports_of_file(name)) == []


def test_the_rules_cover_every_part_of_the_package():
    assert {name.partition(".")[0] for name in LIBRARY} - MAY_IMPORT.keys() == set()


@pytest.mark.parametrize(
    ("name", "source", "expected"),
    [
        ("curve", "from dloftbs.linking import link", ["linking"]),
        ("curve", "def f():\n    from dloftbs.kernels import tracing", ["kernels.tracing"]),
        ("frame", "if TYPE_CHECKING:\n    import dloftbs.pipeline", ["pipeline"]),
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
        ("published.walks", "from dloftbs.linking import link", ["linking"]),
        ("sinks.npz_curves", "from dloftbs import viz, sources", ["sources"]),
        ("sources.video", "from dloftbs.tracking import Tracker\nimport numpy, os.path", ["tracking"]),
        ("pipeline", "from dloftbs.cli import main", ["cli"]),
        ("stage_order", "from dloftbs.linking import link", []),
        ("stage_order", "from dloftbs.linking.loops import open_loops", ["linking.loops"]),
        ("stage_order", "from dloftbs.tracking import Tracker", ["tracking"]),
        ("inspection", "from dloftbs.published import walk", ["published"]),
        ("cli.demo_run", "from dloftbs.crossings import find_crossings", ["crossings"]),
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


@pytest.mark.parametrize("name", LIBRARY)
def test_numba_stands_in_kernels_alone(name):
    assert is_kernel(name) or "numba" not in others(MODULES[name].read_text(encoding="utf-8"))


def test_no_module_imports_itself_by_way_of_others():
    left = {name: imports_of_file(name) - {name, ""} for name in LIBRARY}
    for name in SHOW_THEMSELVES:
        left[name] -= {"viz"}
    left["frame_result"] -= {name for name in left if name.partition(".")[0] == "sinks"}  # late, to write itself
    for name in OPEN_BY_NAME:
        left[name] -= {"ros"}
    while free := [name for name, imported in left.items() if not imported & left.keys()]:
        for name in free:
            del left[name]
    assert sorted(left) == []


@pytest.mark.parametrize("name", [name for name in MODULES if name.partition(".")[0] in OPEN_BY_NAME])
def test_recordings_are_opened_at_the_door_alone_and_late(name):
    path = MODULES[name]
    if "ros" in {found.partition(".")[0] for found in imports_of_file(name)}:
        assert name in OPEN_BY_NAME
    at_once = [
        node for node in ast.parse(path.read_text(encoding="utf-8")).body if not isinstance(node, ast.FunctionDef)
    ]
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


@pytest.mark.parametrize("name", [name for name in MODULES if name.partition(".")[0] != "cli"])
def test_library_code_neither_prints_nor_exits(name):
    assert list(loud_calls(MODULES[name].read_text(encoding="utf-8"))) == []


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


@pytest.mark.parametrize("room", ["ros", "sinks", "viz"])
def test_a_room_lists_its_public_names_alone(room):
    """Whoever explores it in a shell sees no modules of ours, and none of others."""
    assert dir(getattr(dloftbs, room)) == sorted(getattr(dloftbs, room).__all__)


@pytest.mark.parametrize("name", dloftbs.__all__)
def test_every_public_name_is_there(name):
    assert getattr(dloftbs, name) is not None
    assert name in dir(dloftbs)


def test_the_public_names_are_sorted_and_their_own():
    assert dloftbs.__all__ == sorted(set(dloftbs.__all__))
    assert {*dloftbs._HOME, *dloftbs._SUBMODULES, "__version__"} == set(dloftbs.__all__)


@pytest.mark.parametrize("name", ["detekt", "np", "Sequence", "__wrapped__"])
def test_a_name_that_is_not_there_is_an_attribute_error(name):
    with pytest.raises(AttributeError, match=f"module 'dloftbs' has no attribute '{name}'"):
        getattr(dloftbs, name)


@pytest.mark.parametrize("name", [name for name in MODULES if name.startswith("evaluation.")])
def test_criteria_know_no_source_and_no_picture(name):
    path = MODULES[name]
    foreign = {"sources", "synthetic", "viz"} & {
        found.partition(".")[0] for found in imports_of(name, path.read_text())
    }
    assert not foreign or name.split(".")[1] in ("suites", "runner", "report")


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


@pytest.mark.parametrize("name", [name for name in MODULES if name.partition(".")[0] in ENDS_KNOWN_TO])
def test_the_numbers_of_ends_are_read_by_the_functions_of_graph_ends_alone(name):
    assert end_arithmetic(MODULES[name].read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("source", ["far = nodes[end ^ 1]", "spurs[end // 2]", "step = 1 if end % 2 == 0 else -1"])
def test_arithmetic_with_the_numbers_of_ends_is_found(source):
    assert len(end_arithmetic(source)) == 1
