"""`cable-sim compare`: measured against simulated, or two runs: scores, alignment, limits, JUnit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...cli.options import Answer, Number, answers, drawn, folder_option, junit_option, limits_option, ready
from ...errors import CODE_FAILED
from ...sim.flag_rules import DOUBTFUL, FAILED
from ...terminal import in_lines, print_table, say

if TYPE_CHECKING:
    from ...runs.summary import Run
    from .comparison import Comparison
    from .score import Limits, Score

LONGEST = 1e7  # s
MEANING = {DOUBTFUL: "figures cannot be taken as they are", FAILED: "limits are violated"}


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
    help="What is applied of what was found: nothing, the clock, or signs and units too. The verdict is doubtful then.",
)
@click.option("--search", type=Number(0.1, 1e5, "s"), default=60.0, help="How far apart the clocks may be, either way.")
@click.option("--from", "begin", type=Number(-LONGEST, LONGEST, "s"), help="Score from S after the first stamp of A.")
@click.option("--to", "end", type=Number(-LONGEST, LONGEST, "s"), help="Score up to S after the first stamp of A.")
@click.option(
    "--band",
    nargs=2,
    type=Number(1e-4, 100.0, "Hz"),
    default=(0.03, 0.5),
    metavar="LOW HIGH",
    help="Band of the waves.",
)
@click.option(
    "--slope",
    type=Number(1.0, 20.0),
    default=4.0,
    metavar="M",
    help="Slope of the damage of cycles: range to the power M.",
)
@folder_option("Folder for compare.json and the picture.")
@answers
def compare(a, b, mapping, mapping_b, limits, junit, begin, end, band, out, **asked) -> Answer:
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
    from .comparison import compare_recordings, draw_comparison
    from .recordings import read_recording

    held = None if limits is None else load_limits(limits)
    result = compare_recordings(
        read_recording(a, mapping),
        read_recording(b, mapping_b),
        window=(begin, end),
        band=tuple(band),
        limits=held,
        **asked,
    )
    if junit is not None:
        from .comparison import write_junit

        write_junit(result, junit)
    return Answer(
        result.as_dict(),
        lambda: tell_scores(result),
        kept=out and out / "compare.json",
        files=drawn(lambda: draw_comparison(result, out / "compare.png")) if out else (),
        verdict=result.verdict.lines(what=MEANING, page="docs/compare.md"),
        code=result.verdict.code,
    )


def load_limits(path: Path) -> Limits:
    """Limits of a file, before anything is run."""
    from .score import load_limits

    return load_limits(path)


def score_replay(result: Run, bag: str, limits: Limits | None, out: Path | None) -> Comparison:
    """What a bag recorded (A) against its replay (B); into the figures of the replay too."""
    from ...runs.summary import write_summary
    from ..logs.own_signals import signals_of_frames
    from .comparison import compare_recordings
    from .recordings import Recording, read_recording

    ours = Recording("replay", signals_of_frames(result.frames, "replay"), result.frames)
    scores = compare_recordings(read_recording(bag), ours, limits=limits)
    result.metrics["comparison"] = scores.as_dict()
    write_summary(out, result)
    return scores


def with_limits(answer: Answer, scores: Comparison, junit: Path | None) -> Answer:
    """Of a replay: one line more for each limit, and code 1 where one is violated."""
    if junit is not None:
        from .comparison import write_junit

        write_junit(scores, junit)

    def tell() -> None:
        answer.tell()
        _tell_passed(scores)

    violated = [f"violated: {one.text}" for one in scores.judged if not one.passed]
    code = CODE_FAILED if violated else answer.code
    return answer._replace(tell=tell, warnings=[*answer.warnings, *violated], code=code)


def _tell_passed(scores: Comparison) -> None:
    for one in scores.judged:  # the others stand in the verdict
        if one.passed:
            say(f"pass: {one.text}")


def tell_scores(result: Comparison) -> None:
    """Table of the scores, what was found of clocks, and the difference of two runs."""
    columns = ("bias", "gain", "rms", "lag_s", "coherence", "peak_ratio", "damage_ratio", "samples")
    rows = [(one.quantity, one.unit, *(_cell(one, name) for name in columns)) for one in result.scores if one.scored]
    head = ("quantity", "unit", "bias", "gain", "rms", "lag s", "coherence", "peaks", "damage", "samples")
    title = in_lines(f"A: {result.name_a}", f"B: {result.name_b}", "B less A, B over A; 95 % intervals in brackets")
    print_table(title, head, rows, left=("quantity", "unit"), width=140)
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
    _tell_passed(result)


def _cell(one: Score, name: str) -> str:
    value = one.figures.get(name)
    if value is None:
        return "-"
    interval = one.intervals.get(name)
    if name == "samples":
        return f"{value:.0f}"
    return f"{value:.4g}" + (f" [{interval[0]:.4g}, {interval[1]:.4g}]" if interval else "")
