"""A span of cable in a flow: its file, its wake in time, its vibration in the frequency domain."""
