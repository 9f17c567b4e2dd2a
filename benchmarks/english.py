"""Count the sentences that do not read as plain technical English: `python -m benchmarks.english [--list] [PATH ...]`.

Good sentences put the subject first and the verb early, and are short. In docstrings, four signs of others are counted,
file by file:

- openings: a docstring starts with a relative clause (What, Where, Which, How, Whether ...);
- entries: so does the description of a parameter or a field, but for "Whether" of what is true or false;
- phrases: turns of speech that hide the subject or the number ("what is", "so many", "led on" ...);
- words: private words where the field has one of its own ("dearer", "posed", "twin" ...).

In Markdown pages, and in the help texts of the command (the path ``help``):

- long: a sentence has more than `MAX_WORDS` words;
- relative: a sentence, but no question, starts with a relative clause;
- mean: the sentences of a page have `MAX_MEAN` words or more in the mean. Cells of tables do not count here.
"""

from __future__ import annotations

import argparse
import ast
import inspect
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import click

_RELATIVE = r"(?:(?:By|From|Of|In|At|On|To) (?=[a-z]))?(?i:What|Where|Which|How|When|Who|Whose|Why{also})\b"
PATTERNS = {
    "openings": re.compile(r"\A\s*(" + _RELATIVE.format(also="|Whether") + ")"),
    # "name : type", and the description on the next line, indented by four more.
    "entries": re.compile(r"^( *)\S.* : .*\n\1    (?P<found>" + _RELATIVE.format(also="") + ")", re.MULTILINE),
    "phrases": re.compile(r"\b(?:what is|so many|so much|led on|leads? on|taken? for|by how much)\b", re.IGNORECASE),
    "words": re.compile(
        r"\b(?:dearer|posed|twins?|coasting|lanes?|overruled?|heeds?|settles?|settled|stripes?|contested|shadowed)\b",
        re.IGNORECASE,
    ),
}

MAX_WORDS = 40
"""Words of a sentence of a page, at most."""

MAX_MEAN = 22.0
"""Mean number of words of the sentences of a page: fewer than this."""

KINDS = (*PATTERNS, "long", "relative", "mean")
HELP = Path("help")
"""Stands for the help texts of the command among the paths."""

_UNREAD = re.compile(r"^(```|~~~).*?^\1|<!--.*?-->|^#+ .*?$|^ *!\[.*?\]\(.*?\)$", re.MULTILINE | re.DOTALL)
_LEAD = re.compile(r"^(\*\*|\*)[^*\n]{1,60}[.:]\1 *", re.MULTILINE)
_ITEM = re.compile(r"^ *(?:[-*+]|\d+\.) +", re.MULTILINE)
_ROW = re.compile(r"^ *\|")
_CODE, _LINK = re.compile(r"`+[^`]+`+"), re.compile(r"!?\[([^]]*)\]\([^)]*\)")
_ABBREVIATION = re.compile(r"\b(?:e\.g|i\.e|et al|etc|vs|Fig|approx|No)\.")
_END = re.compile(r"(?<=[.!?])[*_\")']*\s+(?=[*_\"'(]*[A-Z0-9\x00])")
_FIRST = re.compile(r"^\W*(?:(?:By|From|Of|In|At|On|To) )?(?:What|Where|Which|How|Who|Whose)(?:ever)?\b")


class Sentence(NamedTuple):
    """A sentence of a page."""

    line: int
    text: str
    in_table: bool

    @property
    def words(self) -> int:
        """Number of words; code, whatever it holds, is one."""
        return sum(any(letter.isalnum() or letter == "\0" for letter in word) for word in self.text.split())


class Finding(NamedTuple):
    """A place that does not read well."""

    path: Path
    line: int
    kind: str
    text: str


