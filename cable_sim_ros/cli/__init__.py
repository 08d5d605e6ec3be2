"""The command line ``cable-sim``: a file for each group of commands."""
