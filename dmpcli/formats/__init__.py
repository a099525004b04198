"""Files of other programs, written and read: tables, polylines, robot programs, bags, datasets."""
