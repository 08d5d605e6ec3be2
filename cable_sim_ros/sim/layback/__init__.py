"""Where a towbody is behind its ship: the ways of the trade, and the static tow with an interval."""
