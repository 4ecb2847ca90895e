"""How TPHYolo-MLS's networks were trained: data, losses, export and scores."""
