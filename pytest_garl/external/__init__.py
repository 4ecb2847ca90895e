"""Programs of any language that fly in lock-step with the simulator."""
