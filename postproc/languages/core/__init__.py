"""What the families of languages share: maps of facts that branches share and merge, what is stated of rows beside
their targets, and a plan beside the rows that it is made for."""
