"""A bench with physics: an arm with a compliant pen over a surface, in MuJoCo and simulated time.

It is an optional part, ``pip install 'dmpcli[bench]'``; docs/bench.md says what it is made of.
"""
