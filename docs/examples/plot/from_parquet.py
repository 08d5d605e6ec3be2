"""Tension and pay-out of an exported run: Parquet, by pyarrow. Usage: python3 from_parquet.py tow.parquet tow.png"""

import sys

import pyarrow.parquet
from matplotlib.figure import Figure

source, picture = sys.argv[1:]
table = pyarrow.parquet.read_table(source, columns=["elapsed", "tension", "payout"])  # reads these alone
said = {key.decode(): text.decode() for key, text in table.schema.metadata.items()}
figure = Figure(figsize=(9, 6), layout="constrained")
panels = figure.subplots(2, sharex=True)
for panel, name in zip(panels, ("tension", "payout")):
    unit = table.schema.field(name).metadata[b"unit"].decode()
    panel.plot(table["elapsed"], table[name])
    panel.set_ylabel(f"{name} [{unit}]")
panels[0].set_title(f"{said['scene']}, verdict {said['verdict']}")
panels[1].set_xlabel("elapsed [s]")
figure.savefig(picture)
print(f"{table.num_rows} ticks, tension {table['tension'].to_numpy().mean():.2f} N")
