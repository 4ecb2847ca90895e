"""Pictures of the groups of conditions: ``python -m studies.conditions NAME`` draws one group."""
