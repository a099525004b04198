"""The mock lab: a simulated arm, plate and sensor for rehearsing without hardware."""

from dmpcli.simulation.mock.contact import Hand
from dmpcli.simulation.mock.instruments import MockSensor, MockServo
from dmpcli.simulation.mock.lab import Lab
from dmpcli.simulation.mock.parameters import PEN, PEN_DOWN, Faults, Plate, Scene

__all__ = [
    "PEN",
    "PEN_DOWN",
    "Faults",
    "Hand",
    "Lab",
    "MockSensor",
    "MockServo",
    "Plate",
    "Scene",
]
