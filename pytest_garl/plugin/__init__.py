"""All that knows pytest: hooks, options, items, fixtures, outcomes and the summary."""
