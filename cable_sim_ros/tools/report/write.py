"""One self-contained HTML file of a run: what it says, in which order, and how it gets onto the disk."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...errors import NO_PLACE, CableSimError, told_as
from ...files import place, write_text
from ...plots.heading import date_of
from ...runs.summary import Run
from ...sim.flag_rules import FAILED
from . import compared, health, inputs, outcome, simulated, spectrum, verdict
from .subject import Card, Section, Subject, subject_of

WORDS = (  # for somebody who has never seen the product
    ("Scene", "the description of a tow that was simulated: water, cable, winch, sheave, towbody, with their numbers"),
    ("Sheave", "the grooved wheel over which the cable leaves the ship"),
    ("Towbody", "the body at the end of the cable, also called the fish"),
    ("Effective tension", "pull of the cable plus the water pressure on its cross-section: what bends and breaks it"),
    ("Pay-out", "unstretched cable that has left the drum, in metres; positive is cable out"),
    ("Scope", "unstretched cable outboard of the sheave"),
    ("Layback", "horizontal distance from the sheave to the towbody"),
    ("Heave", "motion up and down; heave compensation turns the winch so that the towbody feels less of it"),
    ("Standard deviation", "how far a quantity swings about its mean; of a sine, its amplitude divided by 1.41"),
    (
        "Verdict",
        "ok: no check objects; doubtful: some figures cannot be taken as they are; failed: the run did not end",
    ),
)
MISSING = (
    "{name} is not installed: no report was written, and nothing was simulated for it. Install what a report needs: "
    "pip install 'cable_sim_ros[report]'"
)
PAGE = "page.html"


class ReportError(CableSimError):
    """A report that cannot be made or written."""


def check_tools() -> None:
    """ReportError where jinja2 or matplotlib is missing."""
    for name in ("jinja2", "matplotlib"):
        with told_as(ReportError, MISSING.format(name=name), of=ImportError):
            __import__(name)


def check_place(path: str | os.PathLike) -> None:
    """ReportError where a report cannot be written to a path: said before anything is run."""
    path = Path(path)
    if path.suffix.lower() not in (".html", ".htm"):
        raise ReportError(
            f"report = {path}: is no HTML file by its name; nothing was run. Give a name that ends in .html"
        )
    after = "; nothing was run. Give a file that can be"
    with told_as(ReportError, f"report = {path}: cannot be written", after, NO_PLACE):
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise IsADirectoryError(21, "Is a directory")
        place(path)
        tempfile.TemporaryFile(dir=path.parent).close()


def write_report(
    result: Run,
    path: str | os.PathLike,
    *,
    command: Sequence[str] = (),
    plan: Mapping[str, Any] | None = None,
    scores: Sequence[Mapping[str, Any]] = (),
    title: str | None = None,
) -> Path:
    """Write the report of a run and return its path.

    result: of `run`, `replay`, a live run or a recording; its side view and contact need ``result.bag``. command: words
    as typed, shown without folders; plan: as of `runs.plan.plan_of`; scores: dicts of figures, rendered as they are;
    title: the scene's name if not given. The same run gives the same bytes. Raises ReportError, BagError.
    """
    check_tools()
    check_place(path)
    subject = subject_of(result, command, plan, scores)
    missed = compared.violated(subject)
    return write_page(
        path,
        title=title or str(subject.metrics.get("scene") or subject.recorded.custom_data.get("scene", "Cable tow")),
        line=what(subject),
        state=FAILED if missed else subject.result.verdict.state,
        sentence=verdict.sentence(subject, missed),
        beside=verdict.beside(subject),
        cards=verdict.cards(subject),
        sections=sections(subject),
    )


def write_page(
    path: str | os.PathLike,
    *,
    title: str,
    line: str,
    state: str,
    sentence: str,
    beside: Sequence[str],
    cards: Sequence[Card],
    sections: Sequence[Section],
) -> Path:
    """Write any report on the page of the house, every text escaped, and return its path. Raises ReportError."""
    check_tools()
    check_place(path)
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["soft"] = soft
    text = environment.get_template(PAGE).render(
        title=title,
        line=line,
        state=state,
        sentence=sentence,
        beside=beside,
        cards=cards,
        sections=sections,
        words=WORDS,
    )
    with told_as(ReportError, f"report = {path}: cannot be written", "; what it is about is not touched"):
        write_text(path, text)
    return Path(path)


def soft(text: str) -> str:
    """A text, escaped, that may break behind the dots, slashes and underscores of a long word."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"(?<=\w)([._/])(?=[a-zA-Z])", r"\1<wbr>", str(escape(text))))


def what(subject: Subject) -> str:
    """What was done, under the title."""
    metrics, about = subject.metrics, subject.recorded.custom_data
    kind = (
        "live run in real time"
        if subject.live
        else "replay of a recording"
        if verdict.is_replay(subject)
        else "simulated tow"
    )
    motion = metrics.get("motion") or about.get("motion")
    parts = [kind]
    if len(subject.frames):
        parts.append(f"{metrics.get('duration_s', 0.0) + subject.tick:.4g} s")
    if motion:
        parts.append("no ship motion" if motion == "none" else f"ship motion {motion}")
    if date := date_of(subject.recorded):
        parts.append(f"from {date}")
    return "; ".join(parts)


def sections(subject: Subject) -> list[Section]:
    """Every section that the run has something for."""
    first = [verdict.section(subject), simulated.section(subject)]
    if not len(subject.frames):
        return first
    early = [health.halted(subject)] if subject.result.verdict.state == FAILED else []
    every = [
        *first,
        inputs.section(subject),
        compared.residuals(subject),
        compared.scores(subject),
        *early,
        outcome.series(subject),
        outcome.passage(subject),
        spectrum.section(subject),
        outcome.contacts(subject),
        outcome.drive(subject),
        outcome.instruments(subject),
        compared.rules(subject),
        compared.faults(subject),
        compared.plan(subject),
        health.solver(subject),
        health.energy(subject),
        health.figures(subject),
    ]
    return [one for one in every if one is not None]
