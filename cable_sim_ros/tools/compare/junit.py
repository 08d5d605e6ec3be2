"""Limits and doubts of a comparison as JUnit's XML, which CI servers read."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

from ...files import write_text
from .comparison import Comparison

ILLEGAL = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # in XML 1.0


def junit(comparison: Comparison) -> str:
    """A test case for each limit, and one for each reason of a verdict beside them."""
    verdict = comparison.verdict
    cases = [(f"{one.quantity}.{one.limit}", "limit", one.text, one.passed) for one in comparison.judged]
    cases += [(f"verdict.{reason.flag}", "doubtful", str(reason), False) for reason in comparison.doubts]
    cases = cases or [("verdict", "verdict", verdict.state, True)]
    failures = sum(not passed for *_, passed in cases)
    name = f"compare {comparison.limits}".strip()
    counts = {"tests": str(len(cases)), "failures": str(failures), "errors": "0", "skipped": "0"}
    root = ElementTree.Element("testsuites", {"name": "cable-sim", **counts})
    suite = ElementTree.SubElement(root, "testsuite", {"name": _legal(name), **counts})
    for what, kind, text, passed in cases:
        case = ElementTree.SubElement(suite, "testcase", {"name": _legal(what), "classname": "cable_sim.compare"})
        if passed:
            ElementTree.SubElement(case, "system-out").text = _legal(text)
        else:
            failure = ElementTree.SubElement(case, "failure", {"type": kind, "message": _legal(text)})
            failure.text = _legal(f"{text}\nA: {comparison.name_a}\nB: {comparison.name_b}")
    if verdict.notes:
        ElementTree.SubElement(suite, "system-out").text = _legal("\n".join(verdict.notes))
    ElementTree.indent(root)
    return ElementTree.tostring(root, "unicode", xml_declaration=True) + "\n"


def write_junit(comparison: Comparison, path: Path) -> None:
    """Save it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, junit(comparison))


def _legal(text: str) -> str:
    return ILLEGAL.sub("?", text)
