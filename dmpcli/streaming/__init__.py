"""The loop of ``execute``: pre-flight checks, set-points on absolute deadlines, stops."""
