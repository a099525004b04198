"""Settings of `execute`."""
