"""Experiments: systems × maps × methods × seeds, flown run by run, and their report."""
