"""Cases on the terminal."""

from __future__ import annotations

from rich.table import Table

from cable_sim_ros.terminal import plain_console

from .family import Case


def print_cases(done: list, cases: list[Case]) -> None:
    """One table a case: output, value, unit; then mesh, step, time and notes."""
    console = plain_console(120)
    for metrics, case in zip(done, cases, strict=True):
        table = Table(title=metrics.id, title_justify="left")
        table.add_column("output")
        table.add_column("value", justify="right")
        table.add_column("unit")
        for output, report in zip(case.outputs, metrics.outputs, strict=True):
            value = report["value"]
            text = (
                "no value"
                if value is None
                else (", ".join(f"{x:.8g}" for x in value) if isinstance(value, (list, tuple)) else f"{value:.8g}")
            )
            table.add_row(output.name, text, output.unit)
        console.print(table)
        console.print(
            f"{metrics.elements} elements, step {metrics.dt_s:g} s, {metrics.cpu_s:.2f} CPU s", highlight=False
        )
        for note in metrics.notes:
            console.print(f"  {note}", highlight=False)
