"""One module per subcommand: read, call, write, tell. No mathematics here."""
