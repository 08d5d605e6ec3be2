"""Tension and cable of an exported run: NetCDF with the table shape. Usage: python3 from_netcdf.py tow.nc tow.png"""

import sys

import xarray
from matplotlib.figure import Figure

source, picture = sys.argv[1:]
with xarray.open_dataset(source, engine="h5netcdf") as run:
    figure = Figure(figsize=(9, 6), layout="constrained")
    upper, lower = figure.subplots(2)
    upper.plot(run["time"], run["tension"])  # times are decoded: datetime64[ns]
    upper.set_ylabel(f"tension [{run['tension'].attrs['units']}]")
    upper.set_title(f"{run.attrs['scene']}, verdict {run.attrs['verdict']}")
    last = run.isel(shape_time=-1)  # nan where an instant has fewer points
    points = lower.scatter(last["shape_x"], last["shape_z"], c=last["shape_tension"])
    figure.colorbar(points, label="tension [N]")
    lower.set_xlabel(f"x [{run['shape_x'].attrs['units']}]")
    lower.set_ylabel(f"z [{run['shape_z'].attrs['units']}]")
    figure.savefig(picture)
    print(f"{run.sizes['time']} ticks, tension {float(run['tension'].mean()):.2f} N")
