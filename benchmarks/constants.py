"""The constants of the stages: their list in the documents, those that lack a source, those that change no result.

Run it in the repository with ``python -m benchmarks.constants`` to bring docs/maintainers/constants.md up to date,
from the definitions, and to print every constant whose docstring lacks unit or source.
With ``--sensitivity [ROOM/FILE.py:NAME ...]`` to halve and double the constants named, or all floating-point ones, each
in a copy of the tree, to see which generated kinds of frames come out otherwise, and to enter it in that page.
"""

from __future__ import annotations

import argparse
import ast
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Any

from benchmarks.compare import ROOT
from benchmarks.digests import digests
from dloftbs.kernels import compiler

SOURCES = ROOT / "src" / "dloftbs"
PAGE = ROOT / "docs" / "maintainers" / "constants.md"
RUNNER = Path(__file__).with_name("constants_run.py")

ROOMS = ("segmentation", "skeleton", "evidence", "linking", "lifting", "fitting/crossings", "tracking")
"""Rooms whose constants each have a unit and a source."""

_NAME = re.compile(r"_?[A-Z][A-Z0-9_]*")
_UNIT = re.compile(
    r"px|metre|width|radi|rad\b|\bs\b|\bnats?\b|unit|evidence|advantage|frame|second|pixel|share|ratio|times|cost|number|multiple|factor|sample|point|node|"
    r"cosine|sine|roundness|section|level|index|code|degree|length|squar|speed|standard dev|misfit|step",
    re.IGNORECASE,
)
_ROW = re.compile(r"\| `(?P<key>[^`]+)` \|.*")


@dataclass(frozen=True)
class Constant:
    """A number, or several, that a module defines under a name in capitals."""

    path: Path
    name: str
    value: ast.expr
    text: str
    """The value as it stands in the source."""
    document: str
    """The docstring below the definition, or an empty text."""

    @property
    def key(self) -> str:
        """The file in the package and the name."""
        return f"{self.path.relative_to(SOURCES).as_posix()}:{self.name}"

    @property
    def meaning(self) -> str:
        """The first sentence of the docstring."""
        return " ".join(self.document.split("\n\n")[0].split())

    @property
    def source(self) -> str:
        """What the docstring says after ``Source:``."""
        _, _, said = self.document.partition("Source:")
        return " ".join(said.split())

    @property
    def lacks(self) -> str:
        """What the docstring leaves open."""
        if not self.document:
            return "docstring"
        unit = _UNIT.search(f"{self.name} {self.meaning}")
        return ", ".join(what for what, given in (("unit", unit), ("source", self.source)) if not given)

    @cached_property
    def scalable(self) -> bool:
        """Whether halving and doubling it makes sense: floating-point literals, and tuples of such."""
        parts = self.value.elts if isinstance(self.value, ast.Tuple) else [self.value]
        return all(isinstance(_literal(part), float) for part in parts)

    def scaled(self, factor: float) -> str:
        """Return the source of its module with the value times a factor."""
        parts = self.value.elts if isinstance(self.value, ast.Tuple) else [self.value]
        values = [repr(factor * float(_literal(part) or 0.0)) for part in parts]
        new = values[0] if not isinstance(self.value, ast.Tuple) else f"({', '.join(values)})"
        lines = self.path.read_text("utf-8").splitlines(keepends=True)
        first, last = self.value.lineno - 1, (self.value.end_lineno or 0) - 1
        head, tail = lines[first].encode()[: self.value.col_offset], lines[last].encode()[self.value.end_col_offset :]
        lines[first : last + 1] = [head.decode() + new + tail.decode()]
        return "".join(lines)


