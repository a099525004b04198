"""Where things are and how they move: the values that every room above takes and gives."""
