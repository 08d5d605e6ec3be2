"""A recorded run as files of other programs: CSV, NetCDF, Parquet, MATLAB."""
