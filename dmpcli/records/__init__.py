"""The Parquet and JSON contracts between the stages, and their provenance."""
