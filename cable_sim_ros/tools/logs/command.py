"""`cable-sim inspect` and `cable-sim import`."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...cli.options import FILE, Answer, Number, answers, asks_json, force_option
from ...errors import told_as
from ...files import write_text
from ...terminal import say

if TYPE_CHECKING:
    from .imports.import_logs import Imported

SHOWN = 12  # sources and findings of a log, without --all
format_option = click.option(
    "--format", "kind", metavar="NAME", help="Format of the files. Default: found from their first bytes."
)


@click.command("inspect")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@format_option
@click.option("--mapping-out", type=FILE, metavar="FILE", help="Write a first mapping.")
@click.option("--all", "everything", is_flag=True, help="Every source, field and finding.")
@answers
def inspect(files, kind, mapping_out, everything) -> Answer:
    """What is in FILE...: sources, rates, gaps, clocks, and what is probably wrong, each with its evidence."""
    from .inspection.inspect_log import first_mapping, inspect_log
    from .log import LogError
    from .several import paths_of, read_each

    skipped: list[str] = []
    told, first = [], None
    for log in read_each(paths_of(files), kind, skipped):
        report = inspect_log(log)
        if first is None and mapping_out is not None:
            first = first_mapping(log, report.findings)
        if asks_json():
            told.append(report.as_dict())
        else:  # log by log, as it is read
            told.append({})
            _tell(report, everything)
    if not told:
        raise LogError(f"{files[0]}: no log is there; nothing was read. {skipped[0] if skipped else 'Give a log'}")
    for line in skipped[: None if everything else SHOWN]:
        say(f"left out: {line}", err=True)
    if mapping_out is not None:
        with told_as(LogError, f"{mapping_out}: cannot be written", "; give another --mapping-out"):
            write_text(mapping_out, first or "")

    def tell() -> None:
        if mapping_out is not None:
            say(f"{mapping_out}: a first mapping of {files[0]}")

    return Answer({"logs": told, "left_out": skipped}, tell)


def _tell(report, everything: bool) -> None:
    say(f"{report.path}: {report.format}, {report.records} records; {report.losses}")
    for notice in report.notices:
        say(f"  note: {notice}")
    shown = report.sources if everything else report.sources[:SHOWN]
    for row in shown:
        rate = (
            f"{row['rate_hz']:.4g} Hz, {row['seconds']:.6g} s, jitter {1e3 * row.get('jitter_s', 0.0):.3g} ms"
            if "rate_hz" in row
            else "no clock"
        )
        say(f"  {row['source']} ({row['kind']}): {row['records']} records, {rate}, {' and '.join(row['clocks'])}")
        fields = row["fields"] if everything else row["fields"][:SHOWN]
        say(f"    {', '.join(_field(one) for one in fields)}")
    if len(report.sources) > len(shown):
        say(f"  and {len(report.sources) - len(shown)} more sources: --all")
    findings = report.findings if everything else report.findings[: 3 * SHOWN]
    for one in findings:
        say(f"  {one.what}: {one.where}: {one.text}")
    if len(report.findings) > len(findings):
        say(f"  and {len(report.findings) - len(findings)} more findings: --all")


def _field(row) -> str:
    unit = f" [{row['unit']}]" if row["unit"] else ""
    return f"{row['field']}{unit}" + (f" {row['least']:.4g}..{row['most']:.4g}" if "least" in row else " empty")


@click.command("import")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--mapping", metavar="NAME|FILE", help="Which field is which quantity. Default: the ready one that fits.")
@format_option
@click.option("--out", type=click.Path(path_type=Path), required=True, metavar="BAG", help="Bag to write.")
@click.option(
    "--track",
    type=click.Choice(["measured", "mean"]),
    default="measured",
    help="Positions as measured, or the waves of them about a straight track at --speed.",
)
@click.option(
    "--speed",
    type=Number(-10.0, 10.0, "m/s"),
    help="Of the mean track, in place of the log's. Default: a run takes ship.tow_speed of its scene.",
)
@click.option("--heading", type=Number(-360.0, 360.0, "deg"), help="Of the bow, clockwise from north.")
@click.option(
    "--height",
    type=Number(-50.0, 50.0, "m"),
    default=0.0,
    help="Mean height of base_link above the water; that of the scene is ship.reference_height.",
)
@force_option("Replace a bag that exists.")
@answers
def import_command(files, mapping, kind, out, track, speed, heading, height, force) -> Answer:
    """Make a BAG that run, replay and live take of foreign logs: ship motion, and what was measured of the tow."""
    from .imports.import_logs import import_logs
    from .imports.track import Choice

    way = None if heading is None else radians(90.0 - heading)
    done = import_logs(files, out, mapping, format=kind, choice=Choice(track, speed, way, height), force=force)
    told = {"bag": str(done.path), "assumed": done.assumed, "said": done.said, "missing": done.missing}
    return Answer(done.figures | told, lambda: _tell_import(done))


def _tell_import(done: Imported) -> None:
    f = done.figures
    say(
        f"{done.path}: {f['seconds']:.6g} s from {f['files']} files, {f['records']} records, {f['lost']} lost"
        f"{', ' + str(f['without_value']) + ' without a value' if f['without_value'] else ''}; "
        f"motion: {f['motion']} of {', '.join(f['given']) or 'none'}"
    )
    for name, count in f["signals"].items():
        say(f"  {name}: {count} records")
    told = {"lost": f["losses"], "not there": done.missing, "done": done.said, "assumed": done.assumed}
    for word, lines in told.items():
        for line in lines:
            say(f"{word}: {line}")
