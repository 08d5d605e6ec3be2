"""`cable-sim compare`: measured against simulated, or two runs: scores, alignment, limits, JUnit."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...cli.number import Number
from ...cli.options import junit_option, limits_option
from ...cli.out_folder import ready
from ...errors import CODE_FAILED
from ...files import write_text
from ...terminal import in_lines, plain_console, say

if TYPE_CHECKING:
    from ...runs.result import Run
    from ...sim.verdict import Verdict
    from .comparison import Comparison
    from .limits import Limits
    from .score import Score

LONGEST = 1e7  # s


@click.command()
@click.argument("a")
@click.argument("b")
@click.option("--mapping", metavar="M", help="Mapping of A: a file, or the name of a ready one.")
@click.option("--mapping-b", metavar="M", help="Mapping of B.")
@limits_option
@junit_option
@click.option(
    "--align",
    type=click.Choice(["none", "clock", "all"]),
    default="none",
    show_default=True,
    help="What is applied of what was found: nothing, the clock, or signs and units too. The verdict is doubtful then.",
)
@click.option("--search", type=Number(0.1, 1e5, "s"), default=60.0, show_default=True, metavar="S",
              help="How far apart the clocks may be, either way.")  # fmt: skip
@click.option("--from", "begin", type=Number(-LONGEST, LONGEST, "s"), metavar="S",
              help="Score from S after the first stamp of A.")  # fmt: skip
@click.option("--to", "end", type=Number(-LONGEST, LONGEST, "s"), metavar="S",
              help="Score up to S after the first stamp of A.")  # fmt: skip
@click.option(
    "--band",
    nargs=2,
    type=Number(1e-4, 100.0, "Hz"),
    default=(0.03, 0.5),
    show_default=True,
    metavar="LOW HIGH",
    help="Band of the waves.",
)
@click.option("--slope", type=Number(1.0, 20.0), default=4.0, show_default=True, metavar="M",
              help="Slope of the damage of cycles: range to the power M.")  # fmt: skip
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for compare.json and the picture."
)
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
def compare(a, b, mapping, mapping_b, limits, junit, align, search, begin, end, band, slope, out, as_json) -> None:
    """Score measured A against simulated B, or two runs against each other.

    A and B are recordings of runs, imported bags, or foreign logs with a mapping. Differences are B less A.

    Exit codes: 0 ok; 1 a limit is violated, or what it limits could not be scored; 2 bad input; 3 a recording was
    damaged; 4 doubtful: something was applied, or a sign, unit or clock looks wrong.
    """
    begin = -float("inf") if begin is None else begin
    end = float("inf") if end is None else end
    if not begin < end:
        raise click.UsageError(f"--from {begin:g} is not before --to {end:g}: nothing was compared; give a later --to")
    if not 2.0 * band[0] <= band[1]:
        raise click.UsageError(
            f"--band {band[0]:g} {band[1]:g}: the upper end must be twice the lower one or more; nothing was compared"
        )
    ready(out)
    from .comparison import compare_recordings
    from .recordings import read_recording

    asked = None if limits is None else load_limits(limits)
    result = compare_recordings(
        read_recording(a, mapping),
        read_recording(b, mapping_b),
        align=align,
        window=(begin, end),
        band=tuple(band),
        slope=slope,
        search=search,
        limits=asked,
    )
    finish(result, out, junit, as_json)


def finish(result: Comparison, out: Path | None, junit: Path | None, as_json: bool) -> None:
    """Write, print, and leave with the code of the verdict."""
    from .junit import write_junit

    report = result.as_dict()
    if junit is not None:
        write_junit(result, junit)
    pictures = []
    if out is not None:
        write_text(out / "compare.json", json.dumps(report, indent=1) + "\n")
        try:
            from .picture import draw_comparison

            pictures.append(draw_comparison(result, out / "compare.png"))
        except RuntimeError as error:  # matplotlib is an extra
            say(f"warning: {error}", err=True)
    if as_json:
        say(json.dumps(report, indent=1), lines=True)
    else:
        tell_scores(result)
        for path in pictures:
            say(f"picture:   {path}")
        if out is not None:
            say(f"figures:   {out / 'compare.json'}")
    if not as_json or result.verdict.code:
        for line in lines_of(result.verdict):
            say(line, err=as_json)
    sys.exit(result.verdict.code)


def load_limits(path: Path) -> Limits:
    """Limits of a file, before anything is run."""
    from .limits import load_limits

    return load_limits(path)


def score_replay(result: Run, bag: str, limits: Limits | None, out: Path | None) -> Comparison:
    """What a bag recorded (A) against its replay (B); into the figures of the replay too."""
    from ...runs.result import write_summary
    from ..logs.own_signals import signals_of_frames
    from .comparison import compare_recordings
    from .recordings import Recording, read_recording

    ours = Recording("replay", signals_of_frames(result.frames, "replay"), result.frames)
    scores = compare_recordings(read_recording(bag), ours, limits=limits)
    result.metrics["comparison"] = scores.as_dict()
    write_summary(out, result)
    return scores


def tell_limits(scores: Comparison | None, junit: Path | None, as_json: bool) -> None:
    """Of a replay: one line for each limit, and code 1 where one is violated."""
    if scores is None:
        return
    if junit is not None:
        from .junit import write_junit

        write_junit(scores, junit)
    for one in scores.judged:
        if not (one.passed and as_json):
            say(f"{'pass' if one.passed else 'violated'}: {one.text}", err=as_json or not one.passed)
    if any(not one.passed for one in scores.judged):
        sys.exit(CODE_FAILED)


def lines_of(verdict: Verdict) -> list[str]:
    """Verdict, one line a reason."""
    what = {"ok": "", "doubtful": ": figures cannot be taken as they are", "failed": ": limits are violated"}
    reasons = [f"  {reason}" for reason in verdict.reasons]
    notes = [f"  note: {note}" for note in verdict.notes]
    return [f"verdict: {verdict.state}{what[verdict.state]} (docs/compare.md)", *reasons, *notes]


def tell_scores(result: Comparison) -> None:
    """Table of the scores, what was found of clocks, and the difference of two runs."""
    from rich.table import Table

    table = Table(
        title=in_lines(f"A: {result.name_a}", f"B: {result.name_b}", "B less A, B over A; 95 % intervals in brackets")
    )
    table.title_justify = "left"
    table.add_column("quantity")
    for name in ("unit", "bias", "gain", "rms", "lag s", "coherence", "peaks", "damage", "samples"):
        table.add_column(name, justify="left" if name == "unit" else "right")
    for one in result.scores:
        if one.scored:
            columns = ("bias", "gain", "rms", "lag_s", "coherence", "peak_ratio", "damage_ratio", "samples")
            table.add_row(one.quantity, one.unit, *(_cell(one, name) for name in columns))
    console = plain_console(140)
    console.print(table)
    notes: dict[str, list[str]] = {}
    for one in result.scores:
        for note in one.notes:
            notes.setdefault(note, []).append(one.quantity)
    for note, names in notes.items():
        say(f"note: {', '.join(names) if len(names) < len(result.scores) else 'all'}: {note}")
    for side, names in (("A", result.only_a), ("B", result.only_b)):
        if names:
            say(f"only in {side}, not compared: {', '.join(names)}")
    if result.body is not None:
        volume = result.body["volume_ratio"]
        share = result.body["a_in_b"]
        say(
            "towbody, 95 % ellipsoids: B is "
            + ", ".join(f"{value:+.4g}" for value in result.body["offset_m"])
            + " m from A (east, north, down)"
            + (f"; volume {volume:.4g} times" if volume is not None else "")
            + (f"; {100.0 * share:.3g} % of A in that of B" if share is not None else "")
        )
    if result.clock is not None:
        clock = result.clock
        if clock.found and clock.interval is not None:
            drift = f", drift {clock.drift_ppm:+.3g} ppm" if clock.drift_ppm is not None else ""
            say(
                f"clock: B is {clock.lag:+.4f} s [{clock.interval[0]:+.4f}, {clock.interval[1]:+.4f}] behind A by "
                f"{clock.quantity}{drift}; {'applied' if result.clock_applied else 'not applied'}"
            )
        else:
            say(f"clock: not found: {clock.why}")
    if result.exact is not None:
        say(f"ticks: {result.exact.line()}")
        for row in result.exact.fields[:8]:
            say(f"  {row.field}: from {row.first_s:.4g} s, largest {row.largest:.4g} at {row.largest_at_s:.4g} s")
    for judged in result.judged:  # the others stand in the verdict
        if judged.passed:
            say(f"pass: {judged.text}")


def _cell(one: Score, name: str) -> str:
    value = one.figures.get(name)
    if value is None:
        return "-"
    interval = one.intervals.get(name)
    if name == "samples":
        return f"{value:.0f}"
    return f"{value:.4g}" + (f" [{interval[0]:.4g}, {interval[1]:.4g}]" if interval else "")
