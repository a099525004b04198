"""Identifying the cell: poses driven for the tool calibration, points touched for the part."""
