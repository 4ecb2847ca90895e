"""Runs flights: jobs, the ledger with its queue, pools of processes."""