def docstrings(source: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the text of each docstring, those of attributes and constants included."""
    for node in ast.walk(ast.parse(source)):
        body = getattr(node, "body", None)
        for statement in body if isinstance(body, list) else []:
            value = statement.value if isinstance(statement, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                yield value.lineno, value.value


def findings(path: Path) -> list[Finding]:
    """Return the findings in one file, Python or Markdown, from top to bottom."""
    if path.suffix == ".md":
        return page_findings(path, path.read_text(encoding="utf-8"))
    found = []
    for line, text in docstrings(path.read_text(encoding="utf-8")):
        for kind, pattern in PATTERNS.items():
            for match in pattern.finditer(text):
                group = match.lastgroup or match.lastindex or 0
                found.append(Finding(path, line + text.count("\n", 0, match.start(group)), kind, match[group]))
    return sorted(found)


def sentences(page: str) -> Iterator[Sentence]:
    """Yield the sentences of Markdown: of paragraphs, items of lists and cells of tables; no headings, no code.

    A word in bold with a full stop or a colon that leads a paragraph is a heading, too.
    """
    text = _UNREAD.sub(lambda found: "\n" * found[0].count("\n"), page)
    for line, block, in_table in _blocks(text):
        plain = _ABBREVIATION.sub(lambda found: found[0][:-1], _LINK.sub(r"\1", _CODE.sub("\0", _LEAD.sub("", block))))
        for sentence in _END.split(plain):
            if sentence.strip(" *_\n"):
                yield Sentence(line, " ".join(sentence.split()), in_table)


def _blocks(text: str) -> Iterator[tuple[int, str, bool]]:
    """Yield the line, the text and whether it is a cell of a table, of what is a unit in Markdown."""
    held, begin = list[str](), 0
    for number, line in enumerate([*text.split("\n"), ""], start=1):
        is_row, is_item = _ROW.match(line), _ITEM.match(line)
        if held and (is_row or is_item or not line.strip()):
            yield begin, "\n".join(held), False
            held = []
        if is_row:
            yield from ((number, cell.strip(), True) for cell in line.replace("\\|", "/").strip(" |").split("|"))
        elif line.strip():
            begin = begin if held else number
            held.append(_ITEM.sub("", line))


def page_findings(path: Path, page: str) -> list[Finding]:
    """Return the findings in Markdown, from top to bottom."""
    found = list(sentences(page))
    findings = [
        Finding(path, one.line, kind, one.text.replace("\0", "`...`"))
        for one in found
        for kind, bad in (
            ("long", one.words > MAX_WORDS),
            ("relative", not one.in_table and _FIRST.match(one.text) is not None and not one.text.endswith("?")),
        )
        if bad
    ]
    mean = mean_words(found)
    if mean >= MAX_MEAN:
        findings.append(Finding(path, 1, "mean", f"{mean:.1f} words a sentence"))
    return findings


def mean_words(found: Iterable[Sentence]) -> float:
    """Return the mean number of words of sentences outside of tables; 0 where there are none."""
    words = [one.words for one in found if not one.in_table]
    return sum(words) / len(words) if words else 0.0


def help_pages() -> Iterator[tuple[Path, str]]:
    """Yield the texts of the help of each command, as Markdown: paragraphs, and an item for each option."""
    from dloftbs.cli import main as group

    for name, command in sorted(group.commands.items()):
        # Click shows paragraphs that begin with a backspace as they are: examples.
        paragraphs = [part for part in inspect.cleandoc(command.help or "").split("\n\n") if not part.startswith("\b")]
        options = [one.help or "" for one in command.params if isinstance(one, click.Option)]
        yield HELP / name, "\n\n".join([*paragraphs, *(f"- {text}" for text in options)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    default = [Path("src"), Path("docs"), Path("README.md"), Path("CHANGELOG.md"), HELP]
    parser.add_argument("paths", nargs="*", type=Path, default=default, help="files, folders or 'help'; all by default")
    parser.add_argument("--list", action="store_true", help="name every place instead of counting by file")
    arguments = parser.parse_args()
    files = {
        file
        for path in arguments.paths
        for file in ([path] if path.is_file() else [*path.rglob("*.py"), *path.rglob("*.md")])
    }
    by_file = {file: findings(file) for file in sorted(files)}
    if HELP in arguments.paths:
        by_file |= {name: page_findings(name, page) for name, page in help_pages()}
    total: Counter[str] = Counter()
    for file, found in by_file.items():
        count = Counter(finding.kind for finding in found)
        total += count
        if arguments.list:
            for finding in found:
                print(f"{file}:{finding.line}: {finding.kind}: {finding.text}")
        elif found:
            print("".join(f"{count[kind]:9}" for kind in KINDS), file)
    print("".join(f"{total[kind]:9}" for kind in KINDS), f"{', '.join(KINDS)} in {len(by_file)} files")


if __name__ == "__main__":
    main()
