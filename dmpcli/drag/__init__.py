"""Settings of `record`."""
