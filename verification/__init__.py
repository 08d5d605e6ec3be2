"""Laboratory over floors 0 to 2: cases, experiments, stress, benchmark with peers, rig; no product imports it."""
