"""What people look at: the paper's figures, drawn from records."""

from dmpcli.reporting import font_cache

font_cache.choose()  # before any module here imports matplotlib
