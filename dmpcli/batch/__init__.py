"""Drawing a table of start-goal pairs into a folder of parts: one machine or many."""
