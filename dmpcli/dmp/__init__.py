"""The dynamic movement primitive and the admittance law, as pure functions of arrays."""
