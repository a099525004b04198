"""The control cycle under `record`, `execute` and playback."""
