"""Hostile files: every reader on thousands of damaged and crafted inputs, each reproducible.

Each reader starts from sound files and reads mutations of them. A mutation must be read, or refused
as an input (`InputError`, exit code 2); what else comes out is told with the number that makes it
again::

    python -m benchmarks.mutations [--count N] [--seed S] [--jobs J] [--keep FOLDER] [READER ...]
    python -m benchmarks.mutations --again READER NUMBER [--seed S]    # one, with its traceback

Readers run in forked processes whose memory is bounded: in which an alarm ends what takes five
seconds of the processor, and which their parent ends where the alarm is not heard, or replaces
where they die.
"""
