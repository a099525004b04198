"""A simulated force/torque box that speaks the real one's bytes."""
