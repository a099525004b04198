"""The admittance law, what the sensor's wrench goes through, and the force coupling."""
