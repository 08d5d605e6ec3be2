"""Stamps of loggers."""

import pytest

from cable_sim_ros.tools.logs.log import EPOCH, MONTH_FIRST, NO_ZONE, UTC, stamp_of

AT = 1_406_851_202_160_000_000  # 2014-08-01T00:00:02.16Z


@pytest.mark.parametrize(
    "text, form",
    [
        ("2014-08-01T00:00:02.16Z ", UTC),
        ("2014-08-01T00:00:02.160000Z\t", UTC),
        ("2014-08-01T02:00:02.16+02:00 ", UTC),
        ("2014-07-31T18:30:02.16-0530,", UTC),
        ("2014-08-01 00:00:02.160 ", NO_ZONE),
        ("2014/08/01 00:00:02.160 ", NO_ZONE),
        ("[2014-08-01 00:00:02.160] ", NO_ZONE),
        ("20140801T000002.16Z: ", UTC),
        ("2014-08-01-00:00:02.16,", NO_ZONE),
        ("1406851202.16 ", EPOCH),
        ("1406851202160 ", EPOCH),
        ("1406851202160000,", EPOCH),
        ("1406851202160000000\t", EPOCH),
        ("(1406851202.160000) ", EPOCH),
        ("08/01/2014,00:00:02.16,", MONTH_FIRST),
        ("\\s:gps,c:1406851202160*5B\\", EPOCH),
    ],
)
def test_a_stamp_and_where_it_ends(text, form):
    found = stamp_of(text.encode() + b"$GPHDT,1.0,T")
    assert found is not None and (found.time, found.form) == (AT, form)
    assert (text.encode() + b"$GPHDT")[found.end :].lstrip(b": ") == b"$GPHDT"


@pytest.mark.parametrize(
    "text",
    ["", "$GPHDT", "2014-13-01T00:00:02Z ", "2014-08-01T25:00:02Z ", "2014-08-01", "140685120 ", "9999999999.5 ",
     "9999-08-01T00:00:00Z ", "13/31/2014,00:00:02.16,", "14068512021 ", "\\s:gps\\", "2014-08/01T00:00:00Z "],
)  # fmt: skip
def test_what_is_no_stamp(text):
    assert stamp_of(text.encode() + b"x") is None
