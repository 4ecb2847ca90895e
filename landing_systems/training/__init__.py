"""Trains the learned parts of the landing systems; no flight uses this code."""
