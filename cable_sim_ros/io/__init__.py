"""Floor 2: bytes. YAML, bags, MCAP, channels. No rclpy."""
