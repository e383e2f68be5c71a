"""USD schema, profile schema and label taxonomy."""
