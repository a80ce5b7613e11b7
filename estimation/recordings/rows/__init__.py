"""One log, made ready once: its columns, times, repairs, and which of its rows tell nothing. All on demand."""
