"""`cable-sim calibrate`: numbers of a scene fitted to a recording, with intervals, judged on what was held out."""

from __future__ import annotations

from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.options import FILE, Answer, Heave, Number, answers, drawn, progress_bar, set_option
from ...files import finite
from ...limits import LONGEST_RUN
from ...sim.flag_rules import DOUBTFUL, FAILED
from ...terminal import in_lines, print_table, say
from .limits import HOLD_OUT, MAX_LAG

if TYPE_CHECKING:
    from ...sim.scene import Scene
    from .result import Calibration, Left, Parameter

PICTURES = (".png", ".pdf", ".svg", ".jpg", ".jpeg")
OF_ONE = "NAME[~SD]"
MEANING = {DOUBTFUL: "its numbers cannot be taken as they are", FAILED: "the fit has not converged"}


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
@click.option("--duration", type=Number(1.0, LONGEST_RUN, "s"), help="Seconds of the motion to use.")
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
@click.option("--max-lag", type=Number(0.0, 60.0, "s", above=True), default=MAX_LAG, help="Largest lag, either way.")
@click.option(
    "--hold-out",
    type=Number(0.0, 0.9),
    default=HOLD_OUT,
    metavar="SHARE",
    help="Last share of the record that is not fitted, but judges.",
)
@click.option("--steady", is_flag=True, help="Static tow against means over 30 s: no motion, no lag.")
@click.option(
    "--intervals",
    type=click.Choice(["profile", "linear"]),
    default="profile",
    help="Profile likelihood (iminuit), or from the covariance alone.",
)
@click.option("--every", type=Number(1e-3, 1.0, "s"), help="Seconds between simulated values.")
@set_option()
@click.option("--out", type=FILE, metavar="FILE", help="Write the calibrated scene to FILE.")
@click.option("--picture", type=FILE, metavar="FILE", help="Draw measured and simulated.")
@answers
def calibrate(scene, settings, out, picture, every, **asked) -> Answer:
    """Fit numbers of a scene to what was measured in BAG: a recording, an imported bag, a log with a mapping.

    Exit codes: 0 ok; 1 not converged; 2 bad input; 3 a recording was damaged; 4 doubtful: a bound is active, numbers
    cannot be told apart, or the fit does not hold on the part held out.
    """
    _refuse(out, picture, every, **asked)
    from ...io.scenes.document import SceneError
    from ...io.scenes.load import load_scene
    from ...runs.settings import apply_to_scene, of_intake, settings_of
    from ...runs.step_choice import overwritten, stepped

    given = settings_of(settings)
    base = apply_to_scene(load_scene(scene), given)
    if lost := overwritten(base, given, "chosen", every):
        raise SceneError(lost)
    intake = of_intake(given)
    result = _fitted(stepped(base, "chosen", every), intake, **asked)
    kept = {key: value for key, value in given.items() if key not in intake}
    files, warnings = _scene(result, scene, base, kept, out) if out is not None else ([], [])
    if picture is not None:
        from .result import draw_calibration

        files += drawn(lambda: draw_calibration(result, picture))
    verdict = result.verdict.lines(what=MEANING, page="docs/calibrate.md")
    figures, code = finite(result.as_dict()), result.verdict.code
    return Answer(figures, lambda: tell(result), files=files, warnings=warnings, verdict=verdict, code=code)


def _refuse(out: Path | None, picture: Path | None, every: float | None, **asked: Any) -> None:
    """Refuse what cannot be written, and options that contradict each other."""
    for path in (out, picture):
        if path is not None and not path.parent.is_dir():
            raise click.UsageError(f"{path}: there is no folder {path.parent}; nothing was simulated. Make it first")
    if picture is not None and picture.suffix.lower() not in PICTURES:
        raise click.UsageError(f"{picture}: is none of {', '.join(PICTURES)}; nothing was simulated. Name one of these")
    motion, heave = asked["motion"], asked["heave"]
    moved = any(one is not None for one in (heave, asked["winch"], asked["duration"], every))
    if asked["steady"] and (motion not in (None, "none") or moved):
        raise click.UsageError(
            "--steady has no motion; nothing was simulated. Leave --motion, --heave, --winch, --duration, --every out"
        )
    if heave is not None and motion is not None:
        raise click.UsageError("--heave and --motion contradict each other; nothing was simulated. Leave one out")


