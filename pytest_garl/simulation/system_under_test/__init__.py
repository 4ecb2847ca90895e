"""What the landing system is shown and asked, and what is accepted of its answers."""
