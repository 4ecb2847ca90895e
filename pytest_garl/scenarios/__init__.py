"""What is flown: genes, chromosomes, scenarios, maps and their files."""
