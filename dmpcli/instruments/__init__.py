"""Sensors and robots behind two small protocols, one module per make."""
