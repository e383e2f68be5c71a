"""What people look at: contact sheets, statistics, report."""
