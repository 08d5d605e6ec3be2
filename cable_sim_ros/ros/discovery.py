"""How far the node is seen: this host, unless asked for more.

The range is a matter of the middleware and must be set before rclpy starts, so it is no ROS parameter.
"""

from __future__ import annotations

import os
from collections.abc import MutableMapping, Sequence

RANGE, OLD = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"
OPEN = "--open"  # command-line option: seen by the subnet


def limit(arguments: Sequence[str], environment: MutableMapping[str, str] = os.environ) -> tuple[list[str], str]:
    """Set the discovery range in the environment, where nothing there has set it.

    arguments: of the command line. Returns them without --open, and a sentence for the user. Of `--open`, the
    environment and this host, the first that is given counts.
    """
    kept = [argument for argument in arguments if argument != OPEN]
    if len(kept) < len(arguments):
        environment[RANGE] = "SUBNET"
        environment.pop(OLD, None)
        return kept, f"discovery: SUBNET ({OPEN}): every host of the subnet may listen and send"
    if environment.get(RANGE):
        return kept, f"discovery: {environment[RANGE]} (environment variable {RANGE})"
    if environment.get(OLD):
        return kept, f"discovery: {OLD}={environment[OLD]} (environment variable)"
    environment[RANGE] = "LOCALHOST"
    return kept, f"discovery: this host only; {OPEN} or {RANGE}=SUBNET opens it to the subnet"
