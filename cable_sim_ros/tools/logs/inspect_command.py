"""`cable-sim inspect`."""

from __future__ import annotations

import click

from ...cli.options import FILE, Answer, answers, asks_json
from ...errors import told_as
from ...files import write_text
from ...terminal import say

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
