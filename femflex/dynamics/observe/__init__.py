"""What a run reports, each subject a `Report` in a file of its own, which `dynamics.report.reports` discovers."""
