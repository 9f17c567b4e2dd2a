"""Small files of text that others wrote, read within limits: YAML, JSON, and the XML of OpenCV's FileStorage.

A few hundred bytes can ask for any amount of time and memory: by aliases that repeat aliases, by nesting, by numbers of
millions of digits. What asks for more than any setting or calibration needs is refused.
"""

from __future__ import annotations

import functools
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from dloftbs.errors import InputError

MAX_BYTES = 4 << 20
"""Size of a file; a calibration with all the points of a hundred images is below 2 MB."""
MAX_NODES = 500_000
"""Values in a file: twenty times those of a hundred images of a chessboard."""
MAX_DEPTH = 32
"""Lists and mappings within each other; calibrations have five."""
MAX_DIGITS = 100
"""Characters of a number; float64 needs 24."""
MAX_DIRECTIVES = 8
"""Lines of YAML that begin with %, which libyaml compares with each other."""

_TAG = "tag:yaml.org,2002:"
_NUMBER_LETTERS = frozenset("0123456789+-_.:eE")
_WITH_EXPONENT = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$")
_WRONG = (ValueError, LookupError, ArithmeticError, AttributeError)
"""Exceptions that PyYAML raises on a scalar that does not fit its tag."""


def read_text(path: Path) -> str:
    """Return the text of a file.

    Raises
    ------
    InputError
        If it cannot be read, is longer than `MAX_BYTES`, or is not UTF-8, or is a pipe that nobody writes to.
    """
    with _said_why(), open(path, "rb", opener=_open_at_once) as file:
        data = file.read(MAX_BYTES + 1)
        if not data:
            _check_pipe(path)
        if len(data) > MAX_BYTES:
            raise InputError(f"cannot be read: it must have at most {MAX_BYTES} bytes")
        return data.decode("utf-8-sig")


def check_readable(text: str) -> bytes:
    """Return a text as the bytes of a file that `read_text` reads.

    Raises
    ------
    InputError
        If it is longer than `MAX_BYTES`.
    """
    data = text.encode()
    if len(data) > MAX_BYTES:
        raise InputError(
            f"settings must have at most {MAX_BYTES} bytes to be read again, got {len(data)}: "
            "keep strokes on fewer frames"
        )
    return data


def read_lines(path: Path) -> Iterator[str]:
    """Yield the lines of a file of any length, with their ends, as it is read.

    Raises
    ------
    InputError
        As `read_text`; `MAX_BYTES` bounds a line, not the file.
    """
    with _said_why(), open(path, encoding="utf-8-sig", newline="", opener=_open_at_once) as file:
        line = file.readline(MAX_BYTES)
        if not line:
            _check_pipe(path)
        while line:
            if len(line) == MAX_BYTES:
                raise InputError(f"cannot be read: its lines must have fewer than {MAX_BYTES} characters")
            yield line
            line = file.readline(MAX_BYTES)


