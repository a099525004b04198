"""dmpcli: one drag-taught stroke, drawn anywhere a position-servo arm can reach."""

__version__ = "0.1.0"
