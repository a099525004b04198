"""Surfaces and the charts that carry a stroke onto them."""
