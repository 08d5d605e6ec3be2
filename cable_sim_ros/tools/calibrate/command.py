"""`cable-sim calibrate`: numbers of a scene fitted to a recording, with intervals, judged on what was held out."""

from __future__ import annotations

import json
import sys
from math import floor, isfinite, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.number import Number
from ...cli.options import SET_HELP, Heave
from ...cli.progress import progress_bar
from ...limits import LONGEST_RUN
from ...terminal import in_lines, plain_console, say
from .limits import HOLD_OUT, MAX_LAG

if TYPE_CHECKING:
    from .result import Calibration, Left, Parameter

PICTURES = (".png", ".pdf", ".svg", ".jpg", ".jpeg")
OF_ONE = "NAME[~SD]"


def _instrument(name: str, text: str) -> Any:
    return click.option(
        f"--{name}", multiple=True, metavar=OF_ONE, help=f"{text} NAME: a signal, or all; SD: deviation of a prior."
    )


@click.command()
@click.argument("bag")
@click.option("--scene", required=True, metavar="NAME|FILE", help="Scene to calibrate.")
@click.option(
    "--free",
    multiple=True,
    required=True,
    metavar="KEY[=LOW:HIGH][~[MEAN:]SD]",
    help="A number of the scene that is fitted, its range (half to twice the scene's), its prior. May be repeated.",
)
@click.option("--mapping", metavar="M", help="Mapping of BAG: a file, or the name of a ready one.")
@click.option("--motion", metavar="BAG|CSV|none", help="Ship motion. Default: that of BAG; none: the mean track.")
@click.option("--heave", type=Heave(), help="Sinusoidal heave in place of --motion: amplitude in m, period in s.")
@click.option("--winch", metavar="PLAN|FILE", help="What the winch did, in place of the commands of the motion's bag.")
@click.option("--duration", type=Number(1.0, LONGEST_RUN, "s"), metavar="S", help="Seconds of the motion to use.")
@click.option(
    "--signal",
    "signals",
    multiple=True,
    metavar="NAME[~NOISE]",
    help="A measured signal to fit, with its noise. Default: one of each kind there is; the noise from what is left.",
)
@_instrument("bias", "Fit a bias of this instrument too.")
@_instrument("gain", "Fit a gain of this instrument too.")
@_instrument("lag", "Fit a lag of this instrument too, in s behind the simulation.")
@click.option("--max-lag", type=Number(0.0, 60.0, "s", above=True), default=MAX_LAG, show_default=True, metavar="S",
              help="Largest lag, either way.")  # fmt: skip
