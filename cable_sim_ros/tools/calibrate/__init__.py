"""Numbers of a scene fitted to a recording, with intervals, judged on what was held out."""
