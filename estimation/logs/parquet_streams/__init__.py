"""Logs in Parquet files that are read by ranges of rows."""

from estimation.logs.parquet_streams.log_stream import PAUSE, LogStream, is_large, open_stream

__all__ = ["PAUSE", "LogStream", "is_large", "open_stream"]
