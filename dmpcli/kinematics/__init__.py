"""Arms: forward and inverse kinematics, and whether a stroke can be reached; pure arrays."""
