"""`cable-sim view`: the tow in a browser, beside a node or on a bag; `cable-sim film`: of a bag, for a slide."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from ...cli.options import FILE, Answer, Count, Number, answers, need_ros, node_options, start_option, tow_scene_option
from ...limits import LONGEST_RUN
from ...processes import Alive
from ...terminal import say

if TYPE_CHECKING:
    from viser import ViserServer


top_option = click.option(
    "--tension",
    "top",
    type=Number(0.0, 1e8, "N", above=True),
    help="Top of the colours. Default: of a bag its largest tension, rounded up; of a node 1.25 times "
    "contact.working_tension.",
)


@click.command()
@click.argument("bag", required=False)
@tow_scene_option
@node_options(wait=10.0)
@click.option("--host", default="127.0.0.1", help="Address that the page is served at.")
@click.option("--port", type=Count(0, 65535), default=8080, help="Its port; 0: any that is free.")
@click.option(
    "--rate",
    type=Number(0.1, 60.0, "Hz"),
    default=10.0,
    help="Pictures a second, at most: no more than there are messages of the cable's shape.",
)
@top_option
@click.option(
    "--save",
    type=FILE,
    metavar="FILE.html",
    help="Write the page of BAG as one file that plays without this program, and end.",
)
@start_option
@click.option(
    "--seconds",
    type=Number(0.0, LONGEST_RUN, "s", above=True),
    help="Seconds of the bag for --save. Default: 60, or all there are.",
)
@click.option("--camera", type=click.Choice(["whole", "sheave", "fish", "drum"]), default="whole", help="First camera.")
def view(bag, scene, namespace, wait, open_, host, port, rate, top, save, start, seconds, camera) -> None:
    """Show the tow in a browser: of a running node, or of a recorded BAG, to pause and scrub."""
    if bag is None and (save or seconds or start):
        raise click.UsageError("--save, --start and --seconds are of a bag; nothing was started; give BAG")
    if save is None and seconds:
        raise click.UsageError("--seconds is of --save; nothing was started; give --save FILE.html or leave it out")
    if bag is not None and (open_ or namespace != "/tow_sim"):
        raise click.UsageError("--namespace and --open are of a node; nothing was started; leave them or BAG out")
    from . import page

    if bag is None:
        need_ros()
        from ...ros.watcher import Watcher, watching
        from .beside_node import follow

        page.need("viser", "the page")
        page.check_port(host, port or page.free_port(host))
        alive = Alive()
        with watching(namespace, wait, alive, open_, Watcher) as watcher:
            tow = watcher.scene(scene)
            with _served(host, port, tow.name) as server:
                follow(server, watcher, tow, rate, top, alive, camera)
        return
    from ...io.scenes.document import find_bag
    from .moment import BagRun

    page.need("viser", "the page")
    if save is not None:
        from .saved import save_page

        run = BagRun(find_bag(bag), scene)
        made = save_page(run, save, rate, top, start, seconds, camera)
        say(f"page: {save} ({made.seconds:g} s in {made.pictures} pictures, {made.size / 1e6:.1f} MB)")
        return
    from .play_bag import play

    page.check_port(host, port or page.free_port(host))
    run = BagRun(find_bag(bag), scene)
    alive = Alive()
    with _served(host, port, run.scene.name) as server:
        play(server, run, rate, top, alive, start, camera)


@contextmanager
def _served(host: str, port: int, name: str) -> Iterator[ViserServer]:
    """The page of a scene, served until the end."""
    from . import page

    server = page.serve(host, port, f"cable-sim view: {name}")
    lines = page.addresses(host, server.get_port())
    if "warning" in lines:
        say(f"warning: {lines['warning']}", err=True)
    say(f"page: {lines['page']}  (Ctrl-C ends it)")
    try:
        yield server
    finally:
        server.stop()


def size_of(text: str) -> tuple[int, int]:
    """Width and height of a picture, even numbers, as in 1280x720. Raises click.BadParameter."""
    found = re.fullmatch(r"([0-9]{1,5})x([0-9]{1,5})", text.lower())
    if found is None:
        raise click.BadParameter(f"{text!r} is no size; nothing was drawn. Give width x height in pixels, as 1280x720")
    size = int(found[1]), int(found[2])
    if any(not low <= n <= high or n % 2 for n, low, high in zip(size, (320, 180), (3840, 2160))):
        raise click.BadParameter(
            f"{text} px is outside 320x180 to 3840x2160, or odd: a film wants even numbers; nothing was drawn. "
            "Give for example 1280x720"
        )
    return size


@click.command()
@click.argument("bag")
@click.option("--out", type=FILE, required=True, metavar="FILE", help="FILE.mp4 or FILE.gif.")
@tow_scene_option
@click.option(
    "--camera",
    type=click.Choice(["whole", "sheave"]),
    default="whole",
    help="What the large panel shows; the other is beside it.",
)
@start_option
@click.option(
    "--seconds", type=Number(0.0, LONGEST_RUN, "s", above=True), help="Seconds of the bag. Default: all there are."
)
@click.option(
    "--speed", type=Number(0.01, 1000.0), default=2.0, metavar="X", help="Seconds of the bag in a second of film."
)
@click.option("--fps", type=Number(1.0, 60.0, "1/s"), metavar="N", help="Pictures a second. Default: 20; of a GIF 10.")
@click.option("--size", type=size_of, metavar="WxH", help="Pixels. Default: 1280x720; of a GIF 960x540.")
@top_option
@answers
def film(bag, out, scene, camera, fps, size, **asked) -> Answer:
    """Make a film of a recorded BAG for a slide: tow, sheave with its line loads, strip charts."""
    from ...io.scenes.document import find_bag
    from .film_frame import check_film, make_film
    from .moment import BagRun

    check_film(out)
    gif = out.suffix.lower() == ".gif"
    run = BagRun(find_bag(bag), scene)
    made = make_film(
        run,
        out,
        view=camera,
        fps=fps or (10.0 if gif else 20.0),
        size=size or ((960, 540) if gif else (1280, 720)),
        **asked,
    )
    told = (
        f"film: {out} ({made.seconds:.1f} s, {made.pictures} pictures of {made.of_tow:.1f} s of tow, "
        f"{made.size / 1e6:.2f} MB, {made.cpu:.1f} CPU seconds: {1e3 * made.cpu / made.pictures:.0f} ms a picture)"
    )
    figures = made._asdict() | {"path": str(out), "cpu_per_picture_s": made.cpu / made.pictures}
    return Answer(figures, lambda: say(told))
