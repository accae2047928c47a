"""What to choose and what to warn of, judged from a System and a duration."""
