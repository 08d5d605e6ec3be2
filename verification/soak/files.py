"""S5: parameter files a careless or hostile user could give: each is a scene, or a text that names what is wrong."""

from __future__ import annotations

import random
import re
import time
from pathlib import Path

from cable_sim_ros.io.scenes.document import find_scene, shipped_scenes
from cable_sim_ros.io.scenes.load import SceneError, scene_from_text

from ..shipped import quiet
from ..stress.verdict import IS, Found, Metric, stress

CANARIES = {  # name -> YAML text
    "20 000 brackets": "name: " + "[" * 20_000,
    "20 000 braces": "name: " + "{a: " * 20_000,
    "900 levels of indentation": "".join(" " * k + "a:\n" for k in range(900)),
    "a billion laughs": "a0: &a0 [x, x]\n"
    + "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12)),
    "aliases 2500 levels deep": "".join(
        f"a{k}: &a{k} " + "[" * 48 + (f"*a{k - 1}" if k else "x") + "]" * 48 + "\n" for k in range(52)
    ),
    "an alias of itself": "name: &a [*a]",
    "an integer of 5000 digits": "name: " + "9" * 5000,
    "a float beyond all": "winch:\n  position: [1e999, -1e999, .nan]",
    "a Python object": "name: !!python/object/apply:os.system ['true']",
    "binary": "name: !!binary R0lGODlhDAAMAIQAAP",
    "a set": "? a\n? b",
    "a list as key": "[1, 2]: 3",
    "two documents": "name: a\n---\nname: b",
    "a NUL": "name: a\0b",
    "a lone surrogate": 'name: "\\ud800"',
    "a key of 100 000 letters": "k" * 100_000 + ": 1",
    "a value of a million letters": "name: " + "v" * 1_000_000,
    "20 000 keys": "\n".join(f"k{k}: 1" for k in range(20_000)),
    "merge key": "<<: {name: a}",
    "tabs": "name:\n\t- a",
    "percent": "%YAML 9.9\n---\nname: a",
    "nothing": "",
    "a number": "3",
    "a byte order mark": "\ufeffname: a",
    "right to left": "name: \u202eabc",
}
ODD = "-1 0 1e308 -1e308 .inf .nan null true [] {} '' 'x' 1e-320 ~ 2014-01-01 0x1F 1_000 *a | 1:30".split() + [
    "9" * 400,
    "&a 1",
    "!!float 1",
    "[1, 2, 3, 4, 5]",
    "{a: 1}",
    "- 1",
]
CHARACTERS = [0, 9, 34, 39, 58, 91, 123, 0x7F, 0x2028]


def mutated(text: str, draw: random.Random) -> str:
    """A scene with one to four things wrong: a value, a line, a character, an indentation, a piece of another file."""
    lines = text.splitlines()
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(len(lines)) if lines else 0
        kind = draw.randrange(8)
        line = lines[at] if lines else ""
        if kind <= 2:
            line = re.sub(r"(:\s*)[^#\s][^#]*", lambda m: m.group(1) + draw.choice(ODD) + " ", line, count=1)
        elif kind == 3:
            line = ""
        elif kind == 4:
            cut = draw.randrange(len(line) + 1)
            line = line[:cut] + chr(draw.choice([*CHARACTERS, draw.randrange(32, 900)])) + line[cut:]
        elif kind == 5:
            line = " " * draw.randint(0, 6) + line.strip()
        elif kind == 6:
            line = line + "\n" + draw.choice(lines or [""])
        else:
            number = re.search(r"-?\d+(\.\d*)?(e[-+]?\d+)?", line)
            if number:
                scale = draw.choice([-1.0, 0.0, 1e-9, 1e-3, 1e3, 1e9, 1e300])
                line = line[: number.start()] + repr(float(number.group()) * scale) + line[number.end() :]
        lines[at : at + 1] = [line]
    return "\n".join(lines) + "\n"


def judge(text: str) -> tuple[str, float]:
    """("scene", "refused" or the type of what broke, seconds): what the loader makes of a text."""
    begun = time.perf_counter()
    try:
        with quiet():
            scene_from_text(text, "fuzzed.yaml")
        found = "scene"
    except SceneError as error:
        found = "refused" if str(error).strip() else "refused without a word"
    except Exception as error:  # what the test is after: anything but a SceneError is a traceback for the user
        found = f"{type(error).__name__}: {str(error)[:80]}"
    return found, time.perf_counter() - begun


@stress("10 000 parameter files, broken in up to four places, and canaries", "no traceback, no hang (<= 2 s each)")
def files(quick: bool) -> Found:
    """Seeded mutations of the shipped scenes, and texts made to break a YAML reader."""
    draw, count = random.Random(11), 150 if quick else 10_000
    scenes = [Path(find_scene(name)).read_text("utf-8") for name in shipped_scenes()]
    classes: dict[str, int] = {}
    longest, broken = 0.0, []
    texts = [(name, text) for name, text in CANARIES.items()]
    texts += [(f"mutation {k}", mutated(draw.choice(scenes), draw)) for k in range(count)]
    for name, text in texts:
        found, took = judge(text)
        longest = max(longest, took)
        classes[found] = classes.get(found, 0) + 1
        if found not in ("scene", "refused"):
            broken.append(f"{name}: {found}")
    metrics = [
        Metric("files", len(texts)),
        Metric("that are scenes", classes.get("scene", 0)),
        Metric("refused with a text", classes.get("refused", 0)),
        Metric("that broke the loader", len(broken), "", 0, IS),
        Metric("longest time for a file", longest, "s", 2.0),
    ]
    return Found(metrics, broken[:20] + (["shortened from 10 000"] if quick else []))
