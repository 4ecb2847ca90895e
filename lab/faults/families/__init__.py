"""The faulty landing systems, one module for each family of public reports."""
