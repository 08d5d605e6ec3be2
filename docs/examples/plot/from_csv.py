"""Tension and depth of an exported run: CSV, by pandas. Usage: python3 from_csv.py tow.csv tow.png"""

import sys

import pandas
from matplotlib.figure import Figure

source, picture = sys.argv[1:]
with open(source, encoding="utf-8") as file:  # the lines in front, as "# key: text"
    said = dict(line[2:].rstrip("\n").split(": ", 1) for line in file if line.startswith("# ") and ": " in line)
table = pandas.read_csv(source, comment="#")  # before pandas 3 float_precision="round_trip" gives every bit

figure = Figure(figsize=(9, 6), layout="constrained")
upper, lower = figure.subplots(2, sharex=True)
upper.plot(table["elapsed [s]"], table["tension [N]"])
upper.set_ylabel("tension [N]")
upper.set_title(f"{said['scene']}, verdict {said['verdict']}")
lower.plot(table["elapsed [s]"], -table["body_position.z [m]"])
lower.set_ylabel("depth [m]")
lower.set_xlabel("elapsed [s]")
lower.invert_yaxis()
figure.savefig(picture)
print(f"{len(table)} ticks, tension {table['tension [N]'].mean():.2f} N")