def main() -> None:
    """Bring the documents up to date, or measure which constants matter."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sensitivity", metavar="ROOM/FILE.py:NAME", nargs="*")
    given = parser.parse_args()
    found = [constant for room in ROOMS for constant in constants(SOURCES / room)]
    if given.sensitivity is not None:
        measure([one for one in found if one.scalable and (not given.sensitivity or one.key in given.sensitivity)])
        return
    publish(PAGE, "constants", tables(found))
    wanting = [one for one in found if one.lacks]
    for one in wanting:
        sys.stdout.write(f"{one.key}: no {one.lacks}\n")
    sys.stdout.write(f"{len(wanting)} of {len(found)} constants lack a unit or a source\n")


def constants(place: Path) -> Iterator[Constant]:
    """Yield the constants of a module, or of all modules in a folder, in order."""
    for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
        text = path.read_text("utf-8")
        body = ast.parse(text).body
        for statement, after in zip(body, [*body[1:], None], strict=True):
            for name, value in _assigned(statement):
                if _NAME.fullmatch(name) and _is_number(value):
                    source = ast.get_source_segment(text, value) or ""
                    yield Constant(path, name, value, " ".join(source.split()), _docstring(after))


def tables(found: Iterable[Constant]) -> str:
    """Return a table in Markdown of the constants of each module."""
    head = "constant", "value", "meaning", "source"
    rule = "---", "---:", "---", "---"
    lines: list[str] = []
    for path, own in groupby(found, lambda one: one.path):
        lines += ["", f"`{path.relative_to(SOURCES).as_posix()}`", "", _row(head), _row(rule)]
        for one in own:
            lines.append(_row([f"`{one.name}`", f"`{one.text}`", one.meaning, one.source]))
    return "\n".join(lines[1:])


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def publish(page: Path, name: str, text: str) -> None:
    """Put a text between ``<!-- made: NAME -->`` and ``<!-- end -->`` of a page.

    Raises
    ------
    ValueError
        If the page has no such marks.
    """
    block = re.compile(rf"(<!-- made: {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
    made, count = block.subn(lambda old: f"{old[1]}\n{text}\n\n{old[2]}", page.read_text("utf-8"))
    if count != 1:
        raise ValueError(f"{page} has {count} places for {name!r}")
    page.write_text(made, "utf-8")


def measure(chosen: Sequence[Constant]) -> None:
    """Halve and double constants, and enter in the page which kinds of frames come out otherwise."""
    with tempfile.TemporaryDirectory() as name:
        frames = Path(name) / "frames"
        command = [sys.executable, str(RUNNER), "write", str(frames)]
        subprocess.run(command, cwd=ROOT, env=_environment(ROOT), check=True)
        before, whole = dict(_digests(ROOT, frames)), _Suites()
        for constant in chosen:
            said = [_change(constant, factor, frames, before, whole) for factor in (0.5, 2.0)]
            row = f"| `{constant.key}` | `{constant.text}` | {' | '.join(said)} |"
            sys.stdout.write(row + "\n")
            sys.stdout.flush()
            _enter(constant.key, row)


class _Suites:
    """Digests of whole suites, made once and only if some constant needs them."""

    @cached_property
    def before(self) -> dict[str, dict[str, Any]]:
        return dict(digests(ROOT, [], quick=False))

    def first_change(self, tree: Path) -> str | None:
        """Return the first suite of which a tree makes something else."""
        after = digests(tree, [], quick=False)
        try:
            return next((f"suite {kind}" for kind, made in after if made != self.before[kind]), None)
        finally:
            after.close()


def _change(constant: Constant, factor: float, frames: Path, before: dict[str, str], whole: _Suites) -> str:
    """Return the first kind of frames, then the first suite, whose results change with the constant, or nothing.

    A copy of the tree has the kernels as compiled, so that only those that may see the change are compiled again.
    """
    with tempfile.TemporaryDirectory() as name:
        copy = Path(name) / "src" / SOURCES.name
        shutil.copytree(SOURCES.parent, copy.parent)
        (copy / constant.path.relative_to(SOURCES)).write_text(constant.scaled(factor), "utf-8")
        for path in _importers(constant.path):
            with (copy / path.relative_to(SOURCES)).open("a", encoding="utf-8") as file:
                file.write("\n# a kernel is stamped with its own file, not with what that imports\n")
        _keep_stamps(copy)
        after = _digests(Path(name), frames)
        try:
            kind = next((kind for kind, digest in after if digest != before[kind]), None)
        finally:
            after.close()
        return kind or whole.first_change(Path(name)) or "nothing"


def _keep_stamps(copy: Path) -> None:
    """Make a copy of the tree believe that no folder of kernels changed, which would compile all that is in it."""
    top = copy.parent
    folders = [path for path in top.rglob("kernels*") if path.is_dir()] + [copy / "kernels" / "shared"]
    kept = {str(path): compiler.folder_digest(SOURCES.parent / path.relative_to(top)) for path in folders}
    with (copy / "kernels" / "compiler.py").open("a", encoding="utf-8") as file:
        file.write(f"\n\ndef folder_digest(folder: Path) -> str:\n    return {kept}[str(folder)]\n")


def _digests(tree: Path, frames: Path) -> Generator[tuple[str, str], None, None]:
    """Yield the kinds of frames and the digests of what a tree makes of them, as they come."""
    command = [sys.executable, str(RUNNER), "read", str(frames)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=_environment(tree), cwd=tree) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                kind, digest = line.rstrip("\n").split("\t")
                yield kind, digest
        except GeneratorExit:
            process.kill()
            raise
    if process.returncode:
        yield "failure", ""


def _environment(tree: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join((str(tree / "src"), str(ROOT)))}


def _importers(path: Path) -> set[Path]:
    """Return the modules that import a module, directly or by others."""
    files = {each: each.read_text("utf-8") for each in SOURCES.rglob("*.py")}
    found, new = set[Path](), {path}
    while new:
        found |= new
        names = "|".join(each.stem for each in new)
        new = {each for each, text in files.items() if re.search(rf"import .*\b({names})\b|\.({names}) import", text)}
        new = {each for each in new if each.parent.name == "kernels"} - found
    return found - {path}


def _enter(key: str, row: str) -> None:
    """Replace or add a row of the table of what constants matter."""
    block = re.search(r"<!-- made: sensitivity -->\n(.*?)<!-- end -->", PAGE.read_text("utf-8"), re.DOTALL)
    old = {match["key"]: match[0] for match in _ROW.finditer(block[1])} if block else {}
    head = ["| constant | value | halved, changes | doubled, changes |", "| --- | ---: | --- | --- |"]
    publish(PAGE, "sensitivity", "\n".join([*head, *(line for _, line in sorted({**old, key: row}.items()))]))


def _assigned(statement: ast.stmt) -> Iterator[tuple[str, ast.expr]]:
    """Yield the names that a statement defines, and the value of each."""
    match statement:
        case ast.AnnAssign(target=ast.Name(name), value=ast.expr() as value):
            yield name, value
        case ast.Assign(targets=[ast.Name(name)], value=value):
            yield name, value
        case ast.Assign(targets=[ast.Tuple(targets)], value=ast.Tuple(values)):
            for target, value in zip(targets, values, strict=True):
                if isinstance(target, ast.Name):
                    yield target.id, value


def _docstring(statement: ast.stmt | None) -> str:
    match statement:
        case ast.Expr(ast.Constant(str(text))):
            return text
    return ""


def _is_number(value: ast.expr) -> bool:
    """Return whether a value is a number, or made of numbers alone and of functions of them."""
    literals = [part.value for part in ast.walk(value) if isinstance(part, ast.Constant)]
    numbers = [one for one in literals if isinstance(one, int | float) and not isinstance(one, bool)]
    return bool(numbers) and len(numbers) == len(literals)


def _literal(value: ast.expr) -> float | int | None:
    """Return a number that stands in the source, or None."""
    try:
        number = ast.literal_eval(value)
    except ValueError:
        return None
    return number if isinstance(number, int | float) else None


if __name__ == "__main__":
    main()