@contextmanager
def _said_why() -> Iterator[None]:
    """Turn what reading raises into errors that say why."""
    try:
        yield
    except InputError:
        raise
    except UnicodeDecodeError as error:
        raise InputError(f"cannot be read: it must be UTF-8: {error}") from error
    except (OSError, ValueError) as error:  # a path may hold a null byte
        raise InputError(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error


def _check_pipe(path: Path) -> None:
    if path.is_fifo():
        raise InputError("cannot be read: it is a pipe that nobody writes to")


def _open_at_once(path: str, flags: int) -> int:
    """Open a file, and a pipe without waiting for its writer; reading waits for what a writer has yet to say."""
    number = os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
    if hasattr(os, "O_NONBLOCK"):
        os.set_blocking(number, True)
    return number


def parse_json(data: bytes | str, kind: Any = Any) -> Any:
    """Return what JSON holds, as a type where one is given.

    Raises
    ------
    InputError
        If it is no JSON, holds something else, or is nested too deeply; without a type, also if it has numbers beyond
        `MAX_DIGITS`.
    """
    try:
        value = msgspec.json.decode(data, type=kind)
    except RecursionError as error:
        raise InputError("lists and mappings are nested too deeply") from error
    except UnicodeDecodeError as error:
        raise InputError(f"must be UTF-8: {error}") from error
    except msgspec.DecodeError as error:
        text = str(error)
        raise InputError(f"must be UTF-8: {text}" if "UTF-8" in text else text) from error
    if kind is Any:
        _check_json(value)
    return value


def _check_json(value: Any) -> None:
    waiting = [(value, 0)]
    while waiting:
        item, depth = waiting.pop()
        if isinstance(item, (dict, list)):
            _check_depth(depth + 1)
            waiting += [(inner, depth + 1) for inner in (item.values() if isinstance(item, dict) else item)]
        elif isinstance(item, int) and abs(item) >= 10**MAX_DIGITS:
            raise InputError(f"a number must have at most {MAX_DIGITS} digits")


def parse_yaml(text: str, *, once: bool = False) -> list[Any]:
    """Return the documents that YAML holds, those of OpenCV's FileStorage among it, without empty ones.

    They are made of dictionaries with text as keys, lists, numbers, text, booleans and None; dates and numbers with
    colons, ``170:10``, are text, and ``1e-3`` is a number, as in JSON. Aliases are refused.

    Parameters
    ----------
    text : str
    once : bool
        Refuse a key that a mapping has twice; otherwise the last one stands.

    Raises
    ------
    InputError
        If it is no YAML, holds anything else, or is beyond the limits.
    """
    import yaml

    if text.startswith("%YAML:"):  # OpenCV's way to begin, which is no directive of YAML
        text = text.partition("\n")[2]
    if sum(line.startswith("%") for line in text.splitlines()) > MAX_DIRECTIVES:
        raise InputError(f"at most {MAX_DIRECTIVES} lines may begin with %")
    tree = _Tree(once=once)
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        for event in yaml.parse(text, Loader=loader):
            if isinstance(event, yaml.AliasEvent):
                raise InputError(f"aliases are not supported; write out what *{event.anchor} stands for{_at(event)}")
            if isinstance(event, yaml.ScalarEvent):
                tree.add(event, _scalar(event))
            elif isinstance(event, yaml.CollectionStartEvent):
                tree.begin(event, {} if isinstance(event, yaml.MappingStartEvent) else [])
            elif isinstance(event, yaml.CollectionEndEvent):
                tree.end()
    except (yaml.YAMLError, UnicodeEncodeError) as error:
        if "maximum nesting depth" in str(error):  # newer libyaml gives up before it hands out what is nested
            raise _too_deep() from error
        raise InputError(f"is no YAML: {error}") from error
    return [document for document in tree.documents if document is not None]


class _Tree:
    """Values put in their places as the events of a parser come, without recursion."""

    def __init__(self, *, once: bool) -> None:
        self.documents: list[Any] = []
        self._once = once
        self._open: list[Any] = []
        self._keys: list[str | None] = []
        self._count = 0

    def add(self, event: Any, value: Any) -> None:
        """Put a value where the next one belongs: it may be the key of the one after it."""
        self._count += 1
        if self._count > MAX_NODES:
            raise InputError(f"holds more than {MAX_NODES} values")
        if not self._open:
            self.documents.append(value)
        elif isinstance(self._open[-1], list):
            self._open[-1].append(value)
        elif self._keys[-1] is not None:
            self._open[-1][self._keys[-1]] = value
            self._keys[-1] = None
        elif isinstance(value, (dict, list)):
            raise InputError(f"a key must be a word, not a list or a mapping{_at(event)}")
        elif self._once and event.value in self._open[-1]:
            raise InputError(f"the key {event.value!r} must stand once in its place, and is there again{_at(event)}")
        else:
            self._keys[-1] = event.value

    def begin(self, event: Any, container: Any) -> None:
        """Open a list or a mapping."""
        kind = "map" if isinstance(container, dict) else "seq"
        tag = event.tag or ""
        if tag not in ("", "!", _TAG + kind) and not tag.startswith(f"{_TAG}opencv-"):
            raise _unknown_tag(event)
        self.add(event, container)
        self._open.append(container)
        self._keys.append(None)
        _check_depth(len(self._open))

    def end(self) -> None:
        """Close the list or the mapping opened last."""
        self._open.pop()
        self._keys.pop()


def _scalar(event: Any) -> Any:
    import yaml

    text: str = event.value
    if event.implicit[0] and len(text) > MAX_DIGITS:
        if _NUMBER_LETTERS.issuperset(text):
            raise InputError(f"a number must have at most {MAX_DIGITS} digits, got {len(text)} characters{_at(event)}")
        return text
    resolver, ways = _scalar_ways()
    tag = event.tag
    if tag in (None, "!"):
        tag = resolver.resolve(yaml.ScalarNode, text, event.implicit)
        if ":" in text and tag in (f"{_TAG}int", f"{_TAG}float"):  # to base 60, as YAML 1.1 has it, and nobody means
            return text
    if tag in (f"{_TAG}str", f"{_TAG}value", f"{_TAG}merge"):
        return text
    if tag not in ways:
        raise _unknown_tag(event)
    if len(text) > MAX_DIGITS:
        raise InputError(f"a {tag} must have at most {MAX_DIGITS} characters, got {len(text)}{_at(event)}")
    try:
        value = ways[tag](yaml.ScalarNode(tag, text))
    except _WRONG as error:
        raise InputError(f"{text!r} is no {tag.removeprefix(_TAG)}{_at(event)}") from error
    return value if isinstance(value, (bool, int, float)) or value is None else text


@functools.cache
def _scalar_ways() -> tuple[Any, dict[str, Callable[[Any], Any]]]:
    """Return what gives the tag of a scalar, and what makes a value of it, by its tag."""
    import yaml

    class Resolver(yaml.resolver.Resolver):
        """That of YAML 1.1, which takes 1e-3 for text; in JSON and YAML 1.2 it is a number."""

    Resolver.add_implicit_resolver(f"{_TAG}float", _WITH_EXPONENT, list("+-.0123456789"))
    make = yaml.constructor.SafeConstructor()
    names = ("null", "bool", "int", "float", "timestamp")
    return Resolver(), {f"{_TAG}{name}": getattr(make, f"construct_yaml_{name}") for name in names}


def _unknown_tag(event: Any) -> InputError:
    return InputError(f"the tag {event.tag[:MAX_DIGITS]} is not supported{_at(event)}")


def _at(event: Any) -> str:
    return f" (line {event.start_mark.line + 1})"


def parse_opencv_xml(text: str) -> dict[str, Any]:
    """Return what the XML of OpenCV's FileStorage holds, as `parse_yaml` does.

    Raises
    ------
    InputError
        If it is something else, declares entities, or is beyond the limits.
    """
    from xml.etree import ElementTree

    if "<!DOCTYPE" in text:
        raise InputError("XML with a DOCTYPE, which may declare entities, is not supported")
    parser: Any = ElementTree.XMLPullParser(("start", "end"))
    depth = count = 0
    root: Any = None
    try:
        for start in range(0, len(text), 1 << 16):
            parser.feed(text[start : start + (1 << 16)])
            for event, element in parser.read_events():
                root = element if root is None else root
                depth += 1 if event == "start" else -1
                count += event == "start"
                _check_depth(depth)
                if count > MAX_NODES:
                    raise InputError(f"holds more than {MAX_NODES} values")
        parser.close()
    except ElementTree.ParseError as error:
        raise InputError(f"is no XML: {error}") from error
    if root.tag != "opencv_storage":
        raise InputError(f"is no XML of OpenCV: its root must be opencv_storage, got {root.tag[:MAX_DIGITS]!r}")
    return {child.tag: _xml_value(child) for child in root}


def _xml_value(element: Any) -> Any:
    children = list(element)
    if children and all(child.tag == "_" for child in children):
        return [_xml_value(child) for child in children]
    if children:
        return {child.tag: _xml_value(child) for child in children}
    text = (element.text or "").strip()
    words = text.split()
    longest = max(words, key=len, default="")
    if len(longest) > MAX_DIGITS and _NUMBER_LETTERS.issuperset(longest):
        raise InputError(f"a number must have at most {MAX_DIGITS} digits, got {len(longest)} characters")
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return text.strip('"')
    return numbers[0] if len(numbers) == 1 else numbers


def _check_depth(depth: int) -> None:
    if depth > MAX_DEPTH:
        raise _too_deep()


def _too_deep() -> InputError:
    return InputError(f"lists and mappings must be nested at most {MAX_DEPTH} deep")
