"""`cable-sim telegrams`."""

from __future__ import annotations

import click
from click.core import ParameterSource

from ...cli.options import FILE, Number, bag_scene_option
from ...terminal import say

OF_FORMAT = {"number": "lci90i", "name": "lci90i", "tension_unit": "lci90i", "heave_down": "pashr"}
KINDS = ("lci90i", "psxn", "pashr", "tss1")


@click.command()
@click.argument("bag")
@click.option("--format", "kind", type=click.Choice(KINDS), required=True, help="Which telegram.")
@click.option("--out", type=FILE, required=True, help="File to write.")
@click.option(
    "--rate",
    type=Number(0.0, 1000.0, "Hz", above=True),
    help="Lines a second. Default: 20 of lci90i, 10 of the others, or as many as there are tick outputs.",
)
@click.option("--number", type=click.IntRange(0, 99), default=1, help="Of the display; lci90i.")
@click.option("--name", default="TOW WINCH", help="Of the winch, empty: none; lci90i.")
@click.option("--tension-unit", type=click.Choice(["lb", "kgf", "daN"]), default="lb", help="Of lci90i.")
@click.option("--heave-down", is_flag=True, help="Heave positive down; pashr.")
@bag_scene_option
def telegrams(bag, kind, out, rate, number, name, tension_unit, heave_down, scene) -> None:
    """The telegrams that the instruments of the recorded run BAG would have sent, as a log: a logger's stamp, a blank
    and a telegram a line."""
    from . import lci90i
    from .sources import write_log

    source = click.get_current_context().get_parameter_source
    for option, of in OF_FORMAT.items():
        if of != kind and source(option) is ParameterSource.COMMANDLINE:
            flag = f"--{option.replace('_', '-')}"
            raise click.UsageError(f"{flag} is of {of}, not of {kind}; nothing was written; leave it out")
    if why := lci90i.name_problem(name):
        raise click.UsageError(f"--name {name!r} does not fit; nothing was written; give {why}")
    forms = {"lci90i": lci90i.Form(number, name, unit=lci90i.TensionUnit(tension_unit)), "pashr": not heave_down}
    log = write_log(bag, kind, out, forms.get(kind), rate, scene)
    say(f"{out}: {log.lines} lines at {log.rate:g} Hz; {log.said}")
    if log.withheld:
        say(f"withheld: {log.withheld}; {log.why}", err=True)
