"""The benchmark of heave compensators, `cable-sim ahc`: scenes, motions and classes that two teams can compare by."""
