"""The mock lab: a simulated arm, plate and sensor for rehearsing without hardware."""

from dmpcli.instruments.mock.faces import MockSensor, MockServo
from dmpcli.instruments.mock.lab import Lab
from dmpcli.instruments.mock.parameters import PEN, PEN_DOWN, Faults, Plate, Scene
from dmpcli.instruments.mock.wrist import Hand

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
