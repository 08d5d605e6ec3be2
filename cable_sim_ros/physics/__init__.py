"""Floor 0: numbers. One physics, one file. No files, no clock, no ROS."""
