"""Run time against error, in turns: ticks, tows, hauls, water, one commit against another."""
