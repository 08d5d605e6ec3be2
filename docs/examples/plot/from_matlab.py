"""Tension and ship motion of an exported run: a MAT file, by scipy. Usage: python3 from_matlab.py tow.mat tow.png"""

import sys

from matplotlib.figure import Figure
from scipy.io import loadmat

source, picture = sys.argv[1:]
run = loadmat(source, squeeze_me=True, struct_as_record=False)
ticks, units, said = run["ticks"], run["units"], run["provenance"]
figure = Figure(figsize=(9, 6), layout="constrained")
upper, lower = figure.subplots(2, sharex=True)
upper.plot(ticks.elapsed, ticks.tension)
upper.set_ylabel(f"tension [{units.tension}]")
upper.set_title(f"{said.scene}, verdict {said.verdict}")
lower.plot(ticks.elapsed, ticks.ship_position[:, 2])
lower.set_ylabel(f"heave [{units.ship_position}]")
lower.set_xlabel(f"elapsed [{units.elapsed}]")
figure.savefig(picture)
print(f"{len(ticks.time)} ticks, tension {ticks.tension.mean():.2f} N")
