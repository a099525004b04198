"""Tests of poses and trajectories."""
