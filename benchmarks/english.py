"""Count the docstrings that do not read as plain technical English: `python -m benchmarks.english [--list] [PATH ...]`.

Good sentences put the subject first and the verb early. Four signs of others are counted, file by file:

- openings: a docstring starts with a relative clause (What, Where, Which, How, Whether ...);
- entries: so does the description of a parameter or a field, but for "Whether" of what is true or false;
- phrases: turns of speech that hide the subject or the number ("what is", "so many", "led on" ...);
- words: private words where the field has one of its own ("dearer", "posed", "twin" ...).
"""

from __future__ import annotations

import argparse
import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

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


class Finding(NamedTuple):
    """A place where a docstring does not read well."""

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
    """Return the findings in one file, from top to bottom."""
    found = []
    for line, text in docstrings(path.read_text(encoding="utf-8")):
        for kind, pattern in PATTERNS.items():
            for match in pattern.finditer(text):
                group = match.lastgroup or match.lastindex or 0
                found.append(Finding(path, line + text.count("\n", 0, match.start(group)), kind, match[group]))
    return sorted(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="*", type=Path, default=[Path("src")], help="files or folders; src by default")
    parser.add_argument("--list", action="store_true", help="name every place instead of counting by file")
    arguments = parser.parse_args()
    files = sorted({file for path in arguments.paths for file in ([path] if path.is_file() else path.rglob("*.py"))})
    total: Counter[str] = Counter()
    for file in files:
        found = findings(file)
        count = Counter(finding.kind for finding in found)
        total += count
        if arguments.list:
            for finding in found:
                print(f"{file}:{finding.line}: {finding.kind}: {finding.text}")
        elif found:
            print("".join(f"{count[kind]:9}" for kind in PATTERNS), file)
    print("".join(f"{total[kind]:9}" for kind in PATTERNS), f"{', '.join(PATTERNS)} in {len(files)} files")


if __name__ == "__main__":
    main()
