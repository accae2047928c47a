"""What a run reports, each subject a `Report` in a file of its own, which `report.reports()` discovers."""