def _fitted(run: Scene, intake: dict[str, Any], bag: str, **asked: Any) -> Calibration:
    """Fit the numbers of a scene to what was measured; intake: settings of how messages are taken in."""
    from ...io.scenes.winch_plan import WinchPlan
    from ...io.sources.recorded_tow import provenance
    from ...runs.sources import motion_of, notes_of, sea_motion_kept
    from ...sim.verdict import check
    from ..compare.recordings import read_recording
    from .calibrate import Options
    from .calibrate import calibrate as fitted
    from .free import CalibrateError

    motion, heave, duration = asked["motion"], asked["heave"], asked["duration"]
    options = Options(
        signals=_named("signal", asked["signals"]),
        bias=_named("bias", asked["bias"]),
        gain=_named("gain", asked["gain"]),
        lag=_named("lag", asked["lag"]),
        max_lag=asked["max_lag"],
        hold_out=asked["hold_out"],
        profile=asked["intervals"] == "profile",
        steady=asked["steady"],
    )
    recording = read_recording(bag, asked["mapping"])
    plan = None if asked["winch"] is None else WinchPlan.of(asked["winch"])
    moved = bag if motion is None and heave is None else None if motion == "none" else motion
    tow = None if options.steady else motion_of(run, moved, heave, duration, False, intake)
    if tow is not None and plan is not None:
        tow.events = [event for event in tow.events if not event.is_command]
    of_motion = "" if tow is None or (moved == bag and recording.damage) else tow.damage  # once where it is one bag
    damage = [text for text in (recording.damage, of_motion) if text]
    try:
        with progress_bar(unit="runs") as progress:
            result = fitted(
                run,
                recording.signals,
                recording.name,
                asked["free"],
                tow,
                duration=duration,
                plan=plan,
                options=options,
                progress=lambda what, runs: progress(f"{what}: {runs} runs", runs, 0),
            )
    except CalibrateError as error:
        raise CalibrateError("; ".join([str(error), *(f"damaged: {text}" for text in damage)])) from None
    result.reasons += [check("DAMAGE", text) for text in damage]
    result.notes += recording.notes
    if tow is not None and moved != bag:
        imported, waves = provenance(tow.about), sea_motion_kept(tow)
        result.notes += [f"motion: {text}" for text in notes_of({"imported": imported, "rao": waves})]
    return result


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


def _scene(
    result: Calibration, scene: str, base: Scene, settings: dict[str, Any], out: Path
) -> tuple[list[tuple[str, Path]], list[str]]:
    """Write the calibrated scene: the file, or why there is none."""
    if not result.converged:
        return [], [f"scene:     {out} was not written: the fit has not converged"]
    from ...io.scenes.load import override
    from .result import rounded, write_scene

    values = {**settings, **{key: rounded(value) for key, value in result.values.items()}}
    head = _head(result) + [
        f"  {key} = {value}, of --set" for key, value in settings.items() if key not in result.values
    ]
    write_scene(scene, override(base, values), values, head, out)
    return [("scene", out)], []


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
    exact = "if these are exact (an error: moves the value by)"
    rows: list[Any] = [
        (
            one.name,
            one.unit,
            f"{one.start:.5g}",
            _fine(one, one.value),
            _interval(one),
            f"{one.limits[0]:.4g} to {one.limits[1]:.4g}",
            in_lines(*_conditional(one)),
        )
        for one in result.parameters
    ]
    head = ("number", "unit", "start", "value", "95 % interval", "range", exact)
    words = ("number", "unit", "signal", "scene", "", exact)
    print_table(f"{result.scene.name} calibrated on {result.name}", head, rows, words, 140)
    rows = []
    for shown in result.signals:
        for name, left in (
            ("as given", shown.given),
            ("instrument alone", shown.instrument),
            ("calibrated", shown.calibrated),
        ):
            if left is not None:
                counts = (str(shown.samples), f"{shown.independent:.0f}") if name == "calibrated" else ("", "")
                rows.append((shown.quantity, shown.unit, name, *_cells(left), *counts))
    held = "not held out" if result.held_s is None else f"{result.held_s[0]:.4g} to {result.held_s[1]:.4g} s"
    title = f"Simulated less measured: fitted {result.fitted_s[0]:.4g} to {result.fitted_s[1]:.4g} s, judged {held}"
    places = ("bias, fitted", "rms, fitted", "bias, judged", "rms, judged")
    print_table(title, ("signal", "unit", "scene", *places, "samples", "independent"), rows, words, 140)
    names = [one.name for one in result.parameters]
    if len(names) > 1:
        rows = [
            (f"{k + 1} {names[k]}", *(f"{value:+.2f}" for value in row[: k + 1]))
            for k, row in enumerate(result.correlation)
        ]
        print_table("Correlations", ("", *(str(k + 1) for k in range(len(names)))), rows, words, 140)
    how = "profile likelihood" if result.profile else "linear"
    say(f"cost:      {result.runs} runs, {result.cpu_s:.0f} CPU s; intervals: {how}")


def _cells(left: Left) -> list[str]:
    return [f"{value:.4g}" for value in left.fitted] + (
        ["-", "-"] if left.held is None else [f"{value:.4g}" for value in left.held]
    )
