"""What people look at: tables, charts, pictures beside predictions, the report."""
