"""The base model on a recording: its columns, its priors, and known payloads and gravity."""
