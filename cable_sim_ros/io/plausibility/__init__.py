"""Do the parts of motion messages fit each other? Wrong units, axes and sudden misfits by name."""
