"""A simulated EC66 that speaks its controller's bytes, and the lab that it stands in."""
