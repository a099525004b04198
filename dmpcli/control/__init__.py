"""The control cycle of `record` and `execute`, with its guards, logs and instruments."""
