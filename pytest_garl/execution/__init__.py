"""How flights get flown: jobs, the ledger with its queue, pools of processes."""
