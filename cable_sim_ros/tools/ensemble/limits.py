"""Bounds, defaults and ranges of an ensemble that the command line and the node show too, without what simulates."""

from ...physics.parameter import Block, quantity

LEAST_COPIES, COPIES, MAX_COPIES = 5, 50, 1000
SEED, MAX_SEED = 1, 2**31 - 1


class Ranges(Block):
    """Half-widths of the 95 % intervals of what a layback hangs on."""

    drag: float = quantity(
        0.2,
        "1",
        0.0,
        0.8,
        "share of the drag of cable and bodies, but for that which lift induces",
        "choice: measured C_D of bare tow cables are 2.2 to 2.5, of calm ones 1.2 to 1.5 (docs/drag.md)",
    )
    speed: float = quantity(0.1, "m/s", 0.0, 3.0, "speed of the ship along its course", "choice: 0.2 kn")
    current: float = quantity(
        0.1, "m/s", 0.0, 3.0, "either horizontal component of a current that the scene does not have", "choice: 0.2 kn"
    )
    current_turn_deg: float = quantity(15.0, "deg", 0.0, 180.0, "direction of the current of the scene", "choice")
    payout: float = quantity(
        0.0, "m", 0.0, 1000.0, "cable out, as the counter shows it", "choice: the counter is taken as exact"
    )
