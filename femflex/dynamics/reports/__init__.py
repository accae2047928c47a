"""What a run reports at every row: channels, places, monitors."""
