"""Stress: stability N1 to N28, bags and recordings I and S. Stimulus, measured, limit. ``cable-sim stress``."""

from __future__ import annotations

from collections.abc import Callable

from . import (
    i10_s02_s03_damaged_bags,
    i11_i12_i14_i16_s01_recordings,
    n01_n02_slack_and_dead_stop,
    n03_load_reversals,
    n04_n18_climbing_and_pressing,
    n05_n06_n15_stiffness_and_order,
    n07_n11_long_cable_and_long_run,
    n08_n14_overspeed_and_cold_start,
    n09_n10_n12_heavy_sea_and_energy,
    n13_n16_n17_n19_exactness,
    n20_n21_n22_winch_at_work,
    n23_n24_n25_travel_and_account,
    n26_random_scenes,
    n27_starts,
    n28_processors,
)
from .verdict import Stress, Verdict, run_test

STRESS: dict[str, Stress] = {
    "N1": n01_n02_slack_and_dead_stop.slack,
    "N2": n01_n02_slack_and_dead_stop.dead_stop,
    "N3": n03_load_reversals.reversals,
    "N4": n04_n18_climbing_and_pressing.climb,
    "N5": n05_n06_n15_stiffness_and_order.without_bending,
    "N6": n05_n06_n15_stiffness_and_order.stiffness,
    "N7": n07_n11_long_cable_and_long_run.long_cable,
    "N8": n08_n14_overspeed_and_cold_start.winch,
    "N9": n09_n10_n12_heavy_sea_and_energy.heavy,
    "N10": n09_n10_n12_heavy_sea_and_energy.steps,
    "N11": n07_n11_long_cable_and_long_run.day,
    "N12": n09_n10_n12_heavy_sea_and_energy.energy,
    "N13": n13_n16_n17_n19_exactness.repeat,
    "N14": n08_n14_overspeed_and_cold_start.cold,
    "N15": n05_n06_n15_stiffness_and_order.order,
    "N16": n13_n16_n17_n19_exactness.symmetries,
    "N17": n13_n16_n17_n19_exactness.waterline,
    "N18": n04_n18_climbing_and_pressing.pressed,
    "N19": n13_n16_n17_n19_exactness.spin,
    "N20": n20_n21_n22_winch_at_work.wave,
    "N21": n20_n21_n22_winch_at_work.working,
    "N22": n20_n21_n22_winch_at_work.joint,
    "N23": n23_n24_n25_travel_and_account.reversing,
    "N24": n23_n24_n25_travel_and_account.last_metre,
    "N25": n23_n24_n25_travel_and_account.account,
    "N26": n26_random_scenes.scenes,
    "N27": n27_starts.starts,
    "N28": n28_processors.processors,
    "I10": i10_s02_s03_damaged_bags.damaged,
    "I11": i11_i12_i14_i16_s01_recordings.bad_disk,
    "I12": i11_i12_i14_i16_s01_recordings.killed,
    "I14": i11_i12_i14_i16_s01_recordings.wrong_places,
    "I16": i11_i12_i14_i16_s01_recordings.accounting,
    "S1": i11_i12_i14_i16_s01_recordings.names,
    "S2": i10_s02_s03_damaged_bags.no_bags,
    "S3": i10_s02_s03_damaged_bags.enormous,
}


def run(ids: tuple[str, ...], quick: bool, progress: Callable = lambda *_: None) -> list[Verdict]:
    """Run the chosen tests (all where none are named), in the order of STRESS."""
    chosen = [name for name in STRESS if not ids or name in ids]
    verdicts = []
    for i, name in enumerate(chosen):
        progress(f"{name} {STRESS[name].stimulus}", i, len(chosen))
        verdicts.append(run_test(name, STRESS[name], quick))
    return verdicts
