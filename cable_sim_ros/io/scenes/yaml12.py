"""YAML 1.2, on ruamel.yaml: read with the line of every value, written so that YAML 1.1 reads the same.

By the core schema: 1e-3 is a number, ``on``, 1:30, 1_000 and a date are text, and a key stands once.
"""

from __future__ import annotations

import re
import sys
from copy import deepcopy
from functools import lru_cache
from io import StringIO
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent
from ruamel.yaml.nodes import ScalarNode, SequenceNode
from ruamel.yaml.representer import SafeRepresenter

Path = tuple  # of str and int: the way to a value

MAX_DEPTH = 50  # levels of a file; a scene has five
MAX_VALUES = 3000  # of a file, aliases followed; a scene has a few hundred
MAX_LENGTH = 1_000_000  # characters of a file
MAX_DIGITS = 300  # of an integer; a longer one is read as a float
TAG = "tag:yaml.org,2002:"
CORE = {f"{TAG}{kind}" for kind in ("null", "bool", "int", "float")}
WORDS = {"y", "n", "yes", "no", "on", "off", "true", "false", "null"}  # that a version takes for another value


class YamlError(ValueError):
    """Text that is no YAML a scene can be read from; each problem has its line from 1, 0 = unknown."""

    def __init__(self, *problems: tuple[int, str]):
        self.problems = problems
        super().__init__("; ".join(f"{text} in line {line}" if line else text for line, text in problems))


class _Composer(Composer):
    """Composes nodes to a bounded depth: the composer calls itself for each level."""

    level = 0

    def compose_node(self, parent, index):
        """As the base class."""
        event = self.parser.peek_event()
        if self.level == MAX_DEPTH:
            what = f"brackets or indentation are nested deeper than {MAX_DEPTH} levels"
            raise YamlError((event.start_mark.line + 1, what))
        if not isinstance(event, AliasEvent):
            self.anchors.pop(event.anchor, None)  # set again, which ruamel warns of
        self.level += 1
        node = super().compose_node(parent, index)
        self.level -= 1
        return node


def parse(text: str, max_values: int = MAX_VALUES) -> tuple[Any, dict[Path, int]]:
    """Plain Python data of one YAML document, and the line (from 1) of every value by its path.

    Raises YamlError with every duplicate key, or with the first mistake of syntax. A text that was read a moment ago is
    not read again: 40 ms of a scene.
    """
    return deepcopy(_parsed(text, max_values))


@lru_cache(maxsize=16)
def _parsed(text: str, max_values: int) -> tuple[Any, dict[Path, int]]:
    if len(text) > MAX_LENGTH:
        raise YamlError((0, f"has {len(text)} characters, more than {MAX_LENGTH}"))
    yaml = YAML(typ="safe", pure=True)
    yaml.Composer = _Composer
    try:
        node = yaml.compose(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise YamlError((mark.line + 1 if mark else 0, error.problem or error.context or "no YAML")) from None
    except YAMLError as error:  # a character that YAML does not allow
        raise YamlError((0, str(error).splitlines()[0])) from None
    lines: dict[Path, int] = {}
    problems: list[tuple[int, str]] = []

    def build(node, path: Path, above: tuple[int, ...]) -> Any:
        line = node.start_mark.line + 1
        lines.setdefault(path, line)
        if len(path) > MAX_DEPTH:
            raise YamlError((line, f"is nested deeper than {MAX_DEPTH} levels through aliases"))
        if len(lines) > max_values:  # a path each, so aliases within aliases count as often as they stand
            raise YamlError((line, f"has more than {max_values} values, counting aliases"))
        if isinstance(node, ScalarNode):
            return _scalar(node, yaml.constructor)
        if id(node) in above:
            problems.append((line, f"{dotted(path)} contains itself through an alias"))
            return None
        above = (*above, id(node))
        if isinstance(node, SequenceNode):
            return [build(item, (*path, i), above) for i, item in enumerate(node.value)]
        out: dict[str, Any] = {}
        for key, value in node.value:
            line, here = key.start_mark.line + 1, (*path, key.value)
            if not isinstance(key, ScalarNode):
                problems.append((line, f"{dotted(path) or 'the file'} has a key that is not a plain word"))
            elif key.value in out:
                problems.append((line, f"{dotted(here)} is given twice, first on line {lines[here]}"))
            else:
                lines[here] = line
                out[key.value] = build(value, here, above)
        return out

    data = build(node, (), ()) if node is not None else None
    if problems:
        raise YamlError(*problems)
    return data, lines


def _scalar(node, constructor) -> Any:
    """None, bool, int or float of the core schema, else the text: what is quoted, and what ruamel reads beyond it."""
    if not node.style and node.tag == f"{TAG}str" and re.fullmatch("[-+]?[.][0-9]+[eE][0-9]+", node.value):
        return float(node.value)  # .5e3, which ruamel takes as text
    if node.style or node.tag not in CORE or re.match("[-+]?0b|.*_", node.value):
        return node.value
    long = node.tag == f"{TAG}int" and len(node.value) > MAX_DIGITS
    try:
        return (constructor.construct_yaml_float if long else constructor.construct_object)(node)
    except (ValueError, KeyError):  # !!int word
        return node.value


def dotted(path: Path) -> str:
    """Path as a dotted key: ``sheave.position[1]``."""
    out = ""
    for part in path:
        out += f"[{part}]" if isinstance(part, int) else f".{part}" if out else str(part)
    return out


class _Representer(SafeRepresenter):
    """No aliases, a list of numbers in one line, no text without quotes that a version takes for another value."""

    def ignore_aliases(self, data):
        return True

    def represent_sequence(self, tag, sequence, flow_style=None):
        return super().represent_sequence(tag, sequence, not any(isinstance(item, dict | str) for item in sequence))

    def represent_scalar(self, tag, value, style=None, anchor=None):
        if tag == f"{TAG}float" and "." not in value:  # 1e-05 is text in YAML 1.1
            value = value.replace("e", ".0e")
        plain = re.fullmatch(r"[A-Za-z_/][A-Za-z0-9_ ./-]*", value) and value.lower() not in WORDS
        return super().represent_scalar(tag, value, '"' if tag == f"{TAG}str" and not plain else None)


def dump(data: Any) -> str:
    """YAML text that versions 1.1 and 1.2 read alike, in the order of the data, no value folded."""
    yaml, out = YAML(typ="safe", pure=True), StringIO()
    yaml.Representer, yaml.width = _Representer, sys.maxsize  # ruamel 0.19 folds a quoted text to another one
    yaml.default_flow_style = yaml.allow_unicode = yaml.representer.sort_base_mapping_type_on_output = False
    yaml.dump(data, out)
    return out.getvalue()
