"""Kernels: what `metrics` does by numpy for many strokes at once, compiled, stroke by stroke."""
