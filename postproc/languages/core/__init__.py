"""What the families of languages share when they follow a program: maps of facts that branches share and merge."""
