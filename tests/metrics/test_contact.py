import numpy as np

from dmpcli.metrics.contact import ContactMeasures, contact


def test_forces_at_or_below_the_threshold_are_no_contact():
    said = contact(np.array([-0.1, 0.5, 1.0, 4.6]), 0.5)
    assert said == ContactMeasures(-0.1, 1.5, 4.6, 0.5, 0.5)
