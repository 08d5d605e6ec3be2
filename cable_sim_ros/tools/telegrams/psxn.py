"""PSXN,23 of Kongsberg Seapath: roll, pitch, heading, heave.

    $PSXN,23,0.35,-1.74,218.26,0.58*13<CR><LF>

Roll [deg] positive port side up, pitch [deg] positive bow up, heading [deg], heave [m] positive DOWN; two decimals, as
many digits in front as it takes. Sources: log of NBP1406, all 625 lines of which fit, where heave positive down is
proven by the height of its antenna; terminology of the Seapath 320 installation manual (roll, pitch and heave).
"""

from __future__ import annotations

from math import degrees

from .fields import Motion, heading_of, sentence, within

MOST_HEAVE = 9999.99  # m; the format sets no bound


def encode(values: Motion) -> bytes:
    """A telegram; Withheld where a value does not fit its field."""
    roll = within("roll", degrees(values.roll), -180.0, 180.0, "deg")
    pitch = within("pitch", degrees(-values.pitch), -90.0, 90.0, "deg")
    heave = within("heave", -values.heave, -MOST_HEAVE, MOST_HEAVE, "m")
    within("yaw", values.yaw, -7.0, 7.0, "rad")
    return sentence(f"PSXN,23,{roll:.2f},{pitch:.2f},{heading_of(values.yaw)},{heave:.2f}")
