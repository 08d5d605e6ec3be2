"""Everything of a log in one report: figures of sources and fields, findings with their evidence."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..log import Log
from .axes import of_axes
from .channels import of_fields
from .finding import Finding
from .times import of_times, renamed


@dataclass
class Report:
    """Of one log: sources with figures, findings."""

    path: str
    format: str
    records: int
    lost: dict[str, int]
    losses: str
    notices: list[str]
    sources: list[dict[str, Any]] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        return {**vars(self), "findings": [one._asdict() for one in self.findings]}


def inspect_log(log: Log) -> Report:
    """Report of a log."""
    report = Report(log.path, log.format, log.records, dict(log.losses.counts), str(log.losses), list(log.notices))
    for source in log.sources.values():
        figures, found = of_times(source)
        fields, more = of_fields(source)
        report.sources.append({"source": source.name, "kind": source.kind, **figures, "fields": fields})
        report.findings += [*found, *more]
    report.findings += renamed(log)
    report.findings += of_axes(log)
    return report
