"""Where scenes and recorded bags lie: with pip, with colcon, in a source checkout.

The folder nearest above the running code wins, so that code and data are of the same version: the checkout itself,
or ``share/cable_sim_ros`` of the prefix the code is installed in. Only then the ament index is asked.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from ...errors import CableSimError
from ...files import read_text

PACKAGE = "cable_sim_ros"
CODE = Path(__file__).resolve().parents[2]
RUN_BAG = "tow"  # in the folder of a run


class ResourceError(CableSimError, ValueError):
    """No file of that name; the text lists what there is."""


def share_folder(code: Path = CODE, environ=os.environ) -> Path:
    """Folder with ``config/`` and ``bags/``; raises ResourceError when the installation has none."""
    candidates = [code.parent]
    candidates += [parent / "share" / PACKAGE for parent in code.parents]
    prefixes = [*filter(None, environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)), sys.prefix]
    candidates += [Path(prefix) / "share" / PACKAGE for prefix in prefixes]
    for folder in candidates:
        if (folder / "package.xml").is_file() and (folder / "config").is_dir():
            return folder
    raise ResourceError(
        f"no folder share/{PACKAGE} with config/ beside the code in {code}; nothing was started. "
        "Install the package again, or give full paths of files"
    )


def shipped_scenes() -> list[str]:
    """Names of the scenes in ``config/``, sorted."""
    return sorted(path.stem for path in (share_folder() / "config").glob("*.yaml") if not is_span(path))


def shipped_spans() -> list[str]:
    """Names of the spans in ``config/``, sorted."""
    return sorted(path.stem for path in (share_folder() / "config").glob("*.yaml") if is_span(path))


def is_span(path: Path) -> bool:
    """Is a file in ``config/`` one of a span, by its key at the top?"""
    return any(line.startswith("span:") for line in read_text(path).splitlines())


def shipped_bags() -> list[str]:
    """Names of the recorded bags in ``bags/`` (directories with a metadata.yaml), sorted."""
    return sorted(path.parent.name for path in (share_folder() / "bags").glob("*/metadata.yaml"))


def find_scene(path_or_name: str | os.PathLike) -> Path:
    """Path of a scene: a file, or the name of a shipped one with or without ``.yaml``."""
    return _find(path_or_name, "scene", "config", shipped_scenes, (".yaml", ""), _no_folder)


def shipped_viv() -> list[str]:
    """Names of the spans in ``config/viv/`` whose vibration ``cable-sim viv`` computes, sorted."""
    return sorted(path.stem for path in (share_folder() / "config" / "viv").glob("*.yaml"))


def find_viv(path_or_name: str | os.PathLike) -> Path:
    """Path of a span for ``cable-sim viv``: a file, or the name of a shipped one with or without ``.yaml``."""
    return _find(path_or_name, "span", "config/viv", shipped_viv, (".yaml", ""), _no_folder)


def find_span(path_or_name: str | os.PathLike) -> Path:
    """Path of a span in a wind: a file, or the name of a shipped one with or without ``.yaml``."""
    return _find(path_or_name, "span", "config", shipped_spans, (".yaml", ""), _no_folder)


def find_bag(path_or_name: str | os.PathLike) -> Path:
    """Path of a bag: a bag directory or MCAP file, the folder of a run with its bag in it, or the name of a shipped
    one."""
    found = _find(path_or_name, "bag", "bags", shipped_bags, ("",), Path.exists)
    inside = found / RUN_BAG
    return inside if inside.is_dir() and not (found / "metadata.yaml").exists() else found


def shipped_mappings() -> list[str]:
    """Names of the ready mappings of logs in ``config/mappings/``, sorted."""
    return sorted(path.stem for path in (share_folder() / "config" / "mappings").glob("*.yaml"))


def find_mapping(path_or_name: str | os.PathLike) -> Path:
    """Path of a mapping of a log: a file, or the name of a ready one with or without ``.yaml``."""
    return _find(path_or_name, "mapping", "config/mappings", shipped_mappings, (".yaml", ""), _no_folder)


def shipped_tows() -> list[str]:
    """Names of the tables of measured tows in ``bags/tows/``, each with a map in ``config/tows/``, sorted."""
    return sorted(path.stem for path in (share_folder() / "bags" / "tows").glob("*.csv"))


def find_tow_table(path_or_name: str | os.PathLike) -> Path:
    """Path of a table of measured tows: a file, or the name of a shipped one with or without ``.csv``."""
    return _find(path_or_name, "table of tows", "bags/tows", shipped_tows, (".csv", ""), _no_folder)


def find_tow_map(path_or_name: str | os.PathLike) -> Path:
    """Path of a map of a table of tows: a file, or the name of a shipped one with or without ``.yaml``."""
    return _find(path_or_name, "map of tows", "config/tows", shipped_tows, (".yaml", ""), _no_folder)


def _no_folder(path: Path) -> bool:
    """Is anything there that is no folder? Whether it can be read says the one who opens it."""
    return path.exists() and not path.is_dir()


def _find(path_or_name, what, folder, shipped, suffixes, test) -> Path:
    given = Path(path_or_name)
    if test(given):
        return given
    if given.parent == Path("."):
        for suffix in suffixes:
            candidate = share_folder() / folder / (given.name + suffix)
            if test(candidate):
                return candidate
    names = ", ".join(shipped()) or "none"
    raise ResourceError(
        f"{given}: no such {what} file; nothing was started. "
        f"Give the path of a {what}, or the name of a shipped one: {names}"
    )
