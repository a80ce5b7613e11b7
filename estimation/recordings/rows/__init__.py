"""One log, made ready once: its columns, times, repairs, and which of its rows hold no information. All on demand."""
