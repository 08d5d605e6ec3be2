"""``python -m cable_sim_ros.cli``."""

from .commands import main

main()
