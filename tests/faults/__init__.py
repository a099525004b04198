"""A laboratory in simulated time: whole commands, real drivers, seeded faults, and a judge.

``python -m tests.faults`` runs seeds by the thousand; one seed replays one failure.
"""
