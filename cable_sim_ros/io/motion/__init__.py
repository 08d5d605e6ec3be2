"""Ship motion on its way to the simulation: order, clocks, stamps, and what of it is remembered."""
