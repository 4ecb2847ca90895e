"""What is shown while the items run and after them: header, progress, summary, saved cases."""
