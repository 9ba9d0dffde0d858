"""How fast the solver is on this machine, beside a hand-written C program and the machine's own peaks."""
