"""What each subcommand does, as functions on values; the commands and the Python API call it."""
