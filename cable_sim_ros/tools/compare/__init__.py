"""Scores of measured against simulated: how two signals of one quantity agree, and how well that is known."""
