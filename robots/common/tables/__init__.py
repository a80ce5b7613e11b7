"""Tables in memory and in files: CSV and Parquet."""
