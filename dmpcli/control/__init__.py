"""The control cycle of `record` and `execute`, its guards, its logs, and what it is put together of."""
