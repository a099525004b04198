"""Units that a Net F/T box may be set to, by the names and numbers that it uses for them.

Source: ATI Net F/T manual 9620-05-Net FT, chapters 8 and 11 (READCALINFO's numbers).
"""

NEWTONS = {
    "lbf": 4.4482216152605,
    "n": 1.0,
    "klbf": 4448.2216152605,
    "kn": 1e3,
    "kgf": 9.80665,
    "kg": 9.80665,
}
"""N in one unit of force."""

NEWTON_METRES = {
    "lbfin": 0.1129848290276167,
    "lbfft": 1.3558179483314004,
    "nm": 1.0,
    "nmm": 1e-3,
    "kgfcm": 0.0980665,
    "kgcm": 0.0980665,
    "knm": 1e3,
}
"""N·m in one unit of torque, by the name without hyphen or point: boxes write N-m as well as Nm."""

FORCE_NUMBERS = {1: "lbf", 2: "N", 3: "klbf", 4: "kN", 5: "kgf"}
TORQUE_NUMBERS = {1: "lbf-in", 2: "lbf-ft", 3: "N-m", 4: "N-mm", 5: "kgf-cm", 6: "kN-m"}


def newtons(unit: str) -> float:
    """N in one unit of this name; KeyError where there is none."""
    return NEWTONS[_plain(unit)]


def newton_metres(unit: str) -> float:
    """N·m in one unit of this name; KeyError where there is none."""
    return NEWTON_METRES[_plain(unit)]


def _plain(unit: str) -> str:
    return "".join(c for c in unit.strip().lower() if c not in "-·*. ")
