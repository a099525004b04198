"""What people look at: the paper's figures, drawn from records."""

from dmpcli.figures import font_cache

font_cache.choose()  # before any module here imports matplotlib
