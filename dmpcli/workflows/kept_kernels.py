"""The kernels of a report, loaded with this module: processes that are forked then have them.

Nothing is compiled: kernels that no earlier run left are compiled where somebody is told of it.
"""

from dmpcli.reporting import ready_kernels
from dmpcli.workflows import kernels

if kernels.kept(ready_kernels):
    ready_kernels.load()
