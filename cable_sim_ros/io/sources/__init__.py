"""Where a run takes its ship motion from: recorded tows, bags, tables, coarse numbers smoothed."""
