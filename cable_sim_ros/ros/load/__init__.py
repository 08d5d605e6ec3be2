"""Processes for load tests: a flood of calls, a listener that keeps times, a ship that sends."""
