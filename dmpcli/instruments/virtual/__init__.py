"""Simulated instruments that speak the real ones' bytes, served on loopback."""
