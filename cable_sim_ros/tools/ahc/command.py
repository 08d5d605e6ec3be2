"""The command `cable-sim ahc`: run the benchmark, keep its leaderboard, check it by a re-run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ...cli.options import (
    FILE,
    Answer,
    Count,
    answers,
    drawn,
    folder_option,
    json_of,
    progress_bar,
    ready,
    report_option,
    said,
    typed,
)
from ...errors import CODE_FAILED, CODE_OK, told_as
from ...files import read_text, write_text
from ...terminal import markdown_table, print_table, say


@click.command()
@click.argument("laws", nargs=-1, metavar="[LAW or FOLDER...]")
@click.option(
    "--track", type=click.Choice(["truth", "mru"]), help="mru: by an MRU alone. Default: truth; FOLDER: both."
)
@click.option("--controller", metavar="FILE.py:NAME", help="In place of laws: make(scene, period) -> controller(row).")
@click.option("--command", "program", metavar="COMMAND", help="In place of laws: a program of rclpy, in lockstep.")
@click.option("--name", metavar="NAME", help="Of that controller or program on the leaderboard. Default: its file.")
@click.option(
    "--only",
    multiple=True,
    metavar="SCENE/MOTION/CLASS",
    help="These cells alone, with * and ?, as in 'full_scale/*/dead_*'; may be repeated. No result to merge.",
)
@click.option("--quick", is_flag=True, help="Three cells of 20 s: does it work? No result to merge.")
@click.option("--processes", type=Count(1, 64), default=2, help="Runs at a time.")
@folder_option("Folder for table, JSON and picture.")
@click.option("--merge", "result", type=FILE, metavar="AHC.json", help="Run nothing: add this result to --board.")
@click.option("--check", is_flag=True, help="Run what FOLDER has; with --board, run again what it has, and compare.")
@click.option("--board", type=FILE, metavar="FILE.csv", help="The leaderboard of --merge, --check and --table.")
@click.option("--replace", is_flag=True, help="With --merge: in place of the rows that these entrants have.")
@click.option("--table", is_flag=True, help="Run nothing: the tables of --board in Markdown.")
@click.option("--page", type=FILE, metavar="FILE.md", help="With --table: put all tables there, and ahc.png beside it.")
@click.option(
    "--definition", "shown", is_flag=True, help="Run nothing: scenes, motions, classes and figures in Markdown."
)
@click.option("--reveal", type=FILE, metavar="FILE.yaml", help="Run nothing: is it the scene that was held out?")
@report_option
@answers
def ahc(laws, track, controller, program, name, only, quick, processes, out, result, check, board, replace, table, page,
        shown, reveal, report) -> Answer | None:  # fmt: skip
    """The benchmark of heave compensators: set-point laws (default: all), the entrants of a folder with an entry.yaml,
    or a controller of your own.

    Each run stands beside one with the winch held. What was stopped goes on where --out or FOLDER has its rows. With
    --board, --check leaves with code 1 where the leaderboard differs.
    """
    modes = {"--merge": result, "--check": check, "--table": table, "--definition": shown, "--reveal": reveal}
    entrants = {"LAW": laws, "--controller": controller, "--command": program}
    others = {"--only": only, "--quick": quick, "--out": out, "--report": report}
    refuse(modes, entrants, others, {"--board": board, "--replace": replace, "--page": page, "--name": name})
    if shown:
        from .tables import definition_markdown, figures_markdown, score_markdown

        say(f"{definition_markdown()}\n\n{figures_markdown()}\n\n{score_markdown()}", lines=True)
    elif reveal:
        return revealed(reveal)
    elif table:
        tables_of(board, page)
    elif result:
        merged(result, board, replace)
    else:
        from .definition import cells
        from .entrants import TRACKS

        folders = folders_of(laws)
        if board is not None:
            checkable(board, () if folders else laws or ((name,) if name else ()))
        out = out or (folders[0] if check and folders else None)
        ready(out)
        chosen = entrants_of(laws, controller, program, name, board)
        versions = [TRACKS[track or "truth"]] if track or not folders else [*TRACKS.values()]
        fitting = [one for one in versions if any(one in each.tracks for each in chosen) and cells(only or ("*",), one)]
        several = [run(chosen, one, only, quick, processes, out) for one in fitting or versions[:1]]
        files = [file for done in several for file in written(done, out)]
        if report is not None:
            from .report import write_report

            rows = [row for done in several for row in done["rows"]]
            said(write_report({**several[0], "rows": rows}, report, typed()))
        if board is not None:
            return differences(several, board, files)
        return Answer(several if len(several) > 1 else several[0], lambda: tell(several), files=files)
    return None


def refuse(modes, entrants, others, beside):
    """Refuse options that do not go together: what is done, who runs, options of a run, and those of one of these."""
    one_of(modes)
    folders = folders_of(entrants["LAW"])
    taking = modes["--merge"] or modes["--check"] or modes["--table"]
    if (beside["--board"] is None) != (not taking) and not (modes["--check"] and folders):
        raise click.UsageError(
            "--board is the leaderboard of --merge, --check or --table, and they need it; nothing was done. Give both, "
            "as in --check --board docs/ahc-1.csv"
        )
    for option, mode in (("--replace", "--merge"), ("--page", "--table")):
        if beside[option] and not modes[mode]:
            raise click.UsageError(f"{option} belongs to {mode}; nothing was done. Leave it out")
    for mode in ("--merge", "--table", "--definition", "--reveal"):
        if modes[mode] and (odd := [option for option, given in (entrants | others).items() if given]):
            raise click.UsageError(f"{mode} runs nothing; nothing was done. Leave {', '.join(odd)} out")
    one_of(entrants)
    if beside["--name"] and not (entrants["--controller"] or entrants["--command"]):
        raise click.UsageError("--name is that of --controller or --command; nothing was run. Leave it out")
    if others["--quick"] and (others["--only"] or modes["--check"]):
        raise click.UsageError("--quick stands alone: no --only and no --check beside it; nothing was run")


def folders_of(laws):
    """Those of the names that are folders of entrants."""
    return [Path(name) for name in laws if Path(name).is_dir()]


def revealed(path):
    """Is a file the scene that was held out? Code 1 where it is not."""
    from ...io.scenes.yaml12 import YamlError
    from .definition import HELD_OUT, MRU, sealed

    try:
        found = sealed(read_text(path))
    except (OSError, YamlError) as error:
        raise click.UsageError(f"--reveal {path}: cannot be read ({error}); nothing was compared") from None
    same = found == HELD_OUT
    what = "is the scene" if same else f"(SHA-256 {found}) is not the scene"
    return Answer(
        {"sha256": found, "held_out": HELD_OUT, "same": same},
        lambda: say(f"{path}: {what} that {MRU} holds out, {HELD_OUT}"),
        code=CODE_OK if same else CODE_FAILED,
    )


def checkable(board, names):
    """Refuse a leaderboard that a re-run cannot be compared with. Raises AhcError."""
    from . import board as boards
    from .definition import VERSION, digest
    from .remote import AhcError

    rows = boards.read(board)
    there = {row["entrant"] for row in rows}
    if not rows:
        raise AhcError(f"{board}: has no rows to check; nothing was run. Give the leaderboard of --merge")
    if missing := [name for name in names if name not in there]:
        raise AhcError(
            f"{board}: has no row of {', '.join(missing)}; nothing was run. It has {', '.join(sorted(there))}"
        )
    made = {(row["definition"], row["benchmark"]) for row in rows}
    if other := {mine for mine, version in made if mine != digest(version)}:
        raise AhcError(
            f"{board}: has rows of definition {', '.join(sorted(other))}, here {VERSION} is {digest()}; nothing "
            f"was run. Take the version of the product that made them"
        )


def one_of(options: dict[str, Any]) -> None:
    """Refuse more than one of these."""
    given = [option for option, value in options.items() if value]
    if len(given) > 1:
        raise click.UsageError(f"{' and '.join(given)} stand alone; nothing was done. Leave one out")


def entrants_of(laws, controller, program, name, board):
    """Who is to run; with a leaderboard and nobody named, the built-in laws that it has."""
    from . import board as boards
    from .entrants import BUILT_IN, entries, external
    from .entrants import laws as built_in

    if controller or program:
        return [external(name, controller, program)]
    if folders := folders_of(laws):
        others = [name for name in laws if not Path(name).is_dir()]
        return [*(built_in(tuple(others)) if others else ()), *(one for at in folders for one in entries(at))]
    if board is not None and not laws:
        rows = boards.read(board)
        laws = tuple(dict.fromkeys(row["entrant"] for row in rows if row["rank"] == BUILT_IN))
    return built_in(laws)


def run(entrants, version, only, quick, processes, out):
    """The result of the cells of a track that are asked for; with a folder, rows that are there are not run again."""
    from . import benchmark, definition
    from .remote import AhcError

    patterns = definition.QUICK if quick and version == definition.VERSION else only or ("*",)
    cells = definition.cells(patterns, version)[: len(definition.QUICK) if quick else None]
    if not cells:
        raise AhcError(f"--only {' '.join(only)}: fits no cell; nothing was run. cable-sim ahc --definition lists them")
    span = benchmark.SHORT if quick else benchmark.FULL
    journal = benchmark.Journal(out / "ahc_rows.jsonl") if out is not None else None
    say(benchmark.length_of(entrants, cells, span, processes, journal), err=True)
    with progress_bar(unit="runs") as progress:
        return benchmark.run(entrants, cells, span, processes, progress, journal)


def written(done, out):
    """The files of a result in the folder, where there is one."""
    from .definition import VERSION
    from .picture import draw
    from .tables import by_class, cells_markdown

    if out is None:
        return []
    rows, name = done["rows"], "ahc" if done["benchmark"] == VERSION else "ahc-mru"
    write_text(out / f"{name}.json", json_of(done) + "\n")
    write_text(out / f"{name}.md", f"{markdown_table(by_class(rows))}\n\n{cells_markdown(rows)}\n")
    files = [("table", out / f"{name}.md"), ("figures", out / f"{name}.json")]
    return files + drawn(lambda: draw(rows, out / f"{name}.png", done["benchmark"]))


def tell(several):
    """The tables on the terminal, the scores, and the cells that an entrant did not run."""
    from .tables import by_class, scores, skipped

    for done in several:
        title = f"{done['benchmark']}, cable_sim_ros {done['product']} {done['commit']}".rstrip()
        head, *lines = by_class(done["rows"])
        print_table(title, head, lines, left=head[:2], width=200)
        for line in skipped(done["rows"]):
            say(line)
    head, *lines = scores([row for done in several for row in done["rows"]])
    print_table("Score", head, lines, left=head[:1], width=200)
    for line in several[0]["score"]["definition"]:
        say(line)


def tables_of(board, page):
    """Print the tables of a leaderboard, or bring a page and the picture beside it up to date."""
    from . import board as boards
    from .definition import VERSION
    from .tables import made, results

    rows = boards.with_twins(boards.read(board))
    if page is None:
        say(results(rows), lines=True)
        return
    from .picture import draw

    text = made(read_text(page), rows)
    write_text(page, text)
    say(f"{page}, {draw(rows, page.parent / 'ahc.png', VERSION)}")


def merged(result, board, replace):
    """Add a result to a leaderboard."""
    from . import board as boards

    rows = boards.merge(boards.read(board), boards.load_result(result), str(result), replace)
    with told_as(click.UsageError, f"--board {board}: cannot be written", "; it was not changed"):
        board.parent.mkdir(parents=True, exist_ok=True)
        write_text(board, boards.text_of(rows))
    names = ", ".join(dict.fromkeys(row["entrant"] for row in rows))
    say(f"{board}: {len(rows)} rows of {names}")


def differences(several, board, files):
    """Where a re-run is not the leaderboard; code 1 where it is not."""
    from . import board as boards
    from .definition import TOLERANCE

    again = [row for done in several for row in boards.rows_of(done)]
    found = boards.compared(boards.read(board), again)

    def tell():
        for one in found:
            say(f"{one.entrant} {one.cell}: {one.what} = {one.board} on the leaderboard, {one.again} again")
        say(f"{len(again)} rows run again, {len(found)} differences above {100.0 * TOLERANCE:g} %")

    figures = [difference._asdict() for difference in found]
    return Answer(figures, tell, files=files, code=CODE_FAILED if found else CODE_OK)
