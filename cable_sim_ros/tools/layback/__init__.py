"""Layback of a recording or of a log: the simulated place of the towbody beside the ways of the trade."""
