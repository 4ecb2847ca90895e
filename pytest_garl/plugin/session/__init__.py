"""What happens while the items run: searches, and the outcome and report of each item."""
