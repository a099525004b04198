"""Kernels: what `numpy` does for all walks at once, compiled, for one after the other."""
