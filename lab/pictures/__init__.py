"""Tools that draw pictures for people."""
