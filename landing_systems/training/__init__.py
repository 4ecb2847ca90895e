"""How the learned parts of the landing systems were trained; nothing here is flown."""
