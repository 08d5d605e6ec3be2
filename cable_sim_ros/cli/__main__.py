"""``python -m cable_sim_ros.cli``."""

import gc

from ..limits import GARBAGE
from .commands import main

gc.set_threshold(*GARBAGE)
main()
