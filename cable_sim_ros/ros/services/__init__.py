"""What may be asked of a running node: control, recordings, the standard interfaces, the policy."""
