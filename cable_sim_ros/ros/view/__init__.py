"""The end of the node's topics that only listens, for the page of `cable-sim view`."""
