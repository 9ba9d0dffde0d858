"""weftform: forming simulation of dry woven reinforcements."""
