"""Every reader of instruments' logs against files cut off and flipped bits."""

import instrument_logs as logs
import numpy as np
import pytest
from hostile_logs import survive

from cable_sim_ros.tools.logs.formats import HEAD, TELEGRAMS

FILES = {
    "nmea0183": [logs.seapath(4), logs.seapath(4, stamped=False), logs.buoy(2)],
    "lci90i": [logs.winch(24)],
    "tss1": [logs.tss(40)],
    "profiler-winch": [logs.profiler(40)],
    "3dm-gx3": [logs.gx3(40)],
    "fdchp": [logs.fdchp(40)],
    "nmea2000": [logs.n2k(15)],
}
CASES = [(row, data) for row in TELEGRAMS for data in FILES[row.name]]
CHECKED = {"nmea0183", "lci90i", "3dm-gx3"}  # formats whose records carry a checksum


@pytest.mark.parametrize("row, data", CASES, ids=[row.name for row, _ in CASES])
def test_cuts_and_flips_cost_what_they_hit(row, data, tmp_path):
    module = row.reader
    path = tmp_path / "log"
    cuts, flips = survive(module.read, data, path)
    whole = module.read(path)
    assert not whole.losses
    for k, part in enumerate(cuts):
        assert part is None or abs(part.records - whole.records * k / 64) <= 3 + 0.05 * whole.records
    assert sum(part is None for part in cuts) <= 20  # a whole telegram of the wave buoy is long
    for part in flips if row.name in CHECKED else ():
        assert part is not None and part.records + part.losses.total + len(part.notices) >= whole.records
        for name, source in part.sources.items():  # what a checksum guards is right or lost
            for column, values in source.columns.items():
                assert np.isin(values, whole.sources[name].columns[column]).all(), (name, column)


@pytest.mark.parametrize("row, data", CASES, ids=[row.name for row, _ in CASES])
def test_a_format_is_found_by_its_first_bytes(row, data, tmp_path):
    found = [other.name for other in TELEGRAMS if other.reader.recognise(
        data[:HEAD], tmp_path / "x")]  # fmt: skip
    assert found == [row.name]
