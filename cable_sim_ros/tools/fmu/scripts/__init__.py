"""What an FMU runs: each file is packed into one as it stands, and started by its exporter's binary."""
