"""The motion from rest to rest with the least jerk: what reference strokes of the tests move by."""


def minimum_jerk(u):
    """Share of the way after the share `u` of the time, 0 to 1; any shape."""
    return 10 * u**3 - 15 * u**4 + 6 * u**5
