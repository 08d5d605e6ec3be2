"""PASHR of Applanix POS MV: time, heading, roll, pitch, heave, their accuracies.

    $PASHR,145719.272,252.41,T,1.22,0.48,0.01,0.090,0.090,0.116,2,1*11<CR><LF>

UTC hhmmss.sss; heading [deg]; T; roll [deg] positive port side up; pitch [deg] positive bow up; heave [m]; standard
deviations of roll, pitch, heading [deg]; aiding (0 none, 1 GNSS, 2 GNSS and GAMS); IMU (0 out, 1 satisfactory). Angles
are those of Tait and Bryan. Source: POS MV V5 Installation and Operation Guide, PUBS-MAN-004291 rev. 16, table 20, for
fields and ranges; the example above from a public parser. The sign of the heave was found in none of
these: a key sets it.
"""

from __future__ import annotations

from math import degrees

from .fields import Motion, heading_of, moment, sentence, within


def encode(values: Motion, heave_up: bool = True) -> bytes:
    """A telegram, of standard deviations 0, aiding 2, IMU 1; Withheld where a value does not fit its field."""
    at = moment(values.time)
    roll = within("roll", degrees(values.roll), -90.0, 90.0, "deg")
    pitch = within("pitch", degrees(-values.pitch), -90.0, 90.0, "deg")
    heave = within("heave", values.heave if heave_up else -values.heave, -99.0, 99.0, "m")
    within("yaw", values.yaw, -7.0, 7.0, "rad")
    return sentence(
        f"PASHR,{at:%H%M%S}.{at.microsecond // 1000:03d},{heading_of(values.yaw)},T,{roll:.2f},{pitch:.2f},{heave:.2f},"
        f"0.000,0.000,0.000,2,1"
    )