@click.option(
    "--hold-out",
    type=Number(0.0, 0.9),
    default=HOLD_OUT,
    show_default=True,
    metavar="SHARE",
    help="Last share of the record that is not fitted, but judges.",
)
@click.option("--steady", is_flag=True, help="Static tow against means over 30 s: no motion, no lag.")
@click.option(
    "--intervals",
    type=click.Choice(["profile", "linear"]),
    default="profile",
    show_default=True,
    help="Profile likelihood (iminuit), or from the covariance alone.",
)
@click.option("--every", type=Number(1e-3, 1.0, "s"), metavar="S", help="Seconds between simulated values.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help=SET_HELP)
@click.option(
    "--out", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE", help="Write the calibrated scene to FILE."
)
@click.option(
    "--picture", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE", help="Draw measured and simulated."
)
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
def calibrate(bag, scene, free, mapping, motion, heave, winch, duration, signals, bias, gain, lag, max_lag, hold_out,
              steady, intervals, every, settings, out, picture, as_json) -> None:  # fmt: skip
    """Fit numbers of a scene to what was measured in BAG: a recording, an imported bag, a log with a mapping.

    Exit codes: 0 ok; 1 not converged; 2 bad input; 3 a recording was damaged; 4 doubtful: a bound is active, numbers
    cannot be told apart, or the fit does not hold on the part held out.
    """
    for path in (out, picture):
        if path is not None and not path.parent.is_dir():
            raise click.UsageError(f"{path}: there is no folder {path.parent}; nothing was simulated. Make it first")
    if picture is not None and picture.suffix.lower() not in PICTURES:
        raise click.UsageError(f"{picture}: is none of {', '.join(PICTURES)}; nothing was simulated. Name one of these")
    if steady and (motion not in (None, "none") or any(one is not None for one in (heave, winch, duration, every))):
        raise click.UsageError(
            "--steady has no motion; nothing was simulated. Leave --motion, --heave, --winch, --duration, --every out"
        )
    if heave is not None and motion is not None:
        raise click.UsageError("--heave and --motion contradict each other; nothing was simulated. Leave one out")
    from ...io.scenes.document import SceneError
    from ...io.scenes.load import load_scene
    from ...io.scenes.winch_plan import WinchPlan
    from ...io.sources.imported_bag import provenance
    from ...runs.settings import apply_to_scene, of_intake, settings_of
    from ...runs.sources import motion_of, notes_of, sea_motion_kept
    from ...runs.step_choice import overwritten, stepped
    from ...sim.verdict import check
    from ..compare.recordings import read_recording
    from .calibrate import Options
    from .calibrate import calibrate as fitted
    from .free import CalibrateError

    given = settings_of(settings)
    asked = Options(
        signals=_named("signal", signals),
        bias=_named("bias", bias),
        gain=_named("gain", gain),
        lag=_named("lag", lag),
        max_lag=max_lag,
        hold_out=hold_out,
        profile=intervals == "profile",
        steady=steady,
    )
    base = apply_to_scene(load_scene(scene), given)
    if lost := overwritten(base, given, "chosen", every):
        raise SceneError(lost)
    run = stepped(base, "chosen", every)
    recording = read_recording(bag, mapping)
    plan = None if winch is None else WinchPlan.of(winch)
    moved = bag if motion is None and heave is None else None if motion == "none" else motion
    intake = of_intake(given)
    tow = None if steady else motion_of(run, moved, heave, duration, False, intake)
    if tow is not None and plan is not None:
        tow.events = [event for event in tow.events if not event.is_command]
    of_motion = "" if tow is None or (moved == bag and recording.damage) else tow.damage  # once where it is one bag
    damage = [text for text in (recording.damage, of_motion) if text]
    try:
        with progress_bar(as_json, "runs") as progress:
            result = fitted(
                run,
                recording.signals,
                recording.name,
                free,
                tow,
                duration=duration,
                plan=plan,
                options=asked,
                progress=lambda what, runs: progress(f"{what}: {runs} runs", runs, 0),
            )
    except CalibrateError as error:
        raise CalibrateError("; ".join([str(error), *(f"damaged: {text}" for text in damage)])) from None
    result.reasons += [check("DAMAGE", text) for text in damage]
    result.notes += recording.notes
    if tow is not None and moved != bag:
        imported, waves = provenance(tow.about), sea_motion_kept(tow)
        result.notes += [f"motion: {text}" for text in notes_of({"imported": imported, "rao": waves})]
    finish(
        result, scene, base, {key: value for key, value in given.items() if key not in intake}, out, picture, as_json
    )


def _named(option: str, texts: tuple[str, ...]) -> dict[str, float | None]:
    """Deviation (or None) by name, of texts NAME[~SD]."""
    from .free import CalibrateError, number_of
    from .observed import USABLE

    found: dict[str, float | None] = {}
    for text in texts:
        name, sign, number = text.partition("~")
        if name not in (*USABLE, "all") or (name == "all" and option == "signal"):
            raise CalibrateError(
                f"--{option} {text}: {name} is no signal of a calibration; nothing was simulated. Give one of "
                f"{', '.join(USABLE)}"
            )
        if name in found:
            raise CalibrateError(f"--{option} {text}: {name} was given before; nothing was simulated. Give it once")
        found[name] = number_of(number, f"--{option} {text}", "standard deviation") if sign else None
        if sign and not (found[name] or 0.0) > 0.0:
            raise CalibrateError(f"--{option} {text}: is not above 0; nothing was simulated. Give a deviation above 0")
    return found


def finish(
    result: Calibration, scene: str, base: Any, settings: dict[str, Any], out: Path | None, picture: Path | None,
    as_json: bool,
) -> None:  # fmt: skip
    """Write, print, and leave with the code of the verdict."""
    from ..compare.command import lines_of

    if as_json:
        say(json.dumps(_plain(result.as_dict()), indent=1, allow_nan=False), lines=True)
    else:
        tell(result)
    if out is not None and result.converged:
        from ...io.scenes.load import override
        from .write_scene import rounded, write_scene

        values = {**settings, **{key: rounded(value) for key, value in result.values.items()}}
        head = _head(result) + [
            f"  {key} = {value}, of --set" for key, value in settings.items() if key not in result.values
        ]
        write_scene(scene, override(base, values), values, head, out)
        say(f"scene:     {out}", err=as_json)
    elif out is not None:
        say(f"scene:     {out} was not written: the fit has not converged", err=True)
    if picture is not None:
        try:
            from .picture import draw_calibration

            say(f"picture:   {draw_calibration(result, picture)}", err=as_json)
        except RuntimeError as error:  # matplotlib is an extra
            say(f"warning: {error}", err=True)
    if not as_json or result.verdict.code:
        lines = lines_of(result.verdict)
        what = "the fit has not converged" if not result.converged else "its numbers cannot be taken as they are"
        state = result.verdict.state
        lines[0] = f"verdict: {state}{'' if state == 'ok' else f': {what}'} (docs/calibrate.md)"
        for line in lines:
            say(line, err=as_json)
    sys.exit(result.verdict.code)


def _plain(value: Any) -> Any:
    """A JSON value without numbers that JSON does not have."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def _head(result: Calibration) -> list[str]:
    lines = [f"Calibrated by cable-sim calibrate on {Path(result.name).name}, verdict {result.verdict.state}:"]
    for one in result.parameters:
        if one.number and one.interval == (None, None):
            lines.append(f"  {one.name} is not known from it: {one.start:.5g} as it was")
            continue
        was = f", was {one.start:.5g}" if one.number else ", of the instrument"
        lines.append(f"  {one.name} = {_fine(one, one.value)} {_interval(one)} (95 %){was}")
        lines += [f"    taken as exact, {text}" for text in _conditional(one)]
    return lines


def _interval(one: Parameter) -> str:
    low, high = ("open" if end is None else _fine(one, end) for end in one.interval)
    return f"[{low}, {high}]"


def _conditional(one: Parameter) -> list[str]:
    """What of each signal's instrument the interval takes as exact, and what an error of it moves the number by."""
    rows: dict[str, list[str]] = {}
    for quantity, kind, error, unit, moves in one.conditional:
        size = f"{100.0 * error:g} %" if kind == "gain" else f"{error:g} {unit}"
        by = "" if moves is None else f" ({size}: {moves:+.2g})"
        rows.setdefault(quantity, []).append(f"{kind}{by}")
    return [f"{quantity}: {', '.join(told)}" for quantity, told in rows.items()]


def _fine(one: Parameter, number: float) -> str:
    """A number with digits enough for two of the half width of its interval; five where that is open."""
    ends = [end for end in one.interval if end is not None]
    half = max(abs(end - one.value) for end in ends) if ends else 0.0
    if half <= 0.0 or number == 0.0:
        return f"{number:.5g}"
    return f"{number:.{min(max(2 + floor(log10(abs(number))) - floor(log10(half)), 4), 12)}g}"


def tell(result: Calibration) -> None:
    """Tables of the parameters and of what is left."""
    from rich.table import Table

    console = plain_console(140)
    table = Table(title=f"{result.scene.name} calibrated on {result.name}")
    table.title_justify = "left"
    for name in ("number", "unit"):
        table.add_column(name)
    for name in ("start", "value", "95 % interval", "range"):
        table.add_column(name, justify="right")
    table.add_column("if these are exact (an error: moves the value by)")
    for one in result.parameters:
        limits = f"{one.limits[0]:.4g} to {one.limits[1]:.4g}"
        table.add_row(one.name, one.unit, f"{one.start:.5g}", _fine(one, one.value), _interval(one), limits,
                      in_lines(*_conditional(one)))  # fmt: skip
    console.print(table)
    held = "not held out" if result.held_s is None else f"{result.held_s[0]:.4g} to {result.held_s[1]:.4g} s"
    rests = Table(
        title=f"Simulated less measured: fitted {result.fitted_s[0]:.4g} to {result.fitted_s[1]:.4g} s, judged {held}"
    )
    rests.title_justify = "left"
    for name in ("signal", "unit", "scene"):
        rests.add_column(name)
    for name in ("bias, fitted", "rms, fitted", "bias, judged", "rms, judged", "samples", "independent"):
        rests.add_column(name, justify="right")
    for shown in result.signals:
        rows = [("as given", shown.given), ("instrument alone", shown.instrument), ("calibrated", shown.calibrated)]
        for name, left in rows:
            if left is not None:
                counts = (str(shown.samples), f"{shown.independent:.0f}") if name == "calibrated" else ("", "")
                rests.add_row(shown.quantity, shown.unit, name, *_cells(left), *counts)
    console.print(rests)
    names = [one.name for one in result.parameters]
    if len(names) > 1:
        matrix = Table(title="Correlations")
        matrix.title_justify = "left"
        matrix.add_column("")
        for k in range(len(names)):
            matrix.add_column(str(k + 1), justify="right")
        for k, row in enumerate(result.correlation):
            matrix.add_row(f"{k + 1} {names[k]}", *(f"{value:+.2f}" for value in row[: k + 1]))
        console.print(matrix)
    how = "profile likelihood" if result.profile else "linear"
    say(f"cost:      {result.runs} runs, {result.cpu_s:.0f} CPU s; intervals: {how}")


def _cells(left: Left) -> list[str]:
    return [f"{value:.4g}" for value in left.fitted] + (
        ["-", "-"] if left.held is None else [f"{value:.4g}" for value in left.held]
    )
