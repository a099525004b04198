"""Each setting once: its name, default, unit, help, range and choices; options are made from it."""
