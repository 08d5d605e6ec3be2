"""A shipboard tow simulated in real time: ANCF cable, drum and sheave contact, moving water, ROS 2."""

__version__ = "0.1.0"
